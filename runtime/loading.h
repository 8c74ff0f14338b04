// From a file to a body that can be touched, with a word on models that are out of date.
#pragma once

#include <filesystem>

#include "runtime/body.h"

namespace palpate {

/// Loads `file` and prints a warning for each source that is no longer what it was. With `model_toml` (else
/// empty) the file must have been made from exactly that description. `refinement`: of the surface, see Body.
/// Throws Error.
Body load_body(const std::filesystem::path& file, const std::filesystem::path& model_toml, int refinement = 1,
               ContactModel contact = ContactModel::quasi_static);

}  // namespace palpate
