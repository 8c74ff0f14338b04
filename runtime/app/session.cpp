#include "runtime/app/session.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "base/write_file.h"
#include "runtime/app/best_effort_report.h"
#include "runtime/loop/output.h"
#include "runtime/loop/session_check.h"
#include "runtime/loop/session_xdmf.h"

namespace palpate {
namespace {

constexpr double second = 1e9;  // ns

double length(const double (&v)[3]) {
  return std::hypot(v[0], v[1], v[2]);
}

void note_largest(double value, double time, double& largest, double& largest_time) {
  if (!(value > largest)) return;
  largest = value;
  largest_time = time;
}

std::string fault_name(Fault fault) {
  for (const auto& [known, name] : fault_names)
    if (known == fault) return name;
  return fmt::format("fault {}", static_cast<int>(fault));
}

/// "a=1\nb=2\n" as "a=1, b=2".
std::string in_one_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at))
    text.replace(at, 1, ", ");
  return text.empty() ? "none" : text;
}

std::string faults_text(const SessionSummary& summary) {
  std::string text;
  for (const SessionFault& fault : summary.faults)
    text += fmt::format("{}{} at {:.3f} s", text.empty() ? "" : ", ", fault_name(fault.fault), fault.time);
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

/// How it ended.
enum class Ending { finished, merged, going_on };

constexpr std::string_view ending_names[] = {"finished", "killed, now one file", "being recorded"};

Ending finish(const std::filesystem::path& path, const Recording& recording, bool force) {
  if (recording.finished) return Ending::finished;
  OutputPaths(force).add(xdmf_path(path), OutputKind::frames, "session");
  if (!finish_recording(path)) return Ending::going_on;
  write_xdmf(path, recording.frames);
  return Ending::merged;
}

void print_text(const std::filesystem::path& path, const Recording& recording, const SessionSummary& s,
                Ending ending) {
  const auto microseconds = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
  const SessionInfo& info = recording.info;
  const std::size_t frames = recording.frames.time.size();
  fmt::print("{}: {}, by {}\n", printable(path.string()), ending_names[static_cast<int>(ending)],
             printable(recording.generator));
  fmt::print("model            {} ({})\n", printable(info.model_path), printable(info.content_hash));
  fmt::print("device           {}\n", info.device.empty() ? "unknown" : printable(info.device));
  fmt::print("options          {}\n", printable(in_one_line(info.options)));
  fmt::print("ticks            {} at {} a second: {:.3f} s, {} missing\n", s.ticks, info.rate, s.seconds,
             s.missing);
  fmt::print("in contact       {} ticks, {:.3f} s\n", s.in_contact,
             static_cast<double>(s.in_contact) / static_cast<double>(info.rate));
  fmt::print("largest force    {:.6g} N at {:.3f} s\n", s.largest_force, s.largest_force_time);
  fmt::print("largest shown    {:.6g} N at {:.3f} s\n", s.largest_shown, s.largest_shown_time);
  fmt::print("step             median {:.2f} us, 99.9 % {:.2f} us, worst {:.2f} us\n",
             microseconds(s.compute.percentile(0.5)), microseconds(s.compute.percentile(0.999)),
             microseconds(s.compute.worst()));
  fmt::print("deadline misses  {}, at most {:.1f} us late\n", s.deadline_misses,
             microseconds(s.worst_lateness));
  fmt::print("faults           {}\n", faults_text(s));
  fmt::print("status           {}\n", status_text(s));
  if (s.best_effort.ticks > 0) fmt::print("best effort      {}\n", in_words(s.best_effort, s.ticks));
  if (frames == 0) {
    fmt::print("frames           none\n");
  } else {
    fmt::print("frames           {} of {} surface nodes; for ParaView: {}\n", frames,
               recording.frames.surface.nodes.size(),
               ending == Ending::going_on ? "not before the end" : xdmf_path(path).string());
  }
}

void print_json(const std::filesystem::path& path, const Recording& recording, const SessionSummary& s,
                Ending ending) {
  auto faults = nlohmann::ordered_json::array();
  for (const SessionFault& fault : s.faults)
    faults.push_back({{"fault", fault_name(fault.fault)}, {"time_s", fault.time}});
  nlohmann::ordered_json status;
  for (std::size_t k = 0; k < status_names.size(); ++k) status[status_names[k].second] = s.status_ticks[k];
  const SessionInfo& info = recording.info;
  const nlohmann::ordered_json json = {{"recording", path.string()},
                                       {"generator", recording.generator},
                                       {"was_killed", ending == Ending::merged},
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
                                       {"frames", recording.frames.time.size()},
                                       {"surface_nodes", recording.frames.surface.nodes.size()}};
  fmt::print("{}", json_text(json, 2));
}

}  // namespace

SessionSummary summarise(const Recording& recording) {
  SessionSummary summary;
  summary.ticks = std::ssize(recording.ticks);
  if (recording.ticks.empty()) return summary;
  const auto rate = static_cast<double>(recording.info.rate);
  const auto number = [&](const TickRecord& tick) -> std::int64_t { return std::llround(tick.time * rate); };
  const auto due = [&](std::int64_t k) -> std::int64_t {
    return std::llround(static_cast<double>(k) / rate * second);
  };
  auto fault = static_cast<std::uint8_t>(Fault::none);
  for (const TickRecord& tick : recording.ticks) {
    const std::int64_t k = number(tick);
    if (tick.contacts > 0) ++summary.in_contact;
    for (std::size_t bit = 0; bit < status_names.size(); ++bit) {
      if (has(static_cast<StepStatus>(tick.status), status_names[bit].first)) ++summary.status_ticks[bit];
    }
    summary.best_effort.add(static_cast<StepStatus>(tick.status), length(tick.force), tick.force_error,
                            tick.left_out, tick.time);
    note_largest(length(tick.force), tick.time, summary.largest_force, summary.largest_force_time);
    note_largest(length(tick.shown_force), tick.time, summary.largest_shown, summary.largest_shown_time);
    summary.worst_lateness = std::max(summary.worst_lateness, tick.begun_ns - due(k));
    if (tick.begun_ns + tick.compute_ns > due(k + 1)) ++summary.deadline_misses;
    summary.compute.add(tick.compute_ns);
    if (tick.fault != fault && tick.fault != 0)
      summary.faults.push_back({static_cast<Fault>(tick.fault), tick.time});
    fault = tick.fault;
  }
  const std::int64_t first = number(recording.ticks.front()), last = number(recording.ticks.back());
  summary.missing = last - first + 1 - summary.ticks;
  summary.seconds = static_cast<double>(last - first + 1) / rate;
  return summary;
}

int session(const std::filesystem::path& file, bool json, bool force) {
  const std::filesystem::path path = link_target(file);
  const Recording recording = read_session(path);
  const Ending ending = finish(path, recording, force);
  const SessionSummary summary = summarise(recording);
  if (json) {
    print_json(path, recording, summary, ending);
  } else {
    print_text(path, recording, summary, ending);
  }
  return exit_ok;
}

}  // namespace palpate
