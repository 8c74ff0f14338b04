// palpate-precompute: from model.toml to NAME.palpate.hdf, once a model.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <thread>

#include "formats/model_file.h"
#include "formats/shrunk_file.h"
#include "meshes/error.h"
#include "meshes/printable.h"
#include "meshes/standard_output.h"
#include "precompute/bake.h"
#include "precompute/compare.h"
#include "precompute/inspect.h"
#include "precompute/verify.h"

namespace {

int run_bake(const std::string& model, palpate::BakeOptions options) {
  const palpate::Description description = palpate::read_description(model);
  if (options.output.empty()) options.output = description.name + ".palpate.hdf";
  const bool stopped = palpate::bake(description, options) == palpate::BakeResult::interrupted;
  return stopped ? palpate::exit_interrupted : palpate::exit_ok;
}

int run_verify(const std::string& file) {
  const palpate::VerifyReport report = palpate::verify(palpate::load_model(file), file);
  std::fputs(palpate::to_text(report).c_str(), stdout);
  return report.passed() ? palpate::exit_ok : palpate::exit_differs;
}

int run_compare(const std::string& a, const std::string& b, const palpate::CompareOptions& options) {
  const palpate::Comparison comparison =
      palpate::compare(palpate::load_model(a), palpate::load_model(b), options);
  std::fputs(palpate::to_text(comparison).c_str(), stdout);
  return palpate::exit_ok;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Meshes a body, assembles its stiffness and stores the Green's functions that palpate-runtime feels "
      "with."};
  app.set_version_flag("--version", "palpate-precompute " PALPATE_VERSION);
  app.footer(
      "Examples:\n"
      "  palpate-precompute meshes/models/cube/model.toml\n"
      "  palpate-precompute inspect cube.palpate.hdf\n"
      "  palpate-precompute verify cube.palpate.hdf\n"
      "  palpate-precompute compare coarse.palpate.hdf fine.palpate.hdf\n"
      "Exit status: 0 done, 1 bad input or no room (nothing was changed), 2 usage, 3 not verified, 130 "
      "interrupted.");
  app.require_subcommand(0, 1);

  std::string model, file;
  palpate::BakeOptions options;
  options.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  CLI::Option* model_option = app.add_option("model", model, "description of the body (model.toml)");
  app.add_option("-o,--output", options.output, "file to write (default: NAME.palpate.hdf here)");
  app.add_option("-j,--jobs", options.jobs, "threads")->capture_default_str()->check(CLI::Range(1, 1024));
  app.add_flag("--force", options.force, "let the output take the place of any other file");
  app.add_flag("--dry-run", options.dry_run, "say what it would take (dofs, bytes, time) and stop");
  CLI::App* inspect_command = app.add_subcommand("inspect", "print what is in a file");
  CLI::App* verify_command = app.add_subcommand(
      "verify",
      "check a file: checksums, probes, sampled columns against K, and whether its sources have changed");
  for (CLI::App* command : {inspect_command, verify_command}) {
    command->add_option("file", file, "NAME.palpate.hdf")->required();
  }

  CLI::App* compare_command = app.add_subcommand(
      "compare",
      "press the same finger tip on two files of one body and print how force and displacement differ");
  std::string file_b;
  palpate::CompareOptions compare_options;
  compare_command->add_option("A", file, "NAME.palpate.hdf")->required();
  compare_command->add_option("B", file_b, "NAME.palpate.hdf")->required();
  compare_command->add_option("--touches", compare_options.touches, "places, spread over the boundary")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  compare_command
      ->add_option("--radius", compare_options.radius,
                   "of the finger tip [m]; 0 is a single node; default: three mean edges of the coarser file")
      ->check(CLI::NonNegativeNumber);

  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty() && model_option->count() == 0) {
      throw CLI::RequiredError("model.toml, `inspect FILE`, `verify FILE` or `compare A B`");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? palpate::exit_ok : palpate::exit_usage;
  }

  try {
    if (inspect_command->parsed()) {
      std::fputs(palpate::inspect(palpate::load_model(file)).c_str(), stdout);
      return palpate::exit_ok;
    }
    if (compare_command->parsed()) return run_compare(file, file_b, compare_options);
    return verify_command->parsed() ? run_verify(file) : run_bake(model, options);
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
  } catch (const std::bad_alloc&) {
    std::fputs(
        "error: memory: no more memory could be had\nhint: Try --dry-run, and fewer --jobs or a coarser "
        "mesh.\n",
        stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr,
                 "error: palpate-precompute: %s\nhint: This is a defect of Palpate; please report it.\n",
                 palpate::printable_lines(error.what(), "  ").c_str());
  }
  return palpate::exit_input_error;
}

}  // namespace

int main(int argc, char** argv) {
  palpate::prepare_output();
  palpate::end_with_an_error_on_shrunk_files();
  return palpate::finish_output(run(argc, argv));
}
