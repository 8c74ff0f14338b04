#include "precompute/cluster/rank_commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/command_line.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "precompute/bake_report.h"
#include "precompute/cluster/model_shares.h"
#include "precompute/commands.h"

namespace palpate {
namespace {

struct Arguments {
  std::vector<std::string> models;
  std::string factor_of = "auto";
  BakeOptions bake;
  std::string help;
};

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("MODEL.toml", arguments.models,
                 "descriptions of bodies; small ones are done side by side, large ones by all ranks")
      ->type_name("");
  add_bake_options(app, arguments.bake);
  app.add_option("--factor", arguments.factor_of,
                 "who has a factor of K: the ranks of a node together, the first of which works with the "
                 "processors of all (node); each rank; or all ranks together, by MUMPS (distributed). auto: "
                 "node, and the nodes together where one cannot hold it; default: auto")
      ->option_text("auto|node|rank|distributed")
      ->check(CLI::IsMember({"auto", "node", "rank", "distributed"}));
  app.add_option("--ranks", arguments.bake.ranks, "with --dry-run: plan for so many ranks that have a factor")
      ->option_text("N")
      ->check(CLI::Range(1, 100'000));
  app.footer(
      "Examples:\n"
      "  mpirun palpate-precompute-mpi meshes/models/liver/model.toml\n"
      "  srun palpate-precompute-mpi models/*/model.toml --report night.json\n"
      "  palpate-precompute-mpi meshes/models/liver/model.toml --dry-run --ranks 16\n"
      "The output lies in a folder that all nodes share. Its bytes are those of palpate-precompute. SIGTERM "
      "or\n"
      "SIGUSR1 keeps finished columns; the same command, or palpate-precompute, resumes.\n"
      "Exit status: 0 done, 1 bad input or not enough room, 2 wrong arguments, 130 interrupted.");
}

FactorOf factor_of(const std::string& name) {
  if (name == "node") return FactorOf::node;
  if (name == "rank") return FactorOf::rank;
  return name == "distributed" ? FactorOf::all : FactorOf::automatic;
}

/// Throws CLI::ParseError.
void check_arguments(const Arguments& arguments) {
  if (arguments.models.empty()) throw CLI::RequiredError("MODEL.toml");
  if (arguments.models.size() > 1 && !arguments.bake.output.empty())
    throw CLI::ParseError("--output is the file of one model, and there are several",
                          CLI::ExitCodes::ExtrasError);
  if (arguments.bake.ranks > 0 && !arguments.bake.dry_run)
    throw CLI::ParseError("--ranks goes with --dry-run; mpirun or srun says how many ranks run",
                          CLI::ExitCodes::ExtrasError);
}

/// Bakes all models and returns the status.
int run_bakes(const Arguments& arguments, Team& team) {
  const auto start = std::chrono::steady_clock::now();
  const ModelShares shares = arguments.models.size() > 1 && team.size() > 1
                                 ? share_models(arguments.models, arguments.bake, team)
                                 : ModelShares{arguments.models, {}};
  std::vector<std::string> entries;
  int status = exit_ok;
  for (const std::string& model : shares.by_all) {
    const BakeSummary bake = bake_model(model, arguments.bake, team);
    if (!team.leads()) continue;
    entries.push_back(json_text_of(bake));
    say_lines(stderr, next_steps(bake));
    if (bake.result == BakeResult::interrupted) status = exit_interrupted;
  }
  const SideBySide others = bake_side_by_side(shares, arguments.bake, team);
  const std::string all = team.share(std::to_string(std::max(status, others.status)));
  entries.insert(entries.end(), others.entries.begin(), others.entries.end());
  const std::vector<std::string> memory = team.gather(std::to_string(peak_memory()));
  if (team.leads() && !arguments.bake.report.empty()) {
    std::vector<std::int64_t> peaks;
    for (const std::string& of_rank : memory) peaks.push_back(std::stoll(of_rank));
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const int jobs = arguments.bake.jobs == 0 ? team.default_jobs() : arguments.bake.jobs;
    write_report(arguments.bake.report, entries, {team.size(), jobs, seconds, peaks});
  }
  return std::stoi(all);
}

}  // namespace

int run_rank_commands(int argc, char** argv, Team& team) {
  CLI::App app{
      "Does the work of palpate-precompute by the ranks of MPI, on one machine or many: mpirun or srun "
      "starts them.",
      "palpate-precompute-mpi"};
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "palpate-precompute-mpi " PALPATE_VERSION);
  app.require_subcommand(0, 1);
  Arguments arguments;
  add_options(app, arguments);
  const CLI::App* help_command = add_help_command(app, arguments.help);
  if (asks_for_json(argc, argv)) return print_help_json(app, nlohmann::ordered_json::object());
  try {
    parse(app, argc, argv);
    if (help_command->parsed()) {
      std::fputs(help_page(app, arguments.help).c_str(), stdout);
      return exit_ok;
    }
    check_arguments(arguments);
  } catch (const CLI::ParseError& error) {
    if (!team.leads()) return exit_usage;
    if (error.get_exit_code() == 0) return app.exit(error);
    return tell_usage(error.what(), "See palpate-precompute-mpi --help");
  }
  team.form(factor_of(arguments.factor_of));
  return team.takes_part() ? run_bakes(arguments, team) : exit_ok;
}

}  // namespace palpate
