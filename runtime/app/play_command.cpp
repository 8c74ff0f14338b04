#include "runtime/app/play_command.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/numbers.h"
#include "runtime/loop/session_check.h"

namespace palpate {
namespace {

/// Adds the settings of a group as options below a heading.
void add_settings(CLI::App& play, PlayArguments& arguments, SettingGroup group, const char* heading) {
  for (const Setting& setting : settings_table()) {
    if (setting.group != group) continue;
    play.add_option_function<std::string>(
            std::string("--") + setting.name,
            [&arguments, name = setting.name](const std::string& text) { arguments.settings[name] = text; },
            fmt::format("{}; default: {}", setting.meaning, setting.otherwise))
        ->type_name(setting.value)
        ->group(heading);
  }
}

constexpr const char* input_group = "Input device";
constexpr const char* viewer_group = "Viewer";
constexpr const char* body_group = "The body";
constexpr const char* live_group = "The live solver";
constexpr const char* loop_group = "The loop";
constexpr const char* output_group = "Output files";

void add_input(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--device", arguments.device,
                  "what moves the tool: a CSV with the columns t,x,y,z[,qw,qx,qy,qz][,grab] (s, m, "
                  "quaternion, 0 or 1); a recording; a HID device (palpate-runtime devices lists them); "
                  "another process; or, with --view, the pointer in the browser, which is then the default")
      ->type_name("script:TOUCH.csv|replay:SESSION.mcap|hid[:WHICH]|bridge[:SOCKET]|mouse")
      ->group(input_group);
  play.add_option("--profile", arguments.profile,
                  "profile of the HID device if its ids do not tell: a built-in name or a file")
      ->type_name("NAME|FILE.toml")
      ->group(input_group);
}

void add_viewer(CLI::App& play, PlayArguments& arguments) {
  play.add_flag("--view", arguments.view,
                "show the body in a browser; without --device the browser's pointer moves the tool")
      ->group(viewer_group);
  add_viewer_options(play, arguments.viewer, viewer_group);
  play.add_option("--beside", arguments.beside, "with --view: a recording that is shown beside the body")
      ->type_name("SESSION.mcap")
      ->group(viewer_group);
}

void add_body(CLI::App& play, PlayArguments& arguments) {
  add_settings(play, arguments, SettingGroup::body, body_group);
  play.add_option("--model", arguments.model_toml, "fail unless FILE was made from exactly this model.toml")
      ->type_name("FILE")
      ->group(body_group);
}

void add_loop(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--duration", arguments.duration, "stop after this time [s]")
      ->type_name("S")
      ->group(loop_group);
  add_settings(play, arguments, SettingGroup::loop, loop_group);
  play.add_option("--cpu", arguments.cpu,
                  "processor for the loop; the program's other threads leave it alone")
      ->type_name("N")
      ->group(loop_group);
  play.add_flag("--fast", arguments.fast,
                "do not wait for the clock; runs are deterministic: the same input gives the same recording")
      ->group(loop_group);
}

void add_outputs(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--record", arguments.record, "record every tick in this MCAP file")
      ->type_name("OUT.mcap")
      ->group(output_group);
  play.add_option("--record-frames", arguments.record_frames,
                  "how often the surface is recorded [1/s]; 0: never; default: 60")
      ->type_name("HZ")
      ->group(output_group);
  play.add_option("--report", arguments.report, "write a report as JSON; -: to standard output")
      ->type_name("OUT.json|-")
      ->group(output_group);
  play.add_option(
          "--surface", arguments.surface,
          "write the surface after the last tick, as fine as the overlay makes it, with displacement, stress "
          "and contact pressure, for ParaView")
      ->type_name("OUT.vtu")
      ->group(output_group);
  play.add_option("--contacts", arguments.contacts, "write the contact points after the last tick")
      ->type_name("OUT.csv")
      ->group(output_group);
  play.add_flag("--force", arguments.force, force_help)->group(output_group);
}

/// Returns the result of `read`; its Error becomes one of the arguments.
template <class Read>
auto argument(Read&& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw CLI::ValidationError(error.where(), std::string(error.what()) + "; " + error.hint());
  }
}

/// Parses the positive number of an option; empty if the option is not given.
std::optional<double> positive_argument(const std::string& option, const std::optional<std::string>& text,
                                        const std::string& unit) {
  if (!text) return std::nullopt;
  const std::optional<double> number = parse_number(*text);
  if (!number || *number <= 0.0)
    throw CLI::ValidationError(option, "'" + *text + "' is not a positive number of " + unit);
  return number;
}

