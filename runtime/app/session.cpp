#include "runtime/app/session.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/json_text.h"
#include "base/program.h"
#include "base/write_file.h"
#include "runtime/app/best_effort_report.h"
#include "runtime/loop/output.h"
#include "runtime/loop/session_check.h"

namespace palpate {
namespace {

constexpr double second = 1e9;  // ns

/// Formats "a=1\nb=2\n" as "a=1, b=2".
std::string in_one_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at))
    text.replace(at, 1, ", ");
  return text.empty() ? "none" : text;
}

std::string faults_text(const SessionSummary& summary) {
  std::string text;
  for (const SessionFault& fault : summary.faults)
    text += fmt::format("{}{} at {:.3f} s", text.empty() ? "" : ", ",
                        fault_names[static_cast<std::size_t>(fault.fault)].second, fault.time);
  return text.empty() ? "none" : text;
}

std::string status_text(const SessionSummary& summary) {
  std::string text;
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (summary.status_ticks[k] > 0)
      text += fmt::format("{}{} in {} ticks", text.empty() ? "" : ", ", status_names[k].second,
                          summary.status_ticks[k]);
  }
  return text.empty() ? "none" : text;
}

/// End of a recording.
enum class Ending { finished, killed, finished_now, going_on };

constexpr std::string_view ending_names[] = {"finished", "killed: --finish adds its index",
                                             "killed, has its index now", "being recorded"};

Ending ending_of(const RecordingFile& recording, bool finish) {
  if (recording.finished()) return Ending::finished;
  if (finish) return finish_recording(recording.path()) ? Ending::finished_now : Ending::going_on;
  return is_being_recorded(recording.path()) ? Ending::going_on : Ending::killed;
}

void print_text(const RecordingFile& recording, const SessionSummary& s, Ending ending) {
  const SessionInfo& info = recording.info();
  const std::size_t pictures = recording.pictures().size();
  say(stdout, "{}: {}, by {}\n", recording.path(), ending_names[static_cast<int>(ending)],
      recording.generator());
  say(stdout, "model            {} ({})\n", info.model_path, info.content_hash);
  say(stdout, "device           {}\n", info.device.empty() ? "unknown" : info.device);
  say(stdout, "options          {}\n", in_one_line(info.options));
  say(stdout, "ticks            {} at {} a second: {:.3f} s, {} missing\n", s.ticks, info.rate, s.seconds,
      s.missing);
  say(stdout, "in contact       {} ticks, {:.3f} s\n", s.in_contact,
      static_cast<double>(s.in_contact) / static_cast<double>(info.rate));
  say(stdout, "largest force    {:.6g} N at {:.3f} s\n", s.largest_force, s.largest_force_time);
  say(stdout, "largest shown    {:.6g} N at {:.3f} s\n", s.largest_shown, s.largest_shown_time);
  if (s.compute.worst() == 0) {
    say(stdout, "step             not timed, as the run had no clock (--fast)\n");
  } else {
    say(stdout, "step             median {:.2f} us, 99.9 % {:.2f} us, worst {:.2f} us\n",
        microseconds(s.compute.percentile(0.5)), microseconds(s.compute.percentile(0.999)),
        microseconds(s.compute.worst()));
    say(stdout, "deadline misses  {}, at most {:.1f} us late\n", s.deadline_misses,
        microseconds(s.worst_lateness));
  }
  say(stdout, "faults           {}\n", faults_text(s));
  say(stdout, "status           {}\n", status_text(s));
  if (s.best_effort.ticks > 0) say(stdout, "best effort      {}\n", in_words(s.best_effort, s.ticks));
  if (pictures == 0) {
    say(stdout, "pictures         none\n");
  } else {
    say(stdout, "pictures         {} of {} surface nodes, {}\n", pictures, recording.surface().nodes.size(),
        recording.stores_pictures() ? "stored" : "computed by the model");
  }
}

