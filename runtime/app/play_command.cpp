#include "runtime/app/play_command.h"

#include <fmt/core.h>

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "runtime/app/session_check.h"
#include "runtime/loop/loop.h"
#include "runtime/loop/numbers.h"

namespace palpate {
namespace {

/// An option that is one of the settings.
CLI::Option* add_setting(CLI::App& play, PlayArguments& arguments, const std::string& name,
                         const std::string& help) {
  return play.add_option_function<std::string>(
      "--" + name, [&arguments, name](const std::string& text) { arguments.settings[name] = text; }, help);
}

constexpr const char* input_group = "What moves the tool";
constexpr const char* tool_group = "The tool";
constexpr const char* viewer_group = "In a browser";
constexpr const char* body_group = "The body";
constexpr const char* loop_group = "The loop";
constexpr const char* output_group = "What is written";
constexpr const char* workspace_group = "Where the device is in the body's frame";
constexpr const char* safety_group = "Safety of the hand";

void add_input(CLI::App& play, PlayArguments& arguments) {
  play.add_option(
          "--device", arguments.device,
          "the hand: a CSV with the columns t,x,y,z[,qw,qx,qy,qz][,grab] (s, m, quaternion, 0 or 1); a "
          "recorded session; a HID device (palpate-runtime devices lists them); another process; with "
          "--view the pointer in the browser, which is what is taken then if nothing is said")
      ->type_name("script:TOUCH.csv|replay:SESSION.h5|hid[:WHICH]|bridge[:[ADDRESS:]PORT]|mouse")
      ->group(input_group);
  play.add_option("--profile", arguments.profile,
                  "what a HID device is, where its ids do not say: a name or a file")
      ->type_name("NAME|FILE.toml")
      ->group(input_group);
}

void add_viewer(CLI::App& play, PlayArguments& arguments) {
  play.add_flag("--view", arguments.view,
                "show it in a browser; without --device the browser's pointer moves the tool")
      ->group(viewer_group);
  play.add_option("--view-address", arguments.view_address,
                  "where the browser finds it, with --view; else 127.0.0.1:8017; port 0: any that is free")
      ->type_name("[ADDRESS:]PORT")
      ->group(viewer_group);
}

void add_tool(CLI::App& play, PlayArguments& arguments) {
  const auto add = [&](const char* name, const char* help, const char* type) {
    add_setting(play, arguments, name, help)->type_name(type)->group(tool_group);
  };
  add("tool", "its shape [m]; else a ball that suits the body, in scripts a point",
      "point|sphere:RADIUS|capsule:RADIUS,LENGTH");
  add("friction", "Coulomb's coefficient, in place of the materials'", "MU");
  add("coupling",
      "stiffness of the spring between the device and the tool; else the tool is where the device is",
      "N_PER_M");
  add("coupling-torsion",
      "stiffness of that spring against turning; else the tool is turned as the device is", "NM_PER_RAD");
  add("max-force", "the largest force that the hand is given", "N");
  add("hand-over",
      "share of the force that may change in a millisecond without the tool's motion explaining it: less is "
      "smoother where contact slips; else 0.005; inf for the contact's own force",
      "SHARE");
  add("reach",
      "how far from its origin a grab that touches nothing takes hold of the surface; else the longest edge "
      "of the surface",
      "METRES");
  add("max-contacts", "most contact points; where there are more, the deepest are kept; else 32", "N");
}

void add_body(CLI::App& play, PlayArguments& arguments) {
  const auto add = [&](const char* name, const char* help, const char* type) {
    add_setting(play, arguments, name, help)->type_name(type)->group(body_group);
  };
  add("overlay",
      "a finer mesh under the tool: each element within N rings round it is cut into R to the power of the "
      "dimension (s-FEM)",
      "r=R,rings=N");
  add("overlay-memory", "most that overlays may take; else 512", "MB");
  add("contact",
      "quasi-static: the tool meets the body's stiffness; dynamic: its inertia and viscosity too, for files "
      "with [dynamics] and a time step of one tick",
      "quasi-static|dynamic");
  add("load-scale", "share of the file's loads that the body rests under: 0 is without them; else 1", "S");
  add("stiffness-scale", "what all Young's moduli are multiplied by, without precomputing again; else 1",
      "S");
  play.add_option("--model", arguments.model_toml, "fail unless FILE was made from exactly this model.toml")
      ->type_name("FILE")
      ->group(body_group);
}

void add_loop(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--duration", arguments.duration, "stop after so many seconds")
      ->type_name("S")
      ->group(loop_group);
  add_setting(play, arguments, "rate", "ticks a second, 1000 to 5000; else 1000")
      ->type_name("HZ")
      ->group(loop_group);
  play.add_option("--cpu", arguments.cpu, "a processor that the loop has for itself within this program")
      ->type_name("N")
      ->group(loop_group);
  play.add_flag("--fast", arguments.fast,
                "do not wait for the clock: deterministic, equal runs leave equal recordings")
      ->group(loop_group);
}

void add_outputs(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--record", arguments.record, "write every tick to this HDF5 file")
      ->type_name("OUT.h5")
      ->group(output_group);
  play.add_option("--record-frames", arguments.record_frames,
                  "how often the surface is written there; else 60 times a second; 0: never")
      ->type_name("HZ")
      ->group(output_group);
  play.add_option("--report", arguments.report,
                  "write a report in JSON, to the standard output where this is -")
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

void add_workspace(CLI::App& play, PlayArguments& arguments) {
  const auto add = [&](const char* name, const char* help, const char* type) {
    add_setting(play, arguments, name, help)->type_name(type)->group(workspace_group);
  };
  add("motion-scale", "metres in the body's frame for one of the device; else 1", "S");
  add("force-scale",
      "newtons on the hand for one on the tool; else 1. Limits of the device are scaled with both", "C");
  add("origin",
      "where the device's origin lies in the body's frame [m]; else, for devices, above the body, half the "
      "workspace's radius from touch",
      "X,Y,Z");
  add("axes", "the body's axes along which the device's right, away-from-you and up point; else x,y,z",
      "AXES");
}

void add_safety(CLI::App& play, PlayArguments& arguments) {
  add_setting(play, arguments, "safety",
              "on by default for devices with a hand in them, with these bounds changed; for scripts only "
              "where it is given: default, or NAME=VALUE of the names below")
      ->type_name("NAME=VALUE,...")
      ->group(safety_group);
}

/// What `read` gives; its Error is one of the arguments.
template <class Read>
auto argument(Read&& read) {
  try {
    return read();
  } catch (const Error& error) {
    throw CLI::ValidationError(error.where(), std::string(error.what()) + "; " + error.hint());
  }
}

/// The positive number that an option was given, nothing where it was not given.
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
  throw CLI::ValidationError("--device", "'" + text +
                                             "' is none of script:FILE.csv, replay:SESSION.h5, hid[:WHICH], "
                                             "bridge[:[ADDRESS:]PORT] and, with --view, mouse");
}

/// What shows it, and what moves the tool then.
void read_view(PlayArguments& arguments, PlayOptions& options) {
  if (arguments.view) options.view = read_view_address(arguments.view_address.value_or("8017"));
  if (arguments.view_address && !arguments.view)
    throw CLI::ValidationError("--view-address", "it is for --view, which is not given");
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
  for (const char* name : {"motion-scale", "force-scale", "origin", "axes"}) {
    if (is_mouse && arguments.settings.contains(name))
      throw CLI::ValidationError(std::string("--") + name, "the pointer is in the body's frame already");
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

ViewerOptions read_view_address(const std::string& text) {
  ViewerOptions viewer;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) viewer.address = text.substr(0, colon);
  const std::optional<Index> port = parse_index(colon == std::string::npos ? text : text.substr(colon + 1));
  if (!port || *port > UINT16_MAX || viewer.address.empty())
    throw CLI::ValidationError("--view-address", "'" + text + "' is not [ADDRESS:]PORT");
  viewer.port = static_cast<std::uint16_t>(*port);
  return viewer;
}

CLI::App* add_play(CLI::App& app, PlayArguments& arguments) {
  CLI::App* play = app.add_subcommand("play", "run the haptic loop with a tool and report on it");
  play->add_option("FILE", arguments.file, "baked model, NAME.palpate.hdf")->required()->type_name("");
  add_input(*play, arguments);
  add_viewer(*play, arguments);
  add_tool(*play, arguments);
  add_body(*play, arguments);
  add_loop(*play, arguments);
  add_outputs(*play, arguments);
  add_workspace(*play, arguments);
  play->get_help_ptr()->group("");
  add_safety(*play, arguments);
  play->footer(
      safety_help() +
      "\nThe tool pushes what it touches and slides along it; while grab is set it holds what it "
      "touched, or the\n"
      "nearest surface within --reach, and carries it along. It must begin outside of the body. "
      "Lengths are metres.\n"
      "A capsule reaches from the tool's origin along its own z axis (in the plane y). On a body in "
      "the plane z is\n"
      "ignored. Ctrl-C ends a run, with no force; Enter or SIGUSR1 acknowledges a fault.\n"
      "\nExamples:\n"
      "  palpate-runtime play liver.palpate.hdf --view --tool sphere:0.008\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool sphere:0.005 --record "
      "touch.h5\n"
      "  palpate-runtime play liver.palpate.hdf --device replay:touch.h5\n"
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
    options.session = std::make_shared<const Recording>(read_session(options.device.target));
    arguments.settings.merge(split_settings(options.session->info.options));
    arguments.settings["rate"] = std::to_string(options.session->info.rate);
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