std::optional<int> read_processor(const std::optional<std::string>& text) {
  if (!text) return std::nullopt;
  const std::optional<Index> processor = parse_index(*text);
  if (!processor) throw CLI::ValidationError("--cpu", "'" + *text + "' is not the number of a processor");
  return static_cast<int>(*processor);
}

DeviceChoice read_device(const std::string& text, const std::string& profile) {
  using Kind = DeviceChoice::Kind;
  constexpr std::array<std::pair<std::string_view, Kind>, 4> kinds = {
      {{"script", Kind::script}, {"replay", Kind::replay}, {"hid", Kind::hid}, {"bridge", Kind::bridge}}};
  if (text == "mouse") {
    if (!profile.empty()) throw CLI::ValidationError("--profile", "profiles are for --device hid");
    return {.kind = Kind::mouse, .target = "", .profile = "", .text = text};
  }
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string target = text.substr(std::min(colon + 1, text.size()));
  for (const auto& [name, kind] : kinds) {
    if (text.substr(0, colon) != name) continue;
    const bool needs_file = kind == Kind::script || kind == Kind::replay;
    if (needs_file && target.empty()) break;
    if (!profile.empty() && kind != Kind::hid)
      throw CLI::ValidationError("--profile", "profiles are for --device hid");
    return {.kind = kind, .target = target, .profile = profile, .text = text};
  }
  throw CLI::ValidationError("--device",
                             "'" + text +
                                 "' is none of script:FILE.csv, replay:SESSION.mcap, hid[:WHICH], "
                                 "bridge[:SOCKET] and, with --view, mouse");
}

/// Reads the options of viewer and pointer.
void read_view(PlayArguments& arguments, PlayOptions& options) {
  if (arguments.view) options.view = read_viewer(arguments.viewer);
  const auto expect_view = [&](bool is_given, const char* option) {
    if (is_given && !arguments.view)
      throw CLI::ValidationError(option, "it is for --view, which is not given");
  };
  expect_view(arguments.viewer.address.has_value(), "--view-address");
  expect_view(arguments.viewer.framed, "--view-framed");
  expect_view(arguments.viewer.told.has_value(), "--view-fd");
  expect_view(!arguments.beside.empty(), "--beside");
  options.beside = arguments.beside;
  if (arguments.device.empty() && !arguments.view) {
    throw CLI::RequiredError(
        "--device (what moves the tool), or --view (to move it with the pointer in a browser),");
  }
  if (arguments.device.empty()) arguments.device = "mouse";
  options.device = read_device(arguments.device, arguments.profile);
  if (arguments.view && arguments.fast)
    throw CLI::ValidationError("--fast", "what is shown keeps the clock: leave out --fast or --view");
  const bool is_mouse = options.device.kind == DeviceChoice::Kind::mouse;
  if (is_mouse && !arguments.view)
    throw CLI::ValidationError("--device", "'mouse' is the pointer in a browser: give --view too");
  for (const auto& [name, value] : arguments.settings) {
    if (is_mouse && find_setting(name)->group == SettingGroup::workspace)
      throw CLI::ValidationError("--" + name, "the pointer is in the body's frame already");
    const bool is_replay = options.device.kind == DeviceChoice::Kind::replay;  // it may have a solver
    if (find_setting(name)->group == SettingGroup::live && !arguments.settings.contains("solver") &&
        !is_replay)
      throw CLI::ValidationError("--" + name, "it is for --solver, which is not given");
  }
}

double read_frame_rate(const std::optional<std::string>& text) {
  if (!text) return PlayOptions{}.record_frames;
  const std::optional<double> rate = parse_number(*text);
  if (!rate || *rate < 0.0)
    throw CLI::ValidationError("--record-frames", "'" + *text + "' is not a number from 0 on");
  return *rate;
}

}  // namespace

void add_viewer_options(CLI::App& command, ViewerArguments& arguments, const char* group) {
  const std::array<CLI::Option*, 3> options = {
      command
          .add_option("--view-address", arguments.address,
                      "address at which the page is served; default: 127.0.0.1:8017; port 0: any free one")
          ->type_name("[ADDRESS:]PORT"),
      command.add_flag("--view-framed", arguments.framed,
                       "let other pages of this machine, as a notebook's, show the viewer in a frame"),
      command
          .add_option(
              "--view-fd", arguments.told,
              "for programs: the page's address is written to this open file descriptor, as a line of "
              "JSON, and not told to a person")
          ->type_name("N")};
  for (CLI::Option* option : options)
    if (group != nullptr) option->group(group);
}

