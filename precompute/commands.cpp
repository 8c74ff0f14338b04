#include "precompute/commands.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "base/command_line.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "base/spelling.h"
#include "formats/model_file.h"
#include "formats/writer/add_index.h"
#include "precompute/bake.h"
#include "precompute/bake_report.h"
#include "precompute/compare.h"
#include "precompute/description/keys_json.h"
#include "precompute/description/not_a_description.h"
#include "precompute/description/read_description.h"
#include "precompute/draft_command.h"
#include "precompute/inspect.h"
#include "precompute/machine/blas_room.h"
#include "precompute/progress.h"
#include "precompute/verify.h"

namespace palpate {
namespace {

/// Reads "3/16"; nullopt if it is no part.
std::optional<PartNumber> read_part_number(const std::string& text) {
  PartNumber part;
  const char* const end = text.data() + text.size();
  const auto [slash, bad] = std::from_chars(text.data(), end, part.number);
  if (bad != std::errc() || slash == end || *slash != '/') return {};
  const auto [last, bad_too] = std::from_chars(slash + 1, end, part.parts);
  if (bad_too != std::errc() || last != end || part.number < 1 || part.number > part.parts ||
      part.parts > most_parts)
    return {};
  return part;
}

void add_report(CLI::App& command, BakeOptions& options) {
  command
      .add_option("--report", options.report,
                  "write a report as JSON: sizes, seconds of the stages, memory; -: to standard output")
      ->type_name("FILE");
}

void add_jobs(CLI::App& command, BakeOptions& options) {
  options.jobs = 0;
  command
      .add_option("-j,--jobs", options.jobs, "number of threads; default: one per processor that it may use")
      ->option_text("N")
      ->check(CLI::Range(1, 1024));
}

/// Command to touch a baked body.
std::string to_touch(const std::string& file, bool has_greens) {
  return has_greens ? "palpate-runtime play " + shell_word(file) + " --view"
                    : "palpate-runtime push " + shell_word(file);
}

}  // namespace

void add_bake_options(CLI::App& app, BakeOptions& options) {
  app.add_option("-o,--output", options.output,
                 "file to write; default: NAME.palpate.hdf in the current folder")
      ->type_name("FILE");
  add_jobs(app, options);
  app.add_flag("--dry-run", options.dry_run,
               "print what it would need (degrees of freedom, bytes, time) and stop");
  app.add_flag("--force", options.force, "overwrite the output even if it is not an earlier model");
  app.add_flag("--keep", options.keep, "write no file that is there already, whatever it is")
      ->excludes("--force");
  app.add_flag(
      "--discard", options.discard,
      "start over; by default a run that was interrupted or killed resumes with the columns it has finished");
  add_report(app, options);
}

BakeSummary bake_model(const std::string& model, BakeOptions options, Team& team) {
  check_is_description(model);
  const Description description = read_description(model);
  if (options.output.empty()) options.output = description.name + ".palpate.hdf";
  if (options.jobs == 0) options.jobs = threads_with_room(team.default_jobs());
  return bake(description, options, team);
}

std::string next_steps(const BakeSummary& bake) {
  const std::string output = bake.output.string();
  if (bake.result == BakeResult::part_done)
    return "next, once all parts are there: palpate-precompute join " + shell_word(bake.model) + "\n";
  if (bake.result != BakeResult::done) return "";
  const bool has_greens = bake.plan.stored_dofs > 0;
  return "next: palpate-precompute verify " + shell_word(output) + "\n      " + to_touch(output, has_greens) +
         "\n";
}

namespace {

/// True if the output matches the bake of this description, by its text and its source files.
bool is_done(const Description& description, const std::filesystem::path& output) {
  if (!std::filesystem::exists(output)) return false;
  try {
    const Model model = load_model(output);
    return model.model_toml == description.text && stale_sources(model, output).empty();
  } catch (const Error&) {
    return false;
  }
}

/// Bakes a model, unless `unless_done` and nothing has changed.
BakeSummary bake_or_keep(const std::string& model, const BakeOptions& options, bool unless_done) {
  if (unless_done) {
    check_is_description(model);
    const Description description = read_description(model);
    const std::filesystem::path output =
        options.output.empty() ? std::filesystem::path(description.name + ".palpate.hdf") : options.output;
    if (is_done(description, output)) {
      say(stderr, "{} is there, and nothing that it was made from has changed\n", output);
      return {.model = model, .output = output, .result = BakeResult::done};
    }
  }
  Team alone;
  return bake_model(model, options, alone);
}

int run_bake(const std::string& model, const BakeOptions& options, bool unless_done) {
  const auto start = std::chrono::steady_clock::now();
  const BakeSummary summary = bake_or_keep(model, options, unless_done);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!options.report.empty())
    write_report(options.report, {json_text_of(summary)}, {1, summary.jobs, seconds, {peak_memory()}});
  say_lines(stderr, next_steps(summary));
  return summary.result == BakeResult::interrupted ? exit_interrupted : exit_ok;
}

int run_verify(const std::string& file) {
  std::optional<Waiting> waiting(std::in_place, "verifying " + file);
  const Model model = load_model(file);
  const VerifyReport report = verify(model, file);
  waiting.reset();
  say_lines(stdout, to_text(report));
  if (!report.passed()) return exit_differs;
  say(stderr, "next: {}\n", to_touch(file, model.scope != Scope::none));
  return exit_ok;
}

int run_compare(const std::string& a, const std::string& b, const CompareOptions& options) {
  std::optional<Waiting> waiting(std::in_place, "comparing " + a + " with " + b);
  const Comparison comparison = compare(load_model(a), load_model(b), options);
  waiting.reset();
  say_lines(stdout, to_text(comparison));
  return exit_ok;
}

/// Arguments as typed.
struct Arguments {
  std::string model, file, other_file, part;
  BakeOptions bake;
  bool unless_done = false;
  DraftArguments draft;
  CompareOptions compare;
  std::string help;
};

void add_bake(CLI::App& app, Arguments& arguments) {
  app.add_option(
         "MODEL.toml", arguments.model,
         "description of the body; or a surface (.stl, .obj, .ply, .off) or a labelled image (.nrrd, "
         ".nii, .inr, also with .gz), of which the description NAME.model.toml is written beside it first")
      ->type_name("");
  add_bake_options(app, arguments.bake);
  app.add_flag("--unless-done", arguments.unless_done,
               "do nothing where the output is there and nothing that it was made from has changed");
  app.add_option(
         "--part", arguments.part,
         "compute only the K-th of N shares of the columns, into FILE.part-K-of-N; 'join' makes one file "
         "of all")
      ->option_text("K/N")
      ->check([](const std::string& text) {
        return read_part_number(text) ? "" : "'" + text + "' is not K/N with 1 <= K <= N <= 100000";
      });
  add_draft_options(app, arguments.draft);
  app.get_option("--renew")->excludes("--keep");
  app.footer(
      "Examples:\n"
      "  palpate-precompute meshes/models/cube/model.toml    writes cube.palpate.hdf\n"
      "  palpate-precompute organ.stl                        writes organ.model.toml and organ.palpate.hdf\n"
      "  palpate-precompute help verify                      more about a command\n"
      "  palpate-runtime play cube.palpate.hdf --view        then: push it in a browser\n"
      "Ctrl-C, SIGTERM or SIGUSR1 keeps finished columns in FILE.partial and .progress; the same command "
      "resumes.\n"
      "Exit status: 0 done, 1 bad input or not enough room, 2 wrong arguments, 3 not verified, 130 "
      "interrupted.");
}

CLI::App* add_join(CLI::App& app, Arguments& arguments) {
  BakeOptions& options = arguments.bake;
  CLI::App* command = app.add_subcommand("join", "make one file of the parts that --part K/N has computed");
  command->add_option("MODEL.toml", arguments.file, "description of the body, the same as that of the parts")
      ->required()
      ->type_name("");
  command
      ->add_option("PART", options.parts,
                   "parts, or folders in which they are; default: the folder of the output")
      ->type_name("");
  command
      ->add_option("-o,--output", options.output,
                   "file to write; default: NAME.palpate.hdf in the current folder")
      ->type_name("FILE");
  add_jobs(*command, options);
  command->add_flag("--force", options.force, "overwrite the output even if it is not an earlier model");
  add_report(*command, options);
  command->add_flag("--keep-parts", options.keep_parts, "leave the parts there once the file is written");
  command->footer(
      "The file has the bytes that one run without parts would have written. A run that was\n"
      "interrupted or killed is resumed by the same command.\n"
      "Examples:\n"
      "  palpate-precompute meshes/models/cube/model.toml --part 1/2\n"
      "  palpate-precompute meshes/models/cube/model.toml --part 2/2    on another machine\n"
      "  palpate-precompute join meshes/models/cube/model.toml          writes cube.palpate.hdf");
  return command;
}

CLI::App* add_inspect(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("inspect", "print what a file contains");
  command->add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")
      ->required()
      ->type_name("");
  command->footer(
      "Prints materials, mesh and mesh quality, fixed and stored nodes, overlays, dynamics\n"
      "and source files.\n"
      "Example:\n"
      "  palpate-precompute inspect cube.palpate.hdf");
  return command;
}

CLI::App* add_verify(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand(
      "verify",
      "check a file: checksums, probes, sampled columns against K, and whether its sources have changed");
  command->add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")
      ->required()
      ->type_name("");
  command->footer(
      "Prints one line per check, with the measured error and its bound. Exit status 3 if one fails.\n"
      "Example:\n"
      "  palpate-precompute verify cube.palpate.hdf && palpate-runtime play cube.palpate.hdf --view");
  return command;
}

CLI::App* add_compare(CLI::App& app, Arguments& arguments) {
  CompareOptions& options = arguments.compare;
  CLI::App* command = app.add_subcommand(
      "compare",
      "press the same fingertip on two files of one body and print how force and displacement differ");
  command->add_option("A", arguments.file, "precomputed model, NAME.palpate.hdf")->required()->type_name("");
  command->add_option("B", arguments.other_file, "another model NAME.palpate.hdf, usually the finer one")
      ->required()
      ->type_name("");
  command->add_option("--touches", options.touches, "number of places, spread over the surface; default: 20")
      ->option_text("N")
      ->check(CLI::Range(1, 10000));
  command
      ->add_option("--radius", options.radius,
                   "radius of the fingertip [m]; 0: a single node; default: three mean edge lengths of the "
                   "coarser file")
      ->option_text("METRES")
      ->check(CLI::NonNegativeNumber);
  command->footer(
      "Shows the effect of another mesh, element or precision: precompute the body twice, then compare.\n"
      "Examples:\n"
      "  palpate-precompute compare coarse.palpate.hdf fine.palpate.hdf\n"
      "  palpate-precompute compare tet4.palpate.hdf tet10.palpate.hdf --touches 50 --radius 0.01");
  return command;
}

CLI::App* add_index_command(CLI::App& app, Arguments& arguments) {
  CLI::App* command =
      app.add_subcommand("index", "put the index, by which files are read, in front of a file's HDF5");
  command->add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")
      ->required()
      ->type_name("");
  command->footer(
      "For a model whose index is missing, as h5repack leaves it out, or wrong, as another program\n"
      "has changed the HDF5. The file is written anew, whole or not at all.\n"
      "Example:\n"
      "  palpate-precompute index cube.palpate.hdf");
  return command;
}

/// Hint for a usage error.
std::string usage_hint(const CLI::App& app, const std::string& first_word) {
  const bool of_help = app.got_subcommand("help");
  if (!app.get_subcommands().empty() && !of_help) {
    return "See palpate-precompute " + app.get_subcommands().front()->get_name() + " --help";
  }
  if (of_help) return "See palpate-precompute --help";
  const auto command = meant(first_word, {"new", "join", "inspect", "verify", "compare", "index", "help"});
  if (command && !std::filesystem::exists(first_word))
    return "Did you mean palpate-precompute " + *command + "? See palpate-precompute --help";
  return "See palpate-precompute --help";
}

}  // namespace

