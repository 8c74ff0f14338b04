// The arguments of `palpate-runtime play`.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "runtime/play.h"

namespace palpate {

/// As they were written.
struct PlayArguments {
  std::string file;
  std::string model_toml;
  std::string device;
  std::string profile;
  std::optional<std::string> tool;
  std::optional<std::string> friction;
  std::optional<std::string> coupling;
  std::optional<std::string> coupling_torsion;
  std::optional<std::string> max_force;
  std::optional<std::string> hand_over;
  std::optional<std::string> reach;
  std::optional<std::string> max_contacts;
  std::optional<std::string> contact;
  std::optional<std::string> overlay;
  std::optional<std::string> overlay_memory;
  std::optional<std::string> rate;
  std::optional<std::string> motion_scale;
  std::optional<std::string> force_scale;
  std::optional<std::string> origin;
  std::optional<std::string> axes;
  std::optional<std::string> safety;
  std::optional<std::string> duration;
  std::optional<std::string> cpu;
  bool fast = false;
  std::string record;
  std::optional<std::string> record_frames;
  std::string report;
  std::string surface;
  std::string contacts;
};

/// Adds the subcommand.
CLI::App* add_play(CLI::App& app, PlayArguments& arguments);

/// What they mean. For a replay, what is not given is as it was in the session. Throws CLI::ParseError for
/// wrong arguments, Error for a session that cannot be read.
PlayOptions read_play(PlayArguments arguments);

/// Of `play` and `probe`: "r=3,rings=2". Throws CLI::ParseError.
OverlayOptions read_overlay(const std::string& text);

}  // namespace palpate
