#include "precompute/cluster/rank_commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/command_line.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "precompute/bake_report.h"
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
  app.add_option(
         "MODEL.toml", arguments.models,
         "description of a body, which all ranks bake together; or of several, which ranks bake side by "
         "side, one each at a time")
      ->type_name("");
  add_bake_options(app, arguments.bake);
  app.add_option(
         "--factor", arguments.factor_of,
         "holder of a factor of K: each rank; or all ranks together, by MUMPS (distributed). auto: each "
         "rank, and all together where one cannot hold it; default: auto")
      ->option_text("auto|rank|distributed")
      ->check(CLI::IsMember({"auto", "rank", "distributed"}));
  app.add_option("--ranks", arguments.bake.ranks, "with --dry-run: plan for so many ranks that have a factor")
      ->option_text("N")
      ->check(CLI::Range(1, 100'000));
  app.footer(
      "Examples:\n"
      "  mpirun --map-by ppr:1:node --bind-to none palpate-precompute-mpi meshes/models/liver/model.toml\n"
      "  srun palpate-precompute-mpi models/*/model.toml --report night.json\n"
      "  palpate-precompute-mpi meshes/models/liver/model.toml --dry-run --ranks 16\n"
      "The output lies in a folder that all nodes share. Its bytes are those of palpate-precompute. SIGTERM "
      "or\n"
      "SIGUSR1 keeps finished columns; the same command, or palpate-precompute, resumes.\n"
      "Exit status: 0 done, 1 bad input or not enough room, 2 wrong arguments, 130 interrupted.");
}

Spreading spreading_of(const std::string& factor_of) {
  if (factor_of == "rank") return Spreading::never;
  return factor_of == "distributed" ? Spreading::always : Spreading::where_needed;
}

/// A rank that bakes by itself beside others that do the same, and therefore does not print.
class SingleRank : public Team {
 public:
  explicit SingleRank(const Team& all) : all_(all) {}
  [[nodiscard]] bool prints() const override { return all_.size() == 1; }
  [[nodiscard]] int size_here() const override { return all_.size_here(); }
  [[nodiscard]] int default_jobs() const override { return all_.default_jobs(); }

 private:
  const Team& all_;
};

/// Throws CLI::ParseError for contradictory arguments.
void check_arguments(const Arguments& arguments) {
  if (arguments.models.empty()) throw CLI::RequiredError("MODEL.toml");
  if (arguments.models.size() > 1 && !arguments.bake.output.empty())
    throw CLI::ParseError("--output is the file of one model, and there are several",
                          CLI::ExitCodes::ExtrasError);
  if (arguments.models.size() > 1 && arguments.factor_of == "distributed")
    throw CLI::ParseError("--factor distributed is of one model, and there are several",
                          CLI::ExitCodes::ExtrasError);
  if (arguments.bake.ranks > 0 && !arguments.bake.dry_run)
    throw CLI::ParseError("--ranks goes with --dry-run; mpirun or srun says how many ranks run",
                          CLI::ExitCodes::ExtrasError);
}

/// Bakes a model on all ranks. Adds its entry of the report, in the leader.
int bake_together(const std::string& model, const BakeOptions& options, Team& team,
                  std::vector<std::string>& entries) {
  const BakeSummary bake = bake_model(model, options, team);
  if (team.leads()) say_lines(stderr, next_steps(bake));
  entries.push_back(json_text_of(bake));
  return team.any(bake.result == BakeResult::interrupted) ? exit_interrupted : exit_ok;
}

/// Bakes models that ranks draw, each alone, and prints a line for each. An error of one does not stop the
/// others.
int bake_side_by_side(const std::vector<std::string>& models, const BakeOptions& options, Team& team,
                      std::vector<std::string>& entries) {
  std::vector<Tile> tiles;
  for (std::int64_t k = 0; k < std::ssize(models); ++k) tiles.push_back({k, 1, 1.0});
  SingleRank alone(team);
  std::atomic<bool> interrupted{false}, failed{false};
  const auto bake = [&](const Tile& tile, int) {
    const std::string& model = models[static_cast<std::size_t>(tile.first)];
    try {
      const BakeSummary summary = bake_model(model, options, alone);
      if (summary.result == BakeResult::interrupted) interrupted = true;
      team.tell(json_text_of(summary));
      say(stderr, "{}: {} by rank {}\n", summary.output, name_of(summary.result), team.rank());
    } catch (const Error& error) {
      failed = true;
      say_lines(stderr, printable(model) + ":\n" + to_text(error));
    }
  };
  team.listen([&](const std::string& entry) { entries.push_back(entry); });
  constexpr int at_a_time = 1;
  if (!team.work(tiles, at_a_time, {bake, [](const Tile&) {}, [&] { return interrupted.load(); }}))
    return exit_interrupted;
  return team.any(failed) ? exit_input_error : exit_ok;
}

/// Bakes all models and returns the exit status.
int run_bakes(const Arguments& arguments, Team& team) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> entries;
  const int status = arguments.models.size() == 1
                         ? bake_together(arguments.models.front(), arguments.bake, team, entries)
                         : bake_side_by_side(arguments.models, arguments.bake, team, entries);
  std::vector<std::int64_t> peaks = {peak_memory()};
  team.exchange(std::to_string(peaks.front()),
                [&](std::string_view other) { peaks.push_back(std::stoll(std::string(other))); });
  if (team.leads() && !arguments.bake.report.empty()) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const int jobs = arguments.bake.jobs == 0 ? team.default_jobs() : arguments.bake.jobs;
    write_report(arguments.bake.report, entries, {team.size(), jobs, seconds, peaks});
  }
  return status;
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
  arguments.bake.spreading = spreading_of(arguments.factor_of);
  return run_bakes(arguments, team);
}

}  // namespace palpate
