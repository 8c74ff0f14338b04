// Arguments of `palpate-runtime play`.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "runtime/app/play_options.h"

namespace palpate {

/// Arguments as given on the command line.
struct PlayArguments {
  std::string file;
  std::string model_toml;
  std::string device;
  std::string profile;
  SettingsText settings;
  std::optional<std::string> duration;
  std::optional<std::string> cpu;
  bool fast = false;
  bool view = false;
  ViewerArguments viewer;
  std::string beside;
  std::string record;
  std::optional<std::string> record_frames;
  std::string report;
  std::string surface;
  std::string contacts;
  bool force = false;
};

constexpr const char* force_help =
    "overwrite output files even if they are not earlier outputs of the same kind";

/// Adds the subcommand.
CLI::App* add_play(CLI::App& app, PlayArguments& arguments);

/// Converts arguments to options. For a replay, missing ones are taken from the session. Throws
/// CLI::ParseError for invalid arguments, Error for a session that cannot be read.
PlayOptions read_play(PlayArguments arguments);

/// Adds the options of a viewer's page to `push`, `play` or `view`.
void add_viewer_options(CLI::App& command, ViewerArguments& arguments, const char* group = nullptr);

/// Converts viewer arguments to options. Throws CLI::ParseError.
ViewerOptions read_viewer(const ViewerArguments& arguments);

/// Parses the overlay option of `play` and `probe`: "r=3,rings=2". Throws CLI::ParseError.
OverlayOptions read_overlay(const std::string& text);

}  // namespace palpate
