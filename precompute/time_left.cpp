#include "precompute/time_left.h"

#include <algorithm>

namespace palpate {
namespace {

// Weight of the expectation against measurements, relative to all planned seconds.
constexpr double weight_of_plan = 0.01;
constexpr double measured_from = 0.1;
// A stage that is overdue is expected to take this fraction of its delay longer.
constexpr double overdue = 0.5;

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

}  // namespace palpate
