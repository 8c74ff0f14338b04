// `palpate-precompute inspect`: the contents of a file.
#pragma once

#include <string>

#include "formats/model.h"

namespace palpate {

/// A page of text about a loaded model: sizes, material, scope, mesh quality with histogram, sources.
std::string inspect(const Model& model);

}  // namespace palpate
