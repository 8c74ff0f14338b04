// palpate-runtime: touches a precomputed body.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/command_line.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "base/spelling.h"
#include "formats/model_file.h"
#include "runtime/app/devices_command.h"
#include "runtime/app/export.h"
#include "runtime/app/play_command.h"
#include "runtime/app/probe.h"
#include "runtime/app/session.h"
#include "runtime/app/view.h"
#include "runtime/loop/numbers.h"
#include "runtime/push/push_command.h"
#include "runtime/push/samples_command.h"
#include "runtime/push/solved_settings.h"
#include "runtime/safety/safety_options.h"

namespace {

using namespace palpate;

/// Arguments as given on the command line.
struct Arguments {
  std::string file;
  std::string model_toml;
  std::vector<std::string> at;
  std::vector<std::string> node;
  std::vector<std::string> displace;
  bool json = false;
  bool force = false;
  bool finish = false;
  std::optional<std::string> overlay;
  std::string field;
  PlayArguments play;
  PushArguments push;
  DevicesOptions devices;
  ExportOptions exported;
  std::vector<std::filesystem::path> recordings;
  ViewerArguments viewer;
  std::string help;
};

void add_file(CLI::App& command, Arguments& arguments) {
  command.add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")
      ->required()
      ->type_name("");
  command
      .add_option("--model", arguments.model_toml, "fail unless FILE was made from exactly this model.toml")
      ->type_name("FILE");
}

CLI::Option* add_repeatable(CLI::App& command, const std::string& name, std::vector<std::string>& values,
                            const std::string& type, const std::string& help) {
  return command.add_option(name, values, help)->type_name(type)->allow_extra_args(false);
}

CLI::App* add_probe(CLI::App& app, Arguments& arguments) {
  CLI::App* probe = app.add_subcommand("probe", "displace nodes and print the forces this takes");
  add_file(*probe, arguments);
  add_repeatable(*probe, "--at", arguments.at, "X,Y,Z",
                 "the free surface node nearest to this point of the body at rest [m]; repeatable");
  add_repeatable(*probe, "--node", arguments.node, "N", "the node with this number in the mesh; repeatable");
  add_repeatable(*probe, "--displace", arguments.displace, "DX,DY,DZ",
                 "its displacement [m]; one for each --at and --node, in the same order")
      ->required();
  probe
      ->add_option("--overlay", arguments.overlay,
                   "a finer mesh (s-FEM): each element within N rings of those nodes is cut into R to the "
                   "power of the dimension")
      ->type_name("r=R,rings=N");
  probe->add_flag("--json", arguments.json, "print JSON");
  probe
      ->add_option("--field", arguments.field,
                   "write the displacements at rest and due to the probe: a table of the stored nodes, or a "
                   "grid for ParaView")
      ->type_name("OUT.csv|OUT.vtu");
  probe->add_flag("--force", arguments.force, force_help);
  probe->footer(
      "Forces are those on the body, in newtons; the hand feels the opposite. Displacements are relative to\n"
      "the body at rest under its loads. For a body in the plane give X,Y and DX,DY.\n"
      "Example:\n  palpate-runtime probe liver.palpate.hdf --at 0.1,0.05,0.12 --displace 0,0,-0.005 --field "
      "liver.vtu");
  return probe;
}

CLI::App* add_devices(CLI::App& app, Arguments& arguments) {
  CLI::App* devices = app.add_subcommand("devices", "list the HID devices and the profiles that fit them");
  devices->add_flag("--json", arguments.devices.json, "print JSON");
  devices->add_option("--profile", arguments.devices.profile, "also try this profile of your own")
      ->type_name("FILE.toml");
  devices
      ->add_option("--print-profile", arguments.devices.print_profile,
                   "print a built-in profile, to copy and edit")
      ->type_name("NAME");
  devices->footer(
      "A device that is listed with a profile can be used by palpate-runtime play FILE --device hid.\n"
      "Examples:\n"
      "  palpate-runtime devices\n"
      "  palpate-runtime devices --print-profile spacemouse > mine.toml");
  return devices;
}

CLI::App* add_session(CLI::App& app, Arguments& arguments) {
  CLI::App* session = app.add_subcommand("session", "print what a recording contains");
  session->add_option("SESSION.mcap", arguments.file, "recording of play")->required()->type_name("");
  session->add_flag("--json", arguments.json, "print JSON");
  session->add_flag("--finish", arguments.finish, "add its index to a recording whose run was killed");
  session->footer(
      "Example:\n"
      "  palpate-runtime session touch.mcap");
  return session;
}

CLI::App* add_view(CLI::App& app, Arguments& arguments) {
  CLI::App* view = app.add_subcommand(
      "view", "show a recording in a browser, two side by side, or all that is in a folder");
  view->add_option("SESSION.mcap|FOLDER", arguments.recordings,
                   "recording; two are shown side by side; or a folder, the current one without, whose "
                   "bodies and recordings are shown to choose from")
      ->expected(1, 2)
      ->type_name("");
  add_viewer_options(*view, arguments.viewer);
  view->footer(
      "To touch a model itself: palpate-runtime play FILE --view\n"
      "Examples:\n"
      "  palpate-runtime view\n"
      "  palpate-runtime view touch.mcap\n"
      "  palpate-runtime view coarse.mcap fine.mcap");
  return view;
}

/// CLI::PositiveNumber accepts nan.
std::string check_number(const std::string& text) {
  return parse_number(text) ? "" : "'" + text + "' is not a finite number";
}

CLI::App* add_export(CLI::App& app, ExportOptions& options) {
  CLI::App* exported = app.add_subcommand(
      "export", "write a recording as a web page, a glTF scene, for ParaView, as HDF5 or as a table");
  exported->add_option("SESSION.mcap", options.recording, "recording")->required()->type_name("");
  CLI::Option_group* outputs = exported->add_option_group("outputs", "one of them at least");
  outputs->add_option("--html", options.html, "one web page that needs no program")->type_name("OUT.html");
  outputs
      ->add_option("--gltf", options.gltf, "surface and tool as an animation, for Blender and game engines")
      ->type_name("OUT.glb");
  outputs
      ->add_option("--vtu", options.vtu,
                   "a collection for ParaView; its pictures go into the folder OUT.frames")
      ->type_name("OUT.pvd");
  outputs->add_option("--csv", options.csv, "the ticks as a table")->type_name("OUT.csv");
  outputs
      ->add_option("--hdf5", options.hdf5,
                   "ticks and pictures for h5py and MATLAB, with OUT.xdmf for ParaView beside it")
      ->type_name("OUT.h5");
  outputs->require_option(1, 5);
  exported->add_flag("--force", options.force, force_help);
  exported->add_option("--fps", options.fps, "most pictures per second; default: 30, and all for --hdf5")
      ->option_text("N")
      ->check(CLI::PositiveNumber)
      ->check(check_number);
  exported->add_option("--from", options.from, "time at which it starts [s]")
      ->option_text("S")
      ->check(CLI::NonNegativeNumber)
      ->check(check_number);
  exported->add_option("--to", options.to, "time at which it ends [s]")
      ->option_text("S")
      ->check(CLI::NonNegativeNumber)
      ->check(check_number);
  exported->footer(
      "Example:\n"
      "  palpate-runtime export touch.mcap --html touch.html\n"
      "  palpate-runtime export touch.mcap --gltf touch.glb --fps 10");
  return exported;
}

std::vector<double> vector_argument(const std::string& option, const std::string& text) {
  const std::optional<std::vector<double>> vector = parse_vector(text);
  if (!vector)
    throw CLI::ValidationError(option, "'" + text + "' is not finite numbers X,Y,Z (in the plane X,Y)");
  return *vector;
}

/// Pairs places and displacements in the order of the command line.
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

constexpr std::string_view commands = "push, play, view, probe, session, export, devices or samples";

/// Returns a hint at the intended command if the first word is not one; otherwise empty.
std::string meant_by(const CLI::App& app, const std::string& word) {
  if (word.empty() || word.starts_with('-') || find_command(app, word) != nullptr) return "";
  const std::string see = "See palpate-runtime --help";
  if (word.ends_with(".mcap"))
    return "palpate-runtime view " + shell_word(word) + " shows a recording. " + see;
  if (word.ends_with(".hdf"))
    return "palpate-runtime play " + shell_word(word) + " --view shows it and lets you push it. " + see;
  if (word.ends_with(".toml"))
    return "palpate-precompute " + shell_word(word) + " makes the file that is played with. " + see;
  for (const char* const ending :
       {".stl", ".obj", ".ply", ".off", ".inr", ".inr.gz", ".nii", ".nii.gz", ".nrrd", ".png", ".pbm"}) {
    if (word.ends_with(ending))
      return fmt::format("palpate-runtime push {} makes a body of it that you can push. {}", shell_word(word),
                         see);
  }
  const auto command =
      meant(word, {"push", "probe", "play", "view", "export", "session", "devices", "samples", "help"});
  return command ? "Did you mean palpate-runtime " + *command + "? " + see
                 : fmt::format("Commands are {}. {}", commands, see);
}

int play_and_name_next(const PlayOptions& options) {
  const int status = play(options);
  const bool has_pictures = options.record_frames > 0.0;
  if (!options.record.empty())
    say(stderr, "next: palpate-runtime {} {}\n", has_pictures ? "view" : "session",
        shell_word(options.record.string()));
  return status;
}

/// Bakes the file unless it is baked already, and plays it with a viewer. Wrong arguments are reported before
/// the bake.
int push(const PushArguments& arguments) {
  PlayArguments play_arguments;
  play_arguments.file = arguments.file;
  play_arguments.view = true;
  play_arguments.viewer = arguments.viewer;
  play_arguments.duration = arguments.duration;
  PlayOptions options = read_play(play_arguments);
  if (!is_baked(arguments)) {
    const Baked baked = bake_first(arguments);
    if (baked.status != exit_ok) return baked.status;
    options.file = baked.file;
  }
  options.settings_text = solved_settings(load_outline(options.file));
  options.settings = read_settings(options.settings_text);
  if (!options.settings_text.empty())
    say(stderr, "solved while you touch it: palpate-runtime play {} --view {}\n",
        shell_word(options.file.string()), option_text(options.settings_text));
  return play(options);
}

/// Returns the tables of settings and safety bounds, with units and defaults separate from their meanings.
nlohmann::ordered_json number_tables() {
  nlohmann::ordered_json settings = nlohmann::ordered_json::array(), safety = settings;
  for (const Setting& setting : settings_table()) {
    settings.push_back({{"name", setting.name},
                        {"unit", setting.unit},
                        {"otherwise", setting.otherwise},
                        {"meaning", setting.meaning}});
  }
  for_each_safety_field(SafetyOptions{}, [&](const SafetyField& field, const auto& number) {
    safety.push_back({{"name", field.name},
                      {"otherwise", number},
                      {"unit", field.unit},
                      {"allowed", field.range.words},
                      {"meaning", field.meaning}});
  });
  return {{"settings", settings}, {"safety", safety}};
}

int run(int argc, char** argv) {
  CLI::App app("Lets a tool touch a precomputed elastic body and computes the finite-element forces.",
               "palpate-runtime");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "palpate-runtime " PALPATE_VERSION);
  app.require_subcommand(0, 1);
  app.footer(
      "Examples:\n"
      "  palpate-runtime push organ.stl                  make a body of a surface and push it in a browser\n"
      "  palpate-runtime play cube.palpate.hdf --view    push a precomputed one\n"
      "  palpate-runtime view                            choose from what this folder has\n"
      "  palpate-runtime samples                         small programs to begin with\n"
      "  palpate-runtime help play                       more about a command\n"
      "Exit status: 0 done, 1 bad input or file, 2 wrong arguments, 3 a replay differed, 130 interrupted.");
  Arguments arguments;
  CLI::App* push_command = add_push(app, arguments.push);
  add_viewer_options(*push_command, arguments.push.viewer);
  const CLI::App* play_command = add_play(app, arguments.play);
  const CLI::App* view_command = add_view(app, arguments);
  const CLI::App* probe_command = add_probe(app, arguments);
  const CLI::App* session_command = add_session(app, arguments);
  const CLI::App* export_command = add_export(app, arguments.exported);
  const CLI::App* devices_command = add_devices(app, arguments);
  const CLI::App* samples_command = add_samples(app);
  const CLI::App* help_command = add_help_command(app, arguments.help);
  if (asks_for_json(argc, argv)) return print_help_json(app, number_tables());
  const std::string first_word = argc > 1 ? argv[1] : "";
  if (const std::string hint = meant_by(app, first_word); !hint.empty()) {
    return tell_usage("'" + first_word + "' is no command", hint);
  }
  try {
    parse(app, argc, argv);
    if (app.get_subcommands().empty()) throw CLI::RequiredError(std::string(commands));
    if (help_command->parsed()) {
      std::fputs(help_page(app, arguments.help).c_str(), stdout);
      return exit_ok;
    }
    if (devices_command->parsed()) return devices(arguments.devices);
    if (samples_command->parsed()) return show_samples();
    if (session_command->parsed()) return session(arguments.file, arguments.json, arguments.finish);
    if (view_command->parsed()) return view(arguments.recordings, read_viewer(arguments.viewer));
    if (export_command->parsed()) return export_session(arguments.exported);
    if (push_command->parsed()) return push(arguments.push);
    if (play_command->parsed()) return play_and_name_next(read_play(arguments.play));
    return probe({.file = arguments.file,
                  .model_toml = arguments.model_toml,
                  .places = read_places(*probe_command, arguments),
                  .overlay = arguments.overlay && *arguments.overlay != "no"
                                 ? std::optional(read_overlay(*arguments.overlay))
                                 : std::nullopt,
                  .json = arguments.json,
                  .field = arguments.field,
                  .force = arguments.force});
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const bool of_command = !app.get_subcommands().empty() && !help_command->parsed();
    const std::string command = of_command ? app.get_subcommands().front()->get_name() + " " : "";
    return tell_usage(error.what(),
                      meant_option(app, argc, argv) + "See palpate-runtime " + command + "--help");
  }
}

}  // namespace

int main(int argc, char** argv) {
  palpate::end_with_an_error_on_shrunk_files();
  return palpate::run_program("palpate-runtime",
                              "close other programs, or precompute with fewer surface nodes",
                              [&] { return run(argc, argv); });
}
