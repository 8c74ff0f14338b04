// palpate-precompute: from model.toml to NAME.palpate.hdf, once a model.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>

#include "base/command_line.h"
#include "base/error.h"
#include "base/program.h"
#include "base/spelling.h"
#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/compare.h"
#include "precompute/description/not_a_description.h"
#include "precompute/inspect.h"
#include "precompute/verify.h"

namespace {

int run_bake(const std::string& model, palpate::BakeOptions options) {
  palpate::check_is_description(model);
  const palpate::Description description = palpate::read_description(model);
  if (options.output.empty()) options.output = description.name + ".palpate.hdf";
  switch (palpate::bake(description, options)) {
    case palpate::BakeResult::interrupted:
      return palpate::exit_interrupted;
    case palpate::BakeResult::done:
      std::fprintf(stderr, "next: palpate-precompute verify %s\n      palpate-runtime play %s --view\n",
                   options.output.c_str(), options.output.c_str());
      break;
    case palpate::BakeResult::planned:
      break;
  }
  return palpate::exit_ok;
}

int run_verify(const std::string& file) {
  const palpate::VerifyReport report = palpate::verify(palpate::load_model(file), file);
  std::fputs(palpate::to_text(report).c_str(), stdout);
  if (!report.passed()) return palpate::exit_differs;
  std::fprintf(stderr, "next: palpate-runtime play %s --view\n", file.c_str());
  return palpate::exit_ok;
}

int run_compare(const std::string& a, const std::string& b, const palpate::CompareOptions& options) {
  const palpate::Comparison comparison =
      palpate::compare(palpate::load_model(a), palpate::load_model(b), options);
  std::fputs(palpate::to_text(comparison).c_str(), stdout);
  return palpate::exit_ok;
}

/// As they were written.
struct Arguments {
  std::string model, file, other_file;
  palpate::BakeOptions bake;
  palpate::CompareOptions compare;
  palpate::HelpArguments help;
};

void add_bake(CLI::App& app, Arguments& arguments) {
  palpate::BakeOptions& options = arguments.bake;
  options.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  app.add_option("MODEL.toml", arguments.model, "description of the body")->type_name("");
  app.add_option("-o,--output", options.output,
                 "file to write; default: NAME.palpate.hdf in the current folder")
      ->type_name("FILE");
  app.add_option("-j,--jobs", options.jobs, "number of threads; default: one per processor")
      ->option_text("N")
      ->check(CLI::Range(1, 1024));
  app.add_flag("--dry-run", options.dry_run,
               "print what it would need (degrees of freedom, bytes, time) and stop");
  app.add_flag("--force", options.force, "overwrite the output even if it is not an earlier model");
  app.add_flag(
      "--discard", options.discard,
      "start over; by default a run that was interrupted or killed resumes with the columns it has finished");
  app.footer(
      "Examples:\n"
      "  palpate-precompute meshes/models/cube/model.toml    writes cube.palpate.hdf\n"
      "  palpate-precompute help verify                      more about a command\n"
      "  palpate-runtime play cube.palpate.hdf --view        then: push it in a browser\n"
      "Ctrl-C keeps the finished columns in FILE.partial and FILE.progress; give the same command to "
      "resume.\n"
      "Exit status: 0 done, 1 bad input or not enough room, 2 wrong arguments, 3 not verified, 130 "
      "interrupted.");
}

CLI::App* add_inspect(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("inspect", "print what a file contains");
  command->add_option("FILE", arguments.file, "precomputed model, NAME.palpate.hdf")
      ->required()
      ->type_name("");
  command->footer(
      "Prints materials, mesh and mesh quality, fixed and stored nodes, overlays, dynamics and source "
      "files.\n"
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
  palpate::CompareOptions& options = arguments.compare;
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

/// What to do instead, where a usage error shows it.
std::string usage_hint(const CLI::App& app, const std::string& first_word) {
  const bool of_help = app.got_subcommand("help");
  if (!app.get_subcommands().empty() && !of_help) {
    return "See palpate-precompute " + app.get_subcommands().front()->get_name() + " --help";
  }
  if (of_help) return "See palpate-precompute --help";
  const auto command = palpate::meant(first_word, {"inspect", "verify", "compare", "help"});
  if (command && !std::filesystem::exists(first_word))
    return "Did you mean palpate-precompute " + *command + "? See palpate-precompute --help";
  return "See palpate-precompute --help";
}

int run(int argc, char** argv) {
  CLI::App app{
      "Meshes an elastic body, assembles its stiffness and stores the Green's functions from which "
      "palpate-runtime computes forces.",
      "palpate-precompute"};
  app.formatter(std::make_shared<palpate::HelpFormatter>());
  app.set_version_flag("--version", "palpate-precompute " PALPATE_VERSION);
  app.require_subcommand(0, 1);
  Arguments arguments;
  add_bake(app, arguments);
  const CLI::App* inspect_command = add_inspect(app, arguments);
  const CLI::App* verify_command = add_verify(app, arguments);
  const CLI::App* compare_command = add_compare(app, arguments);
  const CLI::App* help_command = palpate::add_help_command(app, arguments.help);
  try {
    app.parse(argc, argv);
    if (help_command->parsed()) {
      std::fputs(palpate::help_page(app, arguments.help).c_str(), stdout);
      return palpate::exit_ok;
    }
    if (app.get_subcommands().empty() && arguments.model.empty())
      throw CLI::RequiredError("MODEL.toml, `inspect FILE`, `verify FILE` or `compare A B`");
    if (const auto command = palpate::meant(arguments.model, {"inspect", "verify", "compare"});
        command && !std::filesystem::exists(arguments.model))
      throw CLI::ParseError("there is no command '" + arguments.model + "' and no such file",
                            CLI::ExitCodes::ExtrasError);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return palpate::tell_usage(error.what(), usage_hint(app, argc > 1 ? argv[1] : ""));
  }
  if (inspect_command->parsed()) {
    std::fputs(palpate::inspect(palpate::load_model(arguments.file)).c_str(), stdout);
    return palpate::exit_ok;
  }
  if (compare_command->parsed()) return run_compare(arguments.file, arguments.other_file, arguments.compare);
  if (verify_command->parsed()) return run_verify(arguments.file);
  return run_bake(arguments.model, arguments.bake);
}

}  // namespace

int main(int argc, char** argv) {
  palpate::end_with_an_error_on_shrunk_files();
  return palpate::run_program("palpate-precompute", "try --dry-run, and fewer --jobs or a coarser mesh",
                              [&] { return run(argc, argv); });
}
