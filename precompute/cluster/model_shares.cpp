#include "precompute/cluster/model_shares.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <sstream>

#include "base/error.h"
#include "base/printable.h"
#include "base/program.h"
#include "precompute/bake_report.h"
#include "precompute/commands.h"

namespace palpate {
namespace {

constexpr double large = 1.5;  // of a rank's share of all: estimates are not exact

/// A rank that bakes by itself, and leaves printing to the team.
class QuietTeam : public Team {
 public:
  explicit QuietTeam(int jobs) : jobs_(jobs) {}
  [[nodiscard]] bool prints() const override { return false; }
  [[nodiscard]] int default_jobs() const override { return jobs_; }

 private:
  int jobs_;
};

/// What one rank takes for a model.
double seconds_of(const Plan& plan) {
  return plan.factor_seconds + plan.precision_seconds + plan.seconds + plan.write_seconds;
}

std::vector<double> numbers(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> result;
  for (double value = 0.0; words >> value;) result.push_back(value);
  return result;
}

}  // namespace

ModelShares share_models(const std::vector<std::string>& models, const std::vector<double>& seconds,
                         int ranks) {
  ModelShares shares;
  shares.by_rank.resize(static_cast<std::size_t>(ranks));
  const double share = std::accumulate(seconds.begin(), seconds.end(), 0.0) / ranks;
  std::vector<std::size_t> small;
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (seconds[k] > large * share) {
      shares.by_all.push_back(models[k]);
    } else {
      small.push_back(k);
    }
  }
  std::stable_sort(small.begin(), small.end(),
                   [&](std::size_t a, std::size_t b) { return seconds[a] > seconds[b]; });
  std::vector<double> busy(shares.by_rank.size(), 0.0);
  for (const std::size_t k : small) {
    const auto rank = static_cast<std::size_t>(std::min_element(busy.begin(), busy.end()) - busy.begin());
    shares.by_rank[rank].push_back(models[k]);
    busy[rank] += seconds[k];
  }
  return shares;
}

ModelShares share_models(const std::vector<std::string>& models, const BakeOptions& options, Team& team) {
  QuietTeam alone(team.default_jobs());
  BakeOptions dry = options;
  dry.dry_run = true;
  std::string planned;  // number and seconds of each model
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (static_cast<int>(k % static_cast<std::size_t>(team.size())) != team.rank()) continue;
    planned += fmt::format("{} {} ", k, seconds_of(bake_model(models[k], dry, alone).plan));
  }
  std::string all;
  for (const std::string& of_rank : team.gather(planned)) all += of_rank;
  const std::vector<double> pairs = numbers(team.share(all));
  std::vector<double> seconds(models.size(), 0.0);
  for (std::size_t k = 0; k + 1 < pairs.size(); k += 2)
    seconds[static_cast<std::size_t>(pairs[k])] = pairs[k + 1];
  return share_models(models, seconds, team.size());
}

SideBySide bake_side_by_side(const ModelShares& shares, const BakeOptions& options, Team& team) {
  if (shares.by_rank.empty()) return {};
  QuietTeam alone(options.jobs == 0 ? team.default_jobs() : options.jobs);
  std::string entries;
  int status = exit_ok;
  for (const std::string& model : shares.by_rank[static_cast<std::size_t>(team.rank())]) {
    if (status == exit_interrupted) break;
    try {
      const BakeSummary bake = bake_model(model, options, alone);
      entries += json_text_of(bake) + '\n';
      if (bake.result == BakeResult::interrupted) status = exit_interrupted;
      say(stderr, "{}: {} by rank {}\n", bake.output, name_of(bake.result), team.rank());
    } catch (const Error& error) {
      status = std::max<int>(status, exit_input_error);
      say_lines(stderr, printable(model) + ":\n" + to_text(error));
    }
  }
  SideBySide result;
  for (const std::string& of_rank : team.gather(std::to_string(status) + '\n' + entries)) {
    std::istringstream lines(of_rank);
    std::string line;
    std::getline(lines, line);
    result.status = std::max(result.status, std::stoi(line));
    while (std::getline(lines, line)) result.entries.push_back(line);
  }
  return result;
}

}  // namespace palpate
