#include "runtime/background/packed_motion.h"

#include <algorithm>

namespace palpate {

PackedMotion::PackedMotion(const Body& body, int jobs)
    : body_(body),
      newmark_(body.model().dynamics, jobs),
      f_(body.greens().order()),
      u_(f_.size()),
      v_(f_.size()) {
  newmark_.predict();  // reads the matrix once
}

void PackedMotion::do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept {
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
  if (lets_go) let_go(job.release);
  newmark_.predict();
  std::copy(newmark_.predicted().begin(), newmark_.predicted().end(), u.begin());
}

void PackedMotion::let_go(const LetGo& release) noexcept {
  std::fill(f_.begin(), f_.end(), 0.0);
  const auto d = static_cast<std::size_t>(body_.dimension());
  const std::span<const double> forces = release.force.forces();
  for (std::size_t k = 0; k < forces.size(); ++k)
    f_[d * static_cast<std::size_t>(release.force.nodes()[k / d]) + k % d] += forces[k];
  body_.greens().displacement(release.force.nodes(), release.force.forces(), u_);
  body_.greens().displacement(release.rate.nodes(), release.rate.forces(), v_);
  const double share = velocity_share(newmark_.kinetic_energy(v_), release.energy);
  for (double& v : v_) v *= share;
  newmark_.let_go(f_, u_, v_);
}

}  // namespace palpate
