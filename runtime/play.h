// palpate-runtime play: the loop, its recording and its report.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "runtime/patch_source.h"
#include "runtime/step.h"

namespace palpate {

struct PlayOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< that it must have been made from; empty: not asked
  std::filesystem::path script;      ///< CSV
  Tool tool;                         ///< but for its reach
  std::optional<double> reach;       ///< [m]; else the longest edge of the surface
  Index max_contacts = StateOptions{}.max_contacts;
  ContactModel contact = ContactModel::quasi_static;
  std::optional<OverlayOptions> overlay;                     ///< none: the body's own mesh
  std::size_t overlay_memory = PatchSourceOptions{}.memory;  ///< [bytes]
  bool fast = false;
  std::filesystem::path record;    ///< empty: nothing is recorded
  double record_frames = 60.0;     ///< of the surface a second; 0: none
  std::filesystem::path report;    ///< JSON; empty: on the standard output
  std::filesystem::path surface;   ///< grid of the surface after the last tick, .vtu; empty: none
  std::filesystem::path contacts;  ///< CSV of the contact points after the last tick; empty: none
};

/// Runs the script to its end or to SIGINT or SIGTERM, either of which leaves a complete recording, report
/// and table of contacts. Returns the exit code; throws Error.
int play(const PlayOptions& options);

}  // namespace palpate
