// How a body is pushed that has no Green's functions.
#pragma once

#include "formats/model.h"
#include "runtime/loop/settings.h"

namespace palpate {

/// Settings for a body whose file has no Green's functions: it is solved while it is touched, by the
/// corotational law. One that nothing holds falls into a room three times its size, half its size deep,
/// and keeps deep dents. Empty for every other body.
[[nodiscard]] SettingsText solved_settings(const Model& outline);

/// As options of `palpate-runtime play`: "--gravity 0,-9.81,0 --solver corotational".
[[nodiscard]] std::string option_text(const SettingsText& settings);

}  // namespace palpate
