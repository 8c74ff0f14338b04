#include "runtime/play_command.h"

#include <fmt/core.h>

#include <array>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "meshes/error.h"
#include "runtime/loop.h"
#include "runtime/numbers.h"

namespace palpate {
namespace {

void add_tool(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--tool", arguments.tool, "its shape [m]; else a point")
      ->type_name("point|sphere:RADIUS|capsule:RADIUS,LENGTH");
  play.add_option("--friction", arguments.friction, "Coulomb's coefficient, in place of the materials'")
      ->type_name("MU");
  play.add_option("--coupling", arguments.coupling,
                  "stiffness of the spring between the device and the tool; else the tool is where the "
                  "device is")
      ->type_name("N_PER_M");
  play.add_option("--coupling-torsion", arguments.coupling_torsion,
                  "stiffness of that spring against turning; else the tool is turned as the device is")
      ->type_name("NM_PER_RAD");
  play.add_option("--max-force", arguments.max_force, "the largest force that the hand is given")
      ->type_name("N");
  play.add_option(
          "--hand-over", arguments.hand_over,
          "share of the force that may change in a millisecond without the tool's motion explaining it: less "
          "is smoother where contact slips; else 0.005; inf for the contact's own force")
      ->type_name("SHARE");
  play.add_option("--reach", arguments.reach,
                  "how far from its origin a grab that touches nothing takes hold of the surface; else the "
                  "longest edge of the surface")
      ->type_name("METRES");
  play.add_option("--max-contacts", arguments.max_contacts,
                  "most contact points; where there are more, the deepest are kept; else 32")
      ->type_name("N");
}

void add_workspace(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--motion-scale", arguments.motion_scale,
                  "metres in the body's frame for one of the device; else 1")
      ->type_name("S");
  play.add_option(
          "--force-scale", arguments.force_scale,
          "newtons on the hand for one on the tool; else 1. Limits of the device are scaled with both")
      ->type_name("C");
  play.add_option(
          "--origin", arguments.origin,
          "where the device's origin lies in the body's frame [m]; else, for devices, above the body, "
          "half the workspace's radius from touch")
      ->type_name("X,Y,Z");
  play.add_option("--axes", arguments.axes,
                  "the body's axes along which the device's right, away-from-you and up point; else x,y,z")
      ->type_name("AXES");
}

void add_outputs(CLI::App& play, PlayArguments& arguments) {
  play.add_option("--record", arguments.record, "write every tick to this HDF5 file")->type_name("OUT.h5");
  play.add_option("--record-frames", arguments.record_frames,
                  "how often the surface is written there; else 60 times a second; 0: never")
      ->type_name("HZ");
  play.add_option("--report", arguments.report, "write the JSON report here and not to the standard output")
      ->type_name("OUT.json");
  play.add_option(
          "--surface", arguments.surface,
          "write the surface after the last tick, as fine as the overlay makes it, with displacement, stress "
          "and contact pressure, for ParaView")
      ->type_name("OUT.vtu");
  play.add_option("--contacts", arguments.contacts, "write the contact points after the last tick")
      ->type_name("OUT.csv");
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

std::optional<double> read_hand_over(const std::optional<std::string>& text) {
  if (text && *text == "inf") return std::numeric_limits<double>::infinity();
  return positive_argument("--hand-over", text, "the force, or inf");
}

Tool read_tool(const PlayArguments& arguments) {
  Tool tool = argument([&] { return parse_shape(arguments.tool.value_or("point")); });
  if (arguments.friction) {
    tool.friction = parse_number(*arguments.friction);
    if (!tool.friction || *tool.friction < 0.0)
      throw CLI::ValidationError("--friction", "'" + *arguments.friction + "' is not a number from 0 on");
  }
  tool.coupling_stiffness =
      positive_argument("--coupling", arguments.coupling, "N/m").value_or(tool.coupling_stiffness);
  tool.coupling_torsion = positive_argument("--coupling-torsion", arguments.coupling_torsion, "N m/rad")
                              .value_or(tool.coupling_torsion);
  tool.max_force = positive_argument("--max-force", arguments.max_force, "newtons").value_or(tool.max_force);
  tool.hand_over = read_hand_over(arguments.hand_over).value_or(tool.hand_over);
  return tool;
}

Index read_max_contacts(const std::optional<std::string>& text) {
  constexpr Index most = 1000;  // a factor of so many fits into a gigabyte
  if (!text) return StateOptions{}.max_contacts;
  const std::optional<Index> count = parse_index(*text);
  if (!count || *count < 1 || *count > most) {
    throw CLI::ValidationError("--max-contacts",
                               fmt::format("'{}' is not a whole number from 1 to {}", *text, most));
  }
  return *count;
}

std::size_t read_overlay_memory(const std::optional<std::string>& text) {
  if (!text) return PatchSourceOptions{}.memory;
  const std::optional<Index> megabytes = parse_index(*text);
  if (!megabytes || *megabytes < 1)
    throw CLI::ValidationError("--overlay-memory", "'" + *text + "' is not a whole number of megabytes");
  return static_cast<std::size_t>(*megabytes) << 20;
}

ContactModel read_contact(const std::string& text) {
  if (text == "quasi-static") return ContactModel::quasi_static;
  if (text == "dynamic") return ContactModel::dynamic;
  throw CLI::ValidationError("--contact", "'" + text + "' is neither quasi-static nor dynamic");
}

std::int64_t read_rate(const std::optional<std::string>& text) {
  if (!text) return default_rate;
  const std::optional<Index> rate = parse_index(*text);
  if (!rate || *rate < default_rate || *rate > most_rate) {
    throw CLI::ValidationError(
        "--rate", fmt::format("'{}' is not a whole number from {} to {}", *text, default_rate, most_rate));
  }
  return *rate;
}

std::optional<Vec3> read_origin(const std::optional<std::string>& text) {
  if (!text) return std::nullopt;
  const std::optional<std::vector<double>> place = parse_vector(*text);
  if (!place) throw CLI::ValidationError("--origin", "'" + *text + "' is not finite numbers X,Y,Z");
  return Vec3((*place)[0], (*place)[1], place->size() == 3 ? (*place)[2] : 0.0);
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
                                 "' is none of script:FILE.csv, replay:SESSION.h5, hid[:WHICH] and "
                                 "bridge[:[ADDRESS:]PORT]");
}

/// Options that were not given, as they were in a session.
void fill(PlayArguments& arguments, std::string_view options) {
  const std::array<std::pair<std::string_view, std::optional<std::string>*>, 16> known = {
      {{"tool", &arguments.tool},
       {"friction", &arguments.friction},
       {"coupling", &arguments.coupling},
       {"coupling-torsion", &arguments.coupling_torsion},
       {"max-force", &arguments.max_force},
       {"hand-over", &arguments.hand_over},
       {"reach", &arguments.reach},
       {"max-contacts", &arguments.max_contacts},
       {"contact", &arguments.contact},
       {"overlay", &arguments.overlay},
       {"overlay-memory", &arguments.overlay_memory},
       {"motion-scale", &arguments.motion_scale},
       {"force-scale", &arguments.force_scale},
       {"origin", &arguments.origin},
       {"axes", &arguments.axes},
       {"safety", &arguments.safety}}};
  while (!options.empty()) {
    const std::size_t end = std::min(options.find('\n'), options.size());
    const std::string_view line = options.substr(0, end);
    options.remove_prefix(std::min(end + 1, options.size()));
    const std::size_t equals = std::min(line.find('='), line.size());
    for (const auto& [name, value] : known) {
      if (line.substr(0, equals) == name && !*value && equals < line.size())
        *value = std::string(line.substr(equals + 1));
    }
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

CLI::App* add_play(CLI::App& app, PlayArguments& arguments) {
  CLI::App* play = app.add_subcommand("play", "run the haptic loop with a tool and report on it");
  play->add_option("FILE", arguments.file, "baked model, NAME.palpate.hdf")->required()->type_name("");
  play->add_option("--model", arguments.model_toml, "fail unless FILE was made from exactly this model.toml")
      ->type_name("FILE");
  play->add_option(
          "--device", arguments.device,
          "the hand: a CSV with the columns t,x,y,z[,qw,qx,qy,qz][,grab] (s, m, quaternion, 0 or 1); a "
          "recorded session; a HID device (palpate-runtime devices lists them); another process")
      ->type_name("script:TOUCH.csv|replay:SESSION.h5|hid[:WHICH]|bridge[:[ADDRESS:]PORT]")
      ->required();
  play->add_option("--profile", arguments.profile,
                   "what a HID device is, where its ids do not say: a name or a file")
      ->type_name("NAME|FILE.toml");
  add_tool(*play, arguments);
  play->add_option("--overlay", arguments.overlay,
                   "a finer mesh under the tool: each element within N rings round it is cut into R to the "
                   "power of the dimension (s-FEM)")
      ->type_name("r=R,rings=N");
  play->add_option("--overlay-memory", arguments.overlay_memory, "most that overlays may take; else 512")
      ->type_name("MB");
  play->add_option(
          "--contact", arguments.contact,
          "quasi-static: the tool meets the body's stiffness; dynamic: its inertia and viscosity too, "
          "for files with [dynamics] and a time step of one tick")
      ->type_name("quasi-static|dynamic");
  add_workspace(*play, arguments);
  play->add_option(
          "--safety", arguments.safety,
          "on by default for devices with a hand in them, with these bounds changed; for scripts only "
          "where it is given: NAME=VALUE,... or default")
      ->type_name("BOUNDS");
  play->add_option("--duration", arguments.duration, "stop after so many seconds")->type_name("S");
  play->add_option("--rate", arguments.rate, "ticks a second, 1000 to 5000; else 1000")->type_name("HZ");
  play->add_option("--cpu", arguments.cpu, "a processor that the loop has for itself within this program")
      ->type_name("N");
  play->add_flag("--fast", arguments.fast,
                 "do not wait for the clock: deterministic, equal runs leave equal recordings");
  add_outputs(*play, arguments);
  play->footer(
      "The tool pushes what it touches and slides along it; while grab is set it holds what it touched, or "
      "the\n"
      "nearest surface within --reach, and carries it along. It must begin outside of the body. Lengths are "
      "metres.\n"
      "A capsule reaches from the tool's origin along its own z axis (in the plane y). On a body in the "
      "plane "
      "z is ignored.\n"
      "Ctrl-C ends a run, with no force; Enter acknowledges a fault of a device.\n"
      "Bounds of --safety and their defaults:\n" +
      safety_help() +
      "Examples:\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool sphere:0.005 --record "
      "touch.h5\n"
      "  palpate-runtime play liver.palpate.hdf --device replay:touch.h5\n"
      "  palpate-runtime play liver.palpate.hdf --device hid --profile polhem_v1 --tool sphere:0.008 "
      "--safety max_force=2\n"
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
  options.device = read_device(arguments.device, arguments.profile);
  if (options.device.is_live() && arguments.fast)
    throw CLI::ValidationError("--fast", "a hand cannot be run ahead of: give --fast to scripts and replays");
  if (options.device.kind == DeviceChoice::Kind::replay) {
    options.session = std::make_shared<const Recording>(read_recording(options.device.target));
    fill(arguments, options.session->info.options);
    if (arguments.rate) throw CLI::ValidationError("--rate", "a session is replayed at its own rate");
  }

  options.file = arguments.file;
  options.model_toml = arguments.model_toml;
  Settings& settings = options.settings;
  settings.tool = read_tool(arguments);
  settings.reach = positive_argument("--reach", arguments.reach, "metres");
  settings.max_contacts = read_max_contacts(arguments.max_contacts);
  settings.contact = read_contact(arguments.contact.value_or("quasi-static"));
  if (arguments.overlay) settings.overlay = read_overlay(*arguments.overlay);
  settings.overlay_memory = read_overlay_memory(arguments.overlay_memory);
  settings.rate = options.session ? options.session->info.rate : read_rate(arguments.rate);
  settings.motion_scale =
      positive_argument("--motion-scale", arguments.motion_scale, "metres for one").value_or(1.0);
  settings.force_scale =
      positive_argument("--force-scale", arguments.force_scale, "newtons for one").value_or(1.0);
  settings.origin = read_origin(arguments.origin);
  settings.axes = arguments.axes.value_or(settings.axes);
  argument([&] { return parse_axes(settings.axes); });
  if (arguments.safety) settings.safety = argument([&] { return parse_safety(*arguments.safety); });

  options.duration = positive_argument("--duration", arguments.duration, "seconds");
  options.processor = read_processor(arguments.cpu);
  options.fast = arguments.fast;
  options.record = arguments.record;
  options.record_frames = read_frame_rate(arguments.record_frames);
  options.report = arguments.report;
  options.surface = arguments.surface;
  options.contacts = arguments.contacts;
  return options;
}

}  // namespace palpate
