#include "precompute/progress.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/printable.h"

namespace palpate {
namespace {

constexpr double seconds_between_lines = 5.0;  // if lines cannot be rewritten ...
constexpr double share_between_lines = 0.1;    // ... and fraction of the stage's time so far
constexpr double seconds_between_rewrites = 1.0;
// Weight of the expectation against measurements, relative to all planned seconds.
constexpr double weight_of_plan = 0.01;
constexpr double measured_from = 0.1;
// A stage that is overdue is expected to take this fraction of its delay longer.
constexpr double overdue = 0.5;

/// Without stdio, whose lock a child forked at this moment would inherit.
void write_out(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Starts a thread that receives no signals: these are for the main thread, whose waits they interrupt.
template <class Work>
std::jthread without_signals(Work&& work) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::jthread thread(std::forward<Work>(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace

void TimeLeft::plan(std::vector<Stage> stages) {
  *this = TimeLeft();
  stages_ = std::move(stages);
}

void TimeLeft::expect(std::string_view stage, double seconds) {
  for (std::size_t k = under_way_ ? at_ + 1 : 0; k < stages_.size(); ++k)
    if (stages_[k].name == stage) stages_[k].seconds = seconds;
}

void TimeLeft::begin(std::string_view stage, double now) {
  const auto found = std::find_if(stages_.begin() + static_cast<std::ptrdiff_t>(at_), stages_.end(),
                                  [&](const Stage& planned) { return planned.name == stage; });
  if (found == stages_.end()) return;
  const auto next = static_cast<std::size_t>(found - stages_.begin());
  if (under_way_ && next > at_) {
    expected_ += stages_[at_].seconds;
    spent_ += now - begun_;
  }
  at_ = next;
  under_way_ = true;
  begun_ = reported_ = now;
  share_ = 0.0;
}

void TimeLeft::reach(double share, double now) {
  share_ = std::clamp(share, 0.0, 1.0);
  reported_ = now;
}

double TimeLeft::planned() const noexcept {
  double sum = 0.0;
  for (const Stage& stage : stages_) sum += stage.seconds;
  return sum;
}

bool TimeLeft::measured() const noexcept {
  if (!known()) return false;
  return expected_ + share_ * stages_[at_].seconds >= measured_from * planned();
}

double TimeLeft::slowness() const noexcept {
  const double weight = weight_of_plan * planned();
  const double done = expected_ + share_ * stages_[at_].seconds;
  const double took = spent_ + (share_ > 0.0 ? reported_ - begun_ : 0.0);
  return weight + done > 0.0 ? (weight + took) / (weight + done) : 1.0;
}

double TimeLeft::seconds(double now) const noexcept {
  if (!known()) return 0.0;
  const Stage& stage = stages_[at_];
  const double slow = slowness();
  // For the current stage its own progress says most: rates of stages differ.
  const double weight = weight_of_plan * stage.seconds;
  const double pace = weight + share_ * stage.seconds > 0.0 && share_ > 0.0
                          ? (weight * slow + reported_ - begun_) / (weight + share_ * stage.seconds)
                          : slow;
  const double silent = under_way_ ? now - reported_ : 0.0;
  const double rest = pace * (1.0 - share_) * stage.seconds - silent;
  double left = rest >= 0.0 || share_ >= 1.0 ? std::max(rest, 0.0) : -overdue * rest;
  for (std::size_t k = at_ + 1; k < stages_.size(); ++k) left += slow * stages_[k].seconds;
  return left;
}

std::string duration_text(double seconds) {
  const auto upwards = [&](long long unit) {
    return unit * static_cast<long long>(std::ceil(seconds / static_cast<double>(unit)));
  };
  if (upwards(1) < 60) return fmt::format("{} s", upwards(1));
  const long long tens = upwards(10), minutes = upwards(60) / 60;
  if (tens < 600 && tens % 60 != 0) return fmt::format("{} min {} s", tens / 60, tens % 60);
  if (minutes < 60) return fmt::format("{} min", minutes);
  return fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

Progress::Progress(bool prints) : prints_(prints), terminal_(isatty(STDERR_FILENO) != 0) {
  ticker_ = without_signals([this](const std::stop_token& stop) { tick(stop); });
}

Progress::~Progress() {
  ticker_.request_stop();
  ticker_.join();
  end_stage();
}

double Progress::now() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Progress::print(const std::string& text) const {
  if (prints_) write_out(text);
}

void Progress::line(const std::string& text) {
  const std::scoped_lock lock(mutex_);
  end_stage();
  write_line(text);
}

void Progress::warn(const std::string& text) {
  const std::scoped_lock lock(mutex_);
  end_stage();
  print("\nwarning: " + printable_lines(text) + "\n\n");
}

void Progress::plan(std::vector<Stage> stages) {
  const std::scoped_lock lock(mutex_);
  time_left_.plan(std::move(stages));
}

void Progress::expect(std::string_view stage, double seconds) {
  const std::scoped_lock lock(mutex_);
  time_left_.expect(stage, seconds);
}

void Progress::begin(const std::string& stage) {
  const std::scoped_lock lock(mutex_);
  end_stage();
  stage_ = stage;
  begun_ = now();
  time_left_.begin(stage, begun_);
  show(time_left_.known() ? stage_text() : stage);
}

void Progress::reach(double share) {
  const std::scoped_lock lock(mutex_);
  share_ = share;
  time_left_.reach(share, now());
}

void Progress::end() {
  const std::scoped_lock lock(mutex_);
  end_stage();
}

std::vector<Stage> Progress::stages() {
  const std::scoped_lock lock(mutex_);
  return over_;
}

std::string Progress::stage_text() const {
  std::string text = stage_;
  if (share_ >= 0.0) text += fmt::format(": {} %", static_cast<int>(100.0 * share_));
  if (!time_left_.known()) return text + ", time left not known yet";
  return text + fmt::format(", {}{} left", time_left_.measured() ? "" : "about ",
                            duration_text(time_left_.seconds(now())));
}

void Progress::write_line(const std::string& text) {
  shown_ = now();
  print(fmt::format("{}[{:7.1f} s] {}\n", line_open_ ? "\r\033[K" : "", shown_, printable_lines(text)));
  line_open_ = false;
}

void Progress::show(const std::string& text) {
  if (!terminal_) {
    write_line(text);
    return;
  }
  shown_ = now();
  print(fmt::format("\r\033[K[{:7.1f} s] {}", shown_, printable(text)));
  line_open_ = true;
}

void Progress::end_stage() {
  const bool said_share = share_ >= 0.0;
  if (line_open_ || said_share)
    write_line(said_share ? fmt::format("{}: {} %", stage_, static_cast<int>(100.0 * share_)) : stage_);
  if (!stage_.empty()) over_.push_back({stage_, now() - begun_});
  stage_.clear();
  share_ = -1.0;
}

double Progress::next_showing() const {
  if (terminal_) return shown_ + seconds_between_rewrites;
  return shown_ + std::max(seconds_between_lines, share_between_lines * (shown_ - begun_));
}

void Progress::tick(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const double wait = stage_.empty() ? seconds_between_rewrites : std::max(0.0, next_showing() - now());
    wake_.wait_for(lock, stop, std::chrono::duration<double>(wait), [] { return false; });
    if (!stop.stop_requested() && !stage_.empty() && now() >= next_showing()) show(stage_text());
  }
}

Waiting::Waiting(std::string what, std::chrono::milliseconds silence)
    : teller_(without_signals([what = std::move(what), silence](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any wake;
        std::unique_lock lock(mutex);
        if (wake.wait_for(lock, stop, silence, [&] { return stop.stop_requested(); })) return;
        Progress progress;
        progress.begin(what);
        wake.wait(lock, stop, [] { return false; });
      })) {}

}  // namespace palpate
