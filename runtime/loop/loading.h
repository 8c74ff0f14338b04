// Loads a body from a file, with a warning on models that are out of date.
#pragma once

#include <filesystem>
#include <memory>

#include "formats/outputs/output_paths.h"
#include "runtime/background/patch_source.h"
#include "runtime/body/body.h"
#include "runtime/body/met_surface.h"
#include "runtime/depth/deep_body.h"
#include "runtime/live/live_settings.h"

namespace palpate {

/// Options for making a body from a file.
struct BodyOptions {
  int refinement = 1;   ///< refinement of the surface, see Body
  double radius = 0.0;  ///< [m] if not 0: of a tool, for which its compliance is local (LocalCompliance) and
                        ///< its surface round and fine, if its mesh is coarse
  bool graded = false;  ///< there are graded overlays for that tool
  PatchLaw overlay_law = PatchLaw::linear;
  ContactModel contact = ContactModel::quasi_static;
  double load_scale = 1.0;  ///< see scale_loads
  double stiffness_scale = 1.0;
  LiveSettings live{};
  Depth depth = Depth::no;

  [[nodiscard]] bool has_overlays() const noexcept { return refinement > 1 || graded; }
  bool operator==(const BodyOptions&) const = default;
};

/// The surface that tools meet of a body with these options.
[[nodiscard]] MetSurface met_surface(const Model& model, const BodyOptions& options);

/// Loads `file` and prints a warning for each source that has changed since. If `model_toml` is not empty,
/// the file must have been made from exactly that description. Throws Error.
Body load_body(const std::filesystem::path& file, const std::filesystem::path& model_toml,
               const BodyOptions& options = {});

/// Loads a body and prints its properties and the loading time as one line to the error stream.
std::unique_ptr<const Body> load_and_print(const std::filesystem::path& file,
                                           const std::filesystem::path& model_toml,
                                           const BodyOptions& options);

/// Adds the sources of a model as inputs of a run, so that no output overwrites them. Throws Error.
void add_sources(OutputPaths& paths, const Model& model, const std::filesystem::path& file);

}  // namespace palpate
