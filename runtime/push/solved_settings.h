// Settings for pushing a body without Green's functions.
#pragma once

#include "formats/model.h"
#include "runtime/loop/settings.h"

namespace palpate {

/// Returns settings for a body whose file has no Green's functions: it is solved during the touch by the
/// corotational law. A body without supports falls inside a box three times its size, half its size deep, and
/// keeps deep dents. Empty for any other body.
[[nodiscard]] SettingsText solved_settings(const Model& outline);

/// Formats options of `palpate-runtime play`: "--gravity 0,-9.81,0 --solver corotational".
[[nodiscard]] std::string option_text(const SettingsText& settings);

}  // namespace palpate