ViewerOptions read_viewer(const ViewerArguments& arguments) {
  ViewerOptions viewer;
  if (arguments.address) {
    const std::optional<ListenAddress> place = parse_listen_address(*arguments.address);
    if (!place)
      throw CLI::ValidationError("--view-address", "'" + *arguments.address + "' is not [ADDRESS:]PORT");
    viewer.address = place->address;
    viewer.port = place->port;
  }
  viewer.framed = arguments.framed;
  if (!arguments.told) return viewer;
  viewer.told = *arguments.told;
  if (viewer.told <= STDERR_FILENO || ::fcntl(viewer.told, F_SETFD, FD_CLOEXEC) != 0)
    throw CLI::ValidationError("--view-fd",
                               fmt::format("{} is not an open file descriptor from 3 on", viewer.told));
  return viewer;
}

CLI::App* add_play(CLI::App& app, PlayArguments& arguments) {
  CLI::App* play = app.add_subcommand("play", "run the haptic loop: a tool touches the body in real time");
  play->add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")->required()->type_name("");
  add_input(*play, arguments);
  add_viewer(*play, arguments);
  add_settings(*play, arguments, SettingGroup::tool, "The tool");
  add_body(*play, arguments);
  add_settings(*play, arguments, SettingGroup::live, live_group);
  add_loop(*play, arguments);
  add_outputs(*play, arguments);
  add_settings(*play, arguments, SettingGroup::workspace, "Workspace of the device");
  play->get_help_ptr()->group("");
  add_settings(*play, arguments, SettingGroup::safety, "Safety");
  play->footer(
      "    bound            default unit   meaning\n" + safety_help() +
      "\nThe tool pushes what it touches and slides along it. While grab is set, it holds what it touches, "
      "or\n"
      "the nearest surface within --reach, and carries it along. It must start outside the body. For a body "
      "in\n"
      "the plane z is ignored. Lengths are metres. Ctrl-C ends a run, with no force; Enter or SIGUSR1\n"
      "acknowledges a fault.\n"
      "\nExamples:\n"
      "  palpate-runtime play liver.palpate.hdf --view --tool sphere:0.008\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool sphere:0.005 --record "
      "touch.mcap\n"
      "  palpate-runtime play liver.palpate.hdf --device replay:touch.mcap\n"
      "  palpate-runtime play block.palpate.hdf --view --solver corotational --free yes \\\n"
      "      --gravity 0,0,-9.81 --floor -0.05 --yield 0.05\n"
      "  palpate-runtime play liver.palpate.hdf --device hid --profile polhem_v1 --tool sphere:0.008 "
      "\\\n      --safety max_force=2\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool capsule:0.008,0.03 "
      "--friction 0.5 \\\n"
      "      --coupling 800 --max-force 7.5 --fast --contacts contacts.csv");
  return play;
}

OverlayOptions read_overlay(const std::string& text) {
  return argument([&] { return parse_overlay(text, "--overlay"); });
}

PlayOptions read_play(PlayArguments arguments) {
  PlayOptions options;
  read_view(arguments, options);
  if (options.device.is_live() && arguments.fast)
    throw CLI::ValidationError("--fast", "a hand cannot be run ahead of: give --fast to scripts and replays");
  if (options.device.kind == DeviceChoice::Kind::replay) {
    if (arguments.settings.contains("rate"))
      throw CLI::ValidationError("--rate", "a session is replayed at its own rate");
    options.session = std::make_shared<const RecordingFile>(open_session(options.device.target));
    arguments.settings.merge(split_settings(options.session->info().options));
    arguments.settings["rate"] = std::to_string(options.session->info().rate);
  }
  options.settings_text = arguments.settings;
  options.settings = argument([&] { return read_settings(arguments.settings); });

  options.file = arguments.file;
  options.model_toml = arguments.model_toml;
  options.duration = positive_argument("--duration", arguments.duration, "seconds");
  options.processor = read_processor(arguments.cpu);
  options.fast = arguments.fast;
  options.record = arguments.record;
  options.record_frames = read_frame_rate(arguments.record_frames);
  options.report = arguments.report;
  options.surface = arguments.surface;
  options.contacts = arguments.contacts;
  options.force = arguments.force;
  return options;
}

}  // namespace palpate
