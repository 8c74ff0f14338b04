#include "runtime/loop/loading.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "base/regular_file.h"
#include "formats/model_check.h"
#include "formats/model_file.h"
#include "matrices/hierarchical.h"
#include "overlay/patch_mesh.h"
#include "runtime/body/scaled_model.h"
#include "runtime/depth/deep_body.h"
#include "runtime/live/live_model.h"
#include "runtime/loop/output.h"

namespace palpate {
namespace {

/// Prints a warning once, although a page reloads the body when its settings change.
void warn_once(const std::string& text) {
  static std::mutex mutex;
  static std::set<std::string> told;
  const std::lock_guard lock(mutex);
  if (told.insert(text).second) print_warning(text);
}

void print_loaded(const Body& body, double seconds) {
  const HierarchicalMatrix* compressed = body.greens().compressed_form();
  const std::string stored =
      compressed != nullptr
          ? fmt::format("compressed to {:.1f} MB", 1e-6 * static_cast<double>(compressed->bytes()))
          : fmt::format("in {} precision", name_of(body.greens().precision()));
  say(stderr, "{}: {} free surface nodes, {} dofs {}, loaded in {:.2f} s\n", body.model().name,
      body.free_surface_nodes().size(), body.greens().order(), stored, seconds);
  if (!body.greens().unfolded() && compressed == nullptr) {
    print_warning(
        "the Green's functions do not fit into half of the free memory as a full square; used packed, which "
        "is slower");
  }
}

/// Refuses settings that a body on two levels does not support.
void check_depth(const BodyOptions& options) {
  const auto refuse = [](const char* why, const char* option) {
    throw Error(why, option, std::string("leave out ") + option + " or --depth");
  };
  if (options.live.solver) refuse("a live solver turns by itself, and has no Green's functions", "--solver");
  if (options.has_overlays()) refuse("patches are of the body at rest, and do not turn", "--overlay");
  if (options.contact == ContactModel::dynamic) refuse("a body on two levels has no inertia", "--contact");
}

bool is_on_two_levels(const Model& model, const BodyOptions& options) {
  if (options.depth != Depth::automatic) return options.depth == Depth::yes;
  return !options.live.solver && !options.has_overlays() && options.contact == ContactModel::quasi_static &&
         goes_deep(model);
}

/// Checks that a model fits neo-Hookean overlays, and drops the data that they do not use.
void prepare_for_law(Model& model, const BodyOptions& options) {
  if (options.refinement == 1) {
    throw Error(
        options.graded ? "graded overlays are linear" : "the law is that of overlays, and there is none",
        "--overlay-law", "give an --overlay r=R,rings=N, or leave out --overlay-law");
  }
  if (options.contact == ContactModel::dynamic) {
    throw Error("a body whose overlays are neo-Hookean has no inertia", "--contact",
                "leave out --contact or --overlay-law");
  }
  for (const Material& material : model.materials) {
    const auto& strain = material.initial_strain;
    if (std::any_of(strain.begin(), strain.end(), [](double s) { return s != 0.0; })) {
      throw Error("the neo-hookean law has no place for the initial strain of the file's materials",
                  "--overlay-law", "leave it out, or precompute the model without initial strain");
    }
  }
  model.dynamics = {};
}

}  // namespace

MetSurface met_surface(const Model& model, const BodyOptions& options) {
  const bool is_of_simplices = traits(model.mesh.element).corners == model.dimension() + 1;
  const bool by_radius = options.radius > 0.0 && (options.graded ? is_of_simplices : is_even(model));
  return by_radius ? met_surface(model, options.radius, options.graded)
                   : MetSurface{.refinement = options.refinement};
}

Body load_body(const std::filesystem::path& file, const std::filesystem::path& model_toml,
               const BodyOptions& options) {
  Model model = load_model(file);
  const char* const if_missing = "give the model.toml that the file should have been made from";
  if (!model_toml.empty() && read_all(model_toml, if_missing, largest_description) != model.model_toml) {
    throw Error("was not made from " + model_toml.string() + ": the description stored in it is another one",
                file.string(), "precompute it again: palpate-precompute " + shell_word(model_toml.string()));
  }
  for (const std::string& stale : stale_sources(model, file)) {
    warn_once(file.string() + ": " + stale);
  }
  if (const std::string warning = precision_warning(model, model.greens.precision()); !warning.empty())
    warn_once(file.string() + ": " + warning);
  scale_loads(model, options.load_scale);
  scale_stiffness(model, options.stiffness_scale);
  if (options.depth == Depth::yes) check_depth(options);
  if (options.has_overlays()) check_for_overlays(model, "--overlay");
  if (options.overlay_law != PatchLaw::linear) prepare_for_law(model, options);
  if (options.live.solver) {
    if (options.has_overlays()) {
      throw Error("overlays refine Green's functions, and a live solver has none", "--overlay",
                  "leave out --overlay or --solver");
    }
    if (options.contact == ContactModel::dynamic) {
      throw Error("a live solver meets the tool with the body's inertia by itself", "--contact",
                  "leave out --contact or --solver");
    }
    if (model.mesh.element == ElementType::tet4a)
      warn_once(file.string() +
                ": a live body takes tet4a as tet4, which is stiffer to a touch (docs/live.md)");
    auto live = std::make_shared<const LiveParts>(make_live_parts(model, options.live));
    model = live_model(std::move(model), *live, options.live);
    return {std::move(model), std::move(live)};
  }
  if (const std::string warning = rest_warning(model); !warning.empty())
    warn_once(file.string() + ": " + warning);
  const MetSurface met = met_surface(model, options);
  if (is_on_two_levels(model, options)) return deep_body(std::move(model), met.refinement, met.is_local);
  return Body(std::move(model), {}, met.refinement, options.contact, met.is_local);
}

void add_sources(OutputPaths& paths, const Model& model, const std::filesystem::path& file) {
  for (const SourceFile& source : model.sources)
    paths.add_input(source_path(source, file), "what the model was made from (" + source.role + ")");
}

std::unique_ptr<const Body> load_and_print(const std::filesystem::path& file,
                                           const std::filesystem::path& model_toml,
                                           const BodyOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  std::unique_ptr<const Body> body(new Body(load_body(file, model_toml, options)));
  print_loaded(*body, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return body;
}

}  // namespace palpate