int run_commands(int argc, char** argv) {
  CLI::App app{
      "Meshes an elastic body, assembles its stiffness and stores the Green's functions from which "
      "palpate-runtime computes forces.",
      "palpate-precompute"};
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "palpate-precompute " PALPATE_VERSION);
  app.require_subcommand(0, 1);
  Arguments arguments;
  add_bake(app, arguments);
  const CLI::App* new_command = add_new(app, arguments.file, arguments.draft);
  const CLI::App* join_command = add_join(app, arguments);
  const CLI::App* inspect_command = add_inspect(app, arguments);
  const CLI::App* verify_command = add_verify(app, arguments);
  const CLI::App* compare_command = add_compare(app, arguments);
  const CLI::App* index_command = add_index_command(app, arguments);
  const CLI::App* help_command = add_help_command(app, arguments.help);
  if (asks_for_json(argc, argv)) return print_help_json(app, {{"model", keys_json()}});
  try {
    parse(app, argc, argv);
    if (help_command->parsed()) {
      std::fputs(help_page(app, arguments.help).c_str(), stdout);
      return exit_ok;
    }
    if (app.get_subcommands().empty() && arguments.model.empty()) {
      throw CLI::RequiredError(
          "MODEL.toml, `new`, `join MODEL.toml`, `inspect FILE`, `verify FILE`, `compare A B` or `index "
          "FILE`");
    }
    if (const auto command = meant(arguments.model, {"new", "join", "inspect", "verify", "compare", "index"});
        command && !std::filesystem::exists(arguments.model))
      throw CLI::ParseError("there is no command '" + arguments.model + "' and no such file",
                            CLI::ExitCodes::ExtrasError);
    if (app.get_subcommands().empty()) check_draft_options(arguments.model, arguments.draft);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return tell_usage(error.what(), meant_option(app, argc, argv) + usage_hint(app, argc > 1 ? argv[1] : ""));
  }
  if (inspect_command->parsed()) {
    say_lines(stdout, inspect(load_model(arguments.file)));
    return exit_ok;
  }
  if (compare_command->parsed()) return run_compare(arguments.file, arguments.other_file, arguments.compare);
  if (index_command->parsed()) {
    add_index(arguments.file);
    return exit_ok;
  }
  if (verify_command->parsed()) return run_verify(arguments.file);
  if (new_command->parsed()) return run_new(arguments.file, arguments.draft);
  arguments.bake.part = read_part_number(arguments.part);
  arguments.bake.join = join_command->parsed();
  return run_bake(arguments.bake.join ? arguments.file
                                      : described(arguments.model, arguments.draft, arguments.bake.keep,
                                                  arguments.bake.output),
                  arguments.bake, arguments.unless_done);
}

}  // namespace palpate
