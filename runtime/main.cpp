// palpate-runtime: touches a precomputed body.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "meshes/error.h"
#include "runtime/numbers.h"
#include "runtime/play.h"
#include "runtime/probe.h"
#include "runtime/session.h"

namespace {

using namespace palpate;

/// The arguments as they were written.
struct Arguments {
  std::string file;
  std::string model_toml;
  std::vector<std::string> at;
  std::vector<std::string> node;
  std::vector<std::string> displace;
  bool json = false;
  std::optional<std::string> overlay;
  std::string field;
  std::string device;
  std::string tool = "point";
  std::optional<std::string> friction;
  std::optional<std::string> coupling;
  std::optional<std::string> coupling_torsion;
  std::optional<std::string> max_force;
  std::optional<std::string> hand_over;
  std::optional<std::string> reach;
  std::optional<std::string> max_contacts;
  bool fast = false;
  std::string contact = "quasi-static";
  std::optional<std::string> overlay_memory;
  std::string record;
  std::optional<std::string> record_frames;
  std::string report;
  std::string surface;
  std::string contacts;
};

void add_file(CLI::App& command, Arguments& arguments) {
  command.add_option("FILE", arguments.file, "baked model, NAME.palpate.hdf")->required()->type_name("");
  command
      .add_option("--model", arguments.model_toml, "fail unless FILE was made from exactly this model.toml")
      ->type_name("FILE");
}

CLI::Option* add_repeatable(CLI::App& command, const std::string& name, std::vector<std::string>& values,
                            const std::string& type, const std::string& help) {
  return command.add_option(name, values, help)->type_name(type)->allow_extra_args(false);
}

CLI::App* add_probe(CLI::App& app, Arguments& arguments) {
  CLI::App* probe = app.add_subcommand("probe", "displace nodes and print the forces that this takes");
  add_file(*probe, arguments);
  add_repeatable(*probe, "--at", arguments.at, "X,Y,Z",
                 "the free surface node that rests nearest to this place [m]; repeatable");
  add_repeatable(*probe, "--node", arguments.node, "N", "the node with this number in the mesh; repeatable");
  add_repeatable(*probe, "--displace", arguments.displace, "DX,DY,DZ",
                 "its displacement [m]; one for each --at and --node, in the same order")
      ->required();
  probe
      ->add_option(
          "--overlay", arguments.overlay,
          "a finer mesh over the elements in N rings round those nodes, each cut into R to the power "
          "of the dimension (s-FEM)")
      ->type_name("r=R,rings=N");
  probe->add_flag("--json", arguments.json, "print JSON");
  probe
      ->add_option(
          "--field", arguments.field,
          "write the displacement at rest and by the probe: a table of the stored nodes, or a grid for "
          "ParaView")
      ->type_name("OUT.csv|OUT.vtu");
  probe->footer(
      "Forces are those on the body, in newtons; the hand feels the opposite. Displacements are relative to\n"
      "the body as it rests under its loads. For a body in the plane give X,Y and DX,DY.\n"
      "Example: palpate-runtime probe liver.palpate.hdf --at 0.1,0.05,0.12 --displace 0,0,-0.005 --field "
      "liver.vtu");
  return probe;
}

void add_tool(CLI::App& play, Arguments& arguments) {
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
          "share of the force that may change in a tick without the tool's motion explaining it: less "
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

CLI::App* add_play(CLI::App& app, Arguments& arguments) {
  CLI::App* play = app.add_subcommand("play", "run the 1 kHz loop with a tool and report on it");
  add_file(*play, arguments);
  play->add_option("--device", arguments.device,
                   "the hand: a CSV with the columns t,x,y,z[,qw,qx,qy,qz][,grab] (s, m, quaternion, 0 or 1)")
      ->type_name("script:TOUCH.csv")
      ->required();
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
  play->add_flag("--fast", arguments.fast,
                 "do not wait for the clock: deterministic, equal runs leave equal recordings");
  play->add_option("--record", arguments.record, "write every tick to this HDF5 file")->type_name("OUT.h5");
  play->add_option("--record-frames", arguments.record_frames,
                   "how often the surface is written there; else 60 times a second; 0: never")
      ->type_name("HZ");
  play->add_option("--report", arguments.report, "write the JSON report here and not to the standard output")
      ->type_name("OUT.json");
  play->add_option("--surface", arguments.surface,
                   "write the surface after the last tick, as fine as the overlay makes it, for ParaView")
      ->type_name("OUT.vtu");
  play->add_option("--contacts", arguments.contacts, "write the contact points after the last tick")
      ->type_name("OUT.csv");
  play->footer(
      "The tool pushes what it touches and slides along it; while grab is set it holds what it touched, or "
      "the\n"
      "nearest surface within --reach, and carries it along. It must begin outside of the body. Lengths are "
      "metres.\n"
      "A capsule reaches from the tool's origin along its own z axis (in the plane y). On a body in the "
      "plane "
      "z is ignored.\n"
      "Examples:\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool sphere:0.005 --record "
      "touch.h5\n"
      "  palpate-runtime play liver.palpate.hdf --device script:touch.csv --tool capsule:0.008,0.03 "
      "--friction 0.5 \\\n"
      "      --coupling 800 --max-force 7.5 --fast --contacts contacts.csv");
  return play;
}

CLI::App* add_session(CLI::App& app, Arguments& arguments) {
  CLI::App* session = app.add_subcommand("session", "say what is in a recording of play");
  session->add_option("SESSION.h5", arguments.file, "recording; one that was killed is made one file")
      ->required()
      ->type_name("");
  session->add_flag("--json", arguments.json, "print JSON");
  return session;
}

std::vector<double> vector_argument(const std::string& option, const std::string& text) {
  const std::optional<std::vector<double>> vector = parse_vector(text);
  if (!vector)
    throw CLI::ValidationError(option, "'" + text + "' is not finite numbers X,Y,Z (in the plane X,Y)");
  return *vector;
}

/// Pairs the places with the displacements in the order in which they were written.
std::vector<ProbePlace> read_places(const CLI::App& probe, const Arguments& arguments) {
  std::vector<ProbePlace> places;
  auto at = arguments.at.begin();
  auto node = arguments.node.begin();
  for (const CLI::Option* option : probe.parse_order()) {
    if (option->get_name() == "--at") {
      places.push_back({.at = vector_argument("--at", *at++), .node = {}, .displacement = {}});
    } else if (option->get_name() == "--node") {
      places.push_back({.at = {}, .node = parse_index(*node), .displacement = {}});
      if (!places.back().node)
        throw CLI::ValidationError("--node", "'" + *node + "' is not the number of a node");
      ++node;
    }
  }
  if (places.empty()) throw CLI::RequiredError("--at or --node");
  if (places.size() != arguments.displace.size()) {
    throw CLI::ValidationError("--displace", fmt::format("{} displacements are given for {} places",
                                                         arguments.displace.size(), places.size()));
  }
  for (std::size_t k = 0; k < places.size(); ++k) {
    places[k].displacement = vector_argument("--displace", arguments.displace[k]);
  }
  return places;
}

/// "r=3,rings=2", either part with its default when it is left out.
OverlayOptions read_overlay(const std::string& text) {
  OverlayOptions overlay;
  for (const std::string_view part : split_commas(text)) {
    const std::size_t equals = std::min(part.find('='), part.size());
    const std::string_view name = part.substr(0, equals);
    const std::optional<Index> value =
        parse_index(std::string(part.substr(std::min(equals + 1, part.size()))));
    if (name == "r" && value && *value >= 2 && *value <= 16) {
      overlay.refinement = *value;
    } else if (name == "rings" && value && *value >= 1 && *value <= 16) {
      overlay.rings = *value;
    } else {
      throw CLI::ValidationError("--overlay",
                                 fmt::format("'{}' is neither r=2 to r=16 nor rings=1 to rings=16", part));
    }
  }
  return overlay;
}

/// "point", "sphere:RADIUS" or "capsule:RADIUS,LENGTH".
Tool read_shape(const std::string& text) {
  Tool tool;
  if (text == "point") return tool;
  const std::string_view rest = std::string_view(text).substr(std::min(text.find(':') + 1, text.size()));
  const std::vector<std::string_view> sizes = split_commas(rest);
  const bool sphere = text.starts_with("sphere:") && sizes.size() == 1;
  const bool capsule = text.starts_with("capsule:") && sizes.size() == 2;
  if (!sphere && !capsule) {
    throw CLI::ValidationError(
        "--tool", "'" + text + "' is none of point, sphere:RADIUS and capsule:RADIUS,LENGTH (metres)");
  }
  const auto size = [&](std::string_view number) {
    const std::optional<double> metres = parse_number(number);
    if (metres && *metres > 0.0) return *metres;
    throw CLI::ValidationError("--tool",
                               fmt::format("'{}' of '{}' is not a positive number of metres", number, text));
  };
  tool.radius = size(sizes[0]);
  if (capsule) tool.length = size(sizes[1]);
  return tool;
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

Tool read_tool(const Arguments& arguments) {
  Tool tool = read_shape(arguments.tool);
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

double read_frame_rate(const std::optional<std::string>& text) {
  if (!text) return PlayOptions{}.record_frames;
  const std::optional<double> rate = parse_number(*text);
  if (!rate || *rate < 0.0)
    throw CLI::ValidationError("--record-frames", "'" + *text + "' is not a number from 0 on");
  return *rate;
}

ContactModel read_contact(const std::string& text) {
  if (text == "quasi-static") return ContactModel::quasi_static;
  if (text == "dynamic") return ContactModel::dynamic;
  throw CLI::ValidationError("--contact", "'" + text + "' is neither quasi-static nor dynamic");
}

PlayOptions read_play(const Arguments& arguments) {
  const std::string scripted = "script:";
  if (!arguments.device.starts_with(scripted) || arguments.device.size() == scripted.size()) {
    throw CLI::ValidationError("--device",
                               "'" + arguments.device + "' is not script:FILE.csv, the only device so far");
  }
  return {.file = arguments.file,
          .model_toml = arguments.model_toml,
          .script = arguments.device.substr(scripted.size()),
          .tool = read_tool(arguments),
          .reach = positive_argument("--reach", arguments.reach, "metres"),
          .max_contacts = read_max_contacts(arguments.max_contacts),
          .contact = read_contact(arguments.contact),
          .overlay = arguments.overlay ? std::optional(read_overlay(*arguments.overlay)) : std::nullopt,
          .overlay_memory = read_overlay_memory(arguments.overlay_memory),
          .fast = arguments.fast,
          .record = arguments.record,
          .record_frames = read_frame_rate(arguments.record_frames),
          .report = arguments.report,
          .surface = arguments.surface,
          .contacts = arguments.contacts};
}

int run(int argc, char** argv) {
  CLI::App app("Touches a precomputed body and answers with finite-element forces.", "palpate-runtime");
  app.set_version_flag("--version", "palpate-runtime " PALPATE_VERSION);
  app.require_subcommand(0, 1);
  app.footer(
      "Exit status: 0 done, 1 bad input or file, 2 wrong arguments, 130 interrupted.\n"
      "palpate-runtime probe --help and palpate-runtime play --help tell more.");
  Arguments arguments;
  const CLI::App* probe_command = add_probe(app, arguments);
  const CLI::App* play_command = add_play(app, arguments);
  const CLI::App* session_command = add_session(app, arguments);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) throw CLI::RequiredError("probe, play or session");
    if (play_command->parsed()) return play(read_play(arguments));
    if (session_command->parsed()) return session(arguments.file, arguments.json);
    return probe(
        {.file = arguments.file,
         .model_toml = arguments.model_toml,
         .places = read_places(*probe_command, arguments),
         .overlay = arguments.overlay ? std::optional(read_overlay(*arguments.overlay)) : std::nullopt,
         .json = arguments.json,
         .field = arguments.field});
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string command =
        app.get_subcommands().empty() ? "" : app.get_subcommands().front()->get_name() + " ";
    fmt::print(stderr, "error: {}\nhint: See palpate-runtime {}--help\n", error.what(), command);
    return exit_usage;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "error: there is not enough memory\nhint: Close other programs, or precompute with fewer "
               "surface nodes\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\nhint: This should not happen; please report it\n", error.what());
  }
  return palpate::exit_input_error;
}
