#include "runtime/app/best_effort_report.h"

#include <fmt/core.h>

#include <string>
#include <vector>

namespace palpate {
namespace {

constexpr double grave_ticks = 0.001;  // fraction of all ticks
constexpr double grave_error = 0.02;   // fraction of the force

/// Formats a fraction, which is 1 for all larger ones too.
std::string percent(double share) {
  return share > 0.99 ? "100 % or more" : fmt::format("{:.2g} %", 100.0 * share);
}

}  // namespace

nlohmann::ordered_json to_json(const BestEffort& best_effort) {
  return {{"ticks", best_effort.ticks},
          {"not_converged_ticks", best_effort.not_converged_ticks},
          {"unbalanced_ticks", best_effort.unbalanced_ticks},
          {"left_out_ticks", best_effort.left_out_ticks},
          {"late_ticks", best_effort.late_ticks},
          {"most_left_out", best_effort.most_left_out},
          {"force_error_N",
           {{"median", best_effort.median_error()},
            {"largest", best_effort.largest_error},
            {"largest_time_s", best_effort.largest_error_time}}},
          {"force_error_share",
           {{"median", best_effort.median_share()}, {"largest", best_effort.largest_share}}}};
}

std::string in_words(const BestEffort& best_effort, std::int64_t ticks) {
  if (best_effort.ticks == 0) return "";
  std::string text = fmt::format(
      "in {} ticks ({:.2g} %) the force was a best effort, which may be off by about {} of it in the median "
      "and up to {} ({:.3g} N at {:.3f} s)",
      best_effort.ticks, 100.0 * static_cast<double>(best_effort.ticks) / static_cast<double>(ticks),
      percent(best_effort.median_share()), percent(best_effort.largest_share), best_effort.largest_error,
      best_effort.largest_error_time);
  std::vector<std::string> reasons;
  if (best_effort.not_converged_ticks > 0)
    reasons.push_back(fmt::format("the solver was cut short in {} of them", best_effort.not_converged_ticks));
  if (best_effort.unbalanced_ticks > 0) {
    reasons.push_back(
        fmt::format("the balance at depth was not met in {} of them", best_effort.unbalanced_ticks));
  }
  if (best_effort.late_ticks > 0)
    reasons.push_back(fmt::format("the body stood still in {} of them", best_effort.late_ticks));
  if (best_effort.left_out_ticks > 0) {
    reasons.push_back(
        fmt::format("up to {} contact points found no room in {} of them; give it more "
                    "--max-contacts, or a smaller tool",
                    best_effort.most_left_out, best_effort.left_out_ticks));
  }
  for (std::size_t k = 0; k < reasons.size(); ++k) text += (k == 0 ? ": " : ", ") + reasons[k];
  return text;
}

bool is_grave(const BestEffort& best_effort, std::int64_t ticks) {
  return static_cast<double>(best_effort.ticks) > grave_ticks * static_cast<double>(ticks) ||
         best_effort.largest_share > grave_error;
}

}  // namespace palpate
