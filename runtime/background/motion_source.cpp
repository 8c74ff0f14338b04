#include "runtime/background/motion_source.h"

#include <algorithm>
#include <chrono>

#include "runtime/background/live_motion.h"
#include "runtime/background/packed_motion.h"
#include "runtime/background/two_level_motion.h"
#include "runtime/core/tick/surface_motion.h"

namespace palpate {
namespace {

constexpr auto pause = std::chrono::microseconds(50);
constexpr auto long_pause = std::chrono::milliseconds(1);  // while nothing moves
constexpr std::size_t most_posted = 64;                    // jobs by which a replay may lag
constexpr int patience = 2000;                             // pauses until then

int processors_beside_the_tick() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) - 1);
}

std::unique_ptr<MotionStepper> make_stepper(const Body& body, int jobs) {
  if (body.live() != nullptr) return std::make_unique<LiveMotion>(body);
  if (body.contact_model() == ContactModel::two_level) return std::make_unique<TwoLevelMotion>(body);
  return std::make_unique<PackedMotion>(body, jobs);
}

/// Adds the error of the last job's forces to the tools' force_error.
void note_imbalance(State& state) noexcept {
  const double error = state.surface.motion.force_error();
  if (error == 0.0) return;
  for (ToolState& tool : state.tools) {
    if (tool.contacts == 0) continue;
    tool.force_error += error * tool.contact_wrench.force.norm();
    state.status |= StepStatus::unbalanced;
  }
}

}  // namespace

MotionSource::MotionSource(const Body& body, const State& state, const MotionSourceOptions& options)
    : body_(body),
      stepper_(make_stepper(body, options.jobs > 0 ? options.jobs : processors_beside_the_tick())),
      in_background_(options.in_background),
      jobs_(state.surface.motion.job()),
      samples_(MotionSample{.u = std::vector<double>(static_cast<std::size_t>(body.motion_size()))}),
      timely_(state.tools.size(), Vec3::Zero()) {
  if (!in_background_) posted_.assign(most_posted, state.surface.motion.job());
  for (MotionJob& none : posted_) none.step = -1;
  if (in_background_) worker_ = std::thread([this] { work(); });
}

MotionSource::~MotionSource() {
  stop_ = true;
  if (worker_.joinable()) worker_.join();
}

void MotionSource::receive(State& state, std::int64_t step) noexcept {
  if (state.surface.motion.sample_step() >= step) return;
  const auto job =
      std::find_if(posted_.begin(), posted_.end(), [&](const MotionJob& at) { return at.step == step; });
  if (job == posted_.end()) return receive(state);
  do_job(*job);
  take(state);
}

void MotionSource::receive(State& state) noexcept {
  if (!state.surface.motion.active()) return;
  if (!in_background_ && state.surface.motion.job().step != done_) do_job(state.surface.motion.job());
  take(state);
}

void MotionSource::take(State& state) noexcept {
  const MotionSample& sample = samples_.read();
  if (state.surface.motion.receive(sample))
    change_compliance(body_, state.surface, sample.compliance, sample.shift);
}

void MotionSource::note_standing_still(State& state) noexcept {
  const ContactModel contact = body_.contact_model();
  if (contact != ContactModel::live && contact != ContactModel::dynamic) return;
  const bool is_late = has(state.status, StepStatus::late_motion);
  for (std::size_t k = 0; k < timely_.size(); ++k) {
    ToolState& tool = state.tools[k];
    if (!is_late) {
      timely_[k] = tool.contact_wrench.force;
    } else if (tool.contacts > 0) {
      tool.force_error += (tool.contact_wrench.force - timely_[k]).norm();
    }
  }
}

void MotionSource::post(State& state) noexcept {
  note_standing_still(state);
  note_imbalance(state);
  const MotionJob& job = state.surface.motion.job();
  if (!state.surface.motion.active()) return;
  const bool is_new = job.step != posted_step_;
  if (!is_new && (!in_background_ || job.seen == posted_seen_)) return;
  if (in_background_) {
    jobs_.next() = job;
    jobs_.publish();
  } else {
    if (job.step < posted_step_)  // the state was reset
      for (MotionJob& old : posted_) old.step = -1;
    posted_[next_posted_] = job;
    next_posted_ = (next_posted_ + 1) % most_posted;
  }
  posted_step_ = job.step;
  posted_seen_ = job.seen;
}

void MotionSource::work() noexcept {
  int pauses = 0;
  while (!stop_) {
    const MotionJob& job = jobs_.read();
    // A sample that the tick passes over would be missing in a replay.
    const bool is_unseen = job.step > done_ && job.seen != done_;
    if (job.step != done_ && !is_unseen) {
      do_job(job);
      pauses = 0;
    } else if (pauses < patience) {
      ++pauses;
      std::this_thread::sleep_for(pause);
    } else {
      std::this_thread::sleep_for(long_pause);
    }
  }
}

void MotionSource::do_job(const MotionJob& job) noexcept {
  const auto begin = std::chrono::steady_clock::now();
  if (job.step < done_) {  // the state was reset
    stepper_->rest();
    let_go_done_ = 0;
  }
  done_ = job.step;
  MotionSample& sample = samples_.next();
  sample.step = job.step;
  sample.let_go = job.let_go;
  stepper_->do_job(job, job.let_go != let_go_done_, sample.u);
  sample.compliance = stepper_->compliance();
  sample.force_error = stepper_->force_error();
  sample.small_strain = stepper_->small_strain();
  stepper_->tell_untouched(sample.untouched);
  stepper_->tell_shift(sample.shift);
  let_go_done_ = job.let_go;
  samples_.publish();
  ++steps_;
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  longest_ = std::max(longest_.load(), taken.count());
}

}  // namespace palpate
