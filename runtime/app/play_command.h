// The arguments of `palpate-runtime play`.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "runtime/app/play.h"

namespace palpate {

/// As they were written.
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
  std::optional<std::string> igtl;
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

/// What they mean. For a replay, what is not given is as it was in the session. Throws CLI::ParseError for
/// wrong arguments, Error for a session that cannot be read.
PlayOptions read_play(PlayArguments arguments);

/// The place to listen at of an option, "PORT" or "ADDRESS:PORT". Throws CLI::ParseError.
ListenAddress read_address(const std::string& text, const char* option);

/// Adds the options of a viewer's page to `push`, `play` or `view`.
void add_viewer_options(CLI::App& command, ViewerArguments& arguments, const char* group = nullptr);

/// What they mean. Throws CLI::ParseError.
ViewerOptions read_viewer(const ViewerArguments& arguments);

/// Overlay options of `play` and `probe`: "r=3,rings=2". Throws CLI::ParseError.
OverlayOptions read_overlay(const std::string& text);

}  // namespace palpate
