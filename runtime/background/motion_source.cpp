#include "runtime/background/motion_source.h"

#include <algorithm>
#include <chrono>

namespace palpate {
namespace {

constexpr auto pause = std::chrono::microseconds(50);
constexpr auto long_pause = std::chrono::milliseconds(1);  // while nothing moves
constexpr int patience = 2000;                             // pauses until then

int processors_beside_the_tick() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()) - 1);
}

}  // namespace

MotionSource::MotionSource(const Body& body, const State& state, const MotionSourceOptions& options)
    : body_(body),
      newmark_(body.model().dynamics, options.jobs > 0 ? options.jobs : processors_beside_the_tick()),
      in_background_(options.in_background),
      jobs_(state.surface.motion.job()),
      samples_(MotionSample{.u = std::vector<double>(static_cast<std::size_t>(body.greens().order()))}),
      f_(body.greens().order()),
      u_(f_.size()),
      v_(f_.size()) {
  newmark_.predict();  // reads the matrix once
  if (in_background_) worker_ = std::thread([this] { work(); });
}

MotionSource::~MotionSource() {
  stop_ = true;
  if (worker_.joinable()) worker_.join();
}

void MotionSource::receive(State& state, std::int64_t step) noexcept {
  if (state.surface.motion.sample_step() < step) receive(state);
}

void MotionSource::receive(State& state) noexcept {
  if (!state.surface.motion.active()) return;
  if (!in_background_ && state.surface.motion.job().step != done_) do_job(state.surface.motion.job());
  state.surface.motion.receive(samples_.read());
}

void MotionSource::post(const State& state) noexcept {
  if (!in_background_ || !state.surface.motion.active()) return;
  jobs_.next() = state.surface.motion.job();
  jobs_.publish();
}

void MotionSource::work() noexcept {
  int pauses = 0;
  while (!stop_) {
    const MotionJob& job = jobs_.read();
    if (job.step != done_) {
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

/// Ends the step that was predicted last and predicts the next one.
void MotionSource::do_job(const MotionJob& job) noexcept {
  const auto begin = std::chrono::steady_clock::now();
  if (job.step < done_) {  // the state was set back
    newmark_.rest();
    let_go_done_ = 0;
  }
  done_ = job.step;
  if (job.load.empty()) {
    newmark_.advance();
  } else {
    body_.greens().displacement(job.load.nodes(), job.load.forces(), u_);
    touched_.clear();
    for (const Index node : job.load.nodes()) {
      for (std::int64_t axis = 0; axis < body_.dimension(); ++axis)
        touched_.push_back(std::int64_t{body_.dimension()} * node + axis);
    }
    newmark_.advance(u_, touched_);
  }
  if (job.left < 1.0) newmark_.damp(job.left);
  if (job.let_go != let_go_done_) let_go(job.release);
  let_go_done_ = job.let_go;
  newmark_.predict();
  MotionSample& sample = samples_.next();
  sample.step = job.step;
  sample.let_go = job.let_go;
  std::copy(newmark_.predicted().begin(), newmark_.predicted().end(), sample.u.begin());
  samples_.publish();
  ++steps_;
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  longest_ = std::max(longest_.load(), taken.count());
}

void MotionSource::let_go(const LetGo& release) noexcept {
  std::fill(f_.begin(), f_.end(), 0.0);
  const auto d = static_cast<std::size_t>(body_.dimension());
  const std::span<const double> forces = release.force.forces();
  for (std::size_t k = 0; k < forces.size(); ++k)
    f_[d * static_cast<std::size_t>(release.force.nodes()[k / d]) + k % d] += forces[k];
  body_.greens().displacement(release.force.nodes(), release.force.forces(), u_);
  body_.greens().displacement(release.rate.nodes(), release.rate.forces(), v_);
  newmark_.let_go(f_, u_, v_);
}

}  // namespace palpate
