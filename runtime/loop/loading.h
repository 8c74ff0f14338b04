// From a file to a body that can be touched, with a word on models that are out of date.
#pragma once

#include <filesystem>
#include <memory>

#include "formats/outputs/output_paths.h"
#include "runtime/background/patch_source.h"
#include "runtime/body/body.h"
#include "runtime/live/live_settings.h"

namespace palpate {

/// What of a file is made a body.
struct BodyOptions {
  int refinement = 1;  ///< of the surface, see Body
  PatchLaw overlay_law = PatchLaw::linear;
  ContactModel contact = ContactModel::quasi_static;
  double load_scale = 1.0;  ///< see scale_loads
  double stiffness_scale = 1.0;
  LiveSettings live{};
  bool warp = false;  ///< Green's functions turn with the body, see SurfaceWarp

  bool operator==(const BodyOptions&) const = default;
};

/// Loads `file` and prints a warning for each source that is no longer what it was. With `model_toml` (else
/// empty) the file must have been made from exactly that description. Throws Error.
Body load_body(const std::filesystem::path& file, const std::filesystem::path& model_toml,
               const BodyOptions& options = {});

/// Loads a body, with a line on the error stream about what was loaded and how long it took.
std::unique_ptr<const Body> load_and_print(const std::filesystem::path& file,
                                           const std::filesystem::path& model_toml,
                                           const BodyOptions& options);

/// What a model was made from, as inputs of a run: it must not be lost either. Throws Error.
void add_sources(OutputPaths& paths, const Model& model, const std::filesystem::path& file);

}  // namespace palpate