void print_json(const RecordingFile& recording, const SessionSummary& s, Ending ending) {
  auto faults = nlohmann::ordered_json::array();
  for (const SessionFault& fault : s.faults)
    faults.push_back(
        {{"fault", fault_names[static_cast<std::size_t>(fault.fault)].second}, {"time_s", fault.time}});
  nlohmann::ordered_json status;
  for (std::size_t k = 0; k < status_names.size(); ++k) status[status_names[k].second] = s.status_ticks[k];
  const SessionInfo& info = recording.info();
  const bool was_killed = ending == Ending::killed || ending == Ending::finished_now;
  const nlohmann::ordered_json json = {{"recording", recording.path().string()},
                                       {"generator", recording.generator()},
                                       {"was_killed", was_killed},
                                       {"going_on", ending == Ending::going_on},
                                       {"model", info.model_path},
                                       {"content_hash", info.content_hash},
                                       {"device", info.device},
                                       {"options", info.options},
                                       {"rate", info.rate},
                                       {"ticks", s.ticks},
                                       {"missing_ticks", s.missing},
                                       {"seconds", s.seconds},
                                       {"ticks_in_contact", s.in_contact},
                                       {"largest_force_N", s.largest_force},
                                       {"largest_force_time_s", s.largest_force_time},
                                       {"largest_shown_force_N", s.largest_shown},
                                       {"largest_shown_force_time_s", s.largest_shown_time},
                                       {"compute_ns",
                                        {{"median", s.compute.percentile(0.5)},
                                         {"p99_9", s.compute.percentile(0.999)},
                                         {"worst", s.compute.worst()}}},
                                       {"deadline_misses", s.deadline_misses},
                                       {"worst_lateness_ns", s.worst_lateness},
                                       {"faults", faults},
                                       {"status_ticks", status},
                                       {"best_effort", to_json(s.best_effort)},
                                       {"pictures", recording.pictures().size()},
                                       {"stores_pictures", recording.stores_pictures()},
                                       {"surface_nodes", recording.surface().nodes.size()}};
  std::fputs(json_text(json, 2).c_str(), stdout);
}

}  // namespace

void Summarising::add(const TickRecord& tick) {
  const auto k = std::llround(tick.time * rate_);
  const auto due = [&](std::int64_t number) {
    return std::llround(static_cast<double>(number) / rate_ * second);
  };
  if (summary_.ticks == 0) first_ = k;
  ++summary_.ticks;
  summary_.missing = k - first_ + 1 - summary_.ticks;
  summary_.seconds = static_cast<double>(k - first_ + 1) / rate_;
  if (tick.contacts > 0) ++summary_.in_contact;
  for (std::size_t bit = 0; bit < status_names.size(); ++bit) {
    if (has(static_cast<StepStatus>(tick.status), status_names[bit].first)) ++summary_.status_ticks[bit];
  }
  const double force = Vec3(tick.force).stableNorm(), shown = Vec3(tick.shown_force).stableNorm();
  summary_.best_effort.add(static_cast<StepStatus>(tick.status), force, tick.force_error, tick.left_out,
                           tick.time);
  note_largest(force, tick.time, summary_.largest_force, summary_.largest_force_time);
  note_largest(shown, tick.time, summary_.largest_shown, summary_.largest_shown_time);
  summary_.worst_lateness = std::max<std::int64_t>(summary_.worst_lateness, tick.begun_ns - due(k));
  if (tick.begun_ns + tick.compute_ns > due(k + 1)) ++summary_.deadline_misses;
  summary_.compute.add(tick.compute_ns);
  if (tick.fault != fault_ && tick.fault != 0)
    summary_.faults.push_back({static_cast<Fault>(tick.fault), tick.time});
  fault_ = tick.fault;
}

int session(const std::filesystem::path& file, bool json, bool finish) {
  const RecordingFile recording = open_session(link_target(file));
  Summarising sums(recording.info().rate);
  for (std::int64_t row = 0; row < recording.ticks(); ++row) sums.add(recording.tick(row));
  const Ending ending = ending_of(recording, finish);
  if (json) {
    print_json(recording, sums.summary(), ending);
  } else {
    print_text(recording, sums.summary(), ending);
  }
  return exit_ok;
}

}  // namespace palpate
