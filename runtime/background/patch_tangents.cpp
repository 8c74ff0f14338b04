#include "runtime/background/patch_tangents.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace palpate {
namespace {

// One step: it ends where the tick's contact, by the last tangent, has the surface. Further steps under
// constant forces lead away from a steady contact, whose forces would not stay constant.
constexpr PatchEffort patch_effort{.tolerance = 1e-8, .most_steps = 1};
constexpr double no_change = 1e-6;  // change of forces; the tangent's error is its square

}  // namespace

void PatchLoad::add(Index surface_node, const Vec3& force) noexcept {
  if (count == nodes.size()) return;
  nodes[count] = surface_node;
  forces[count++] = force;
}

bool PatchTangents::follow(const PatchLoad& load) noexcept {
  try {
    if (load.key.empty() || load.count == 0) {
      if (law_ == nullptr) return false;
      law_ = nullptr;
      take(nullptr);
      return true;
    }
    if (load.by != patch_.get() && patch_ != nullptr && load.key == key_) return false;
    if (is_settled(load)) return false;
    make(load);
  } catch (const std::exception&) {  // out of memory or too flat elements: the tick continues without
    is_balanced_ = true;             // no second try for these forces
    patch_ = nullptr;
    const std::lock_guard lock(mutex_);
    ++telling_.failed;
  }
  return true;
}

bool PatchTangents::is_settled(const PatchLoad& load) const noexcept {
  if (!is_balanced_ || !(load.key == key_) || !std::ranges::equal(load.loaded(), nodes_)) return false;
  double changed = 0.0, largest = 0.0;
  for (std::size_t k = 0; k < load.count; ++k) {
    changed = std::max(changed, (load.forces[k] - forces_[k]).squaredNorm());
    largest = std::max(largest, load.forces[k].squaredNorm());
  }
  return changed <= no_change * no_change * largest;
}

void PatchTangents::make(const PatchLoad& load) {
  const auto begin = std::chrono::steady_clock::now();
  nodes_.assign(load.loaded().begin(), load.loaded().end());
  forces_.assign(load.applied().begin(), load.applied().end());
  if (law_ == nullptr || !(load.key == key_)) {
    key_ = load.key;
    patch_ = nullptr;
    law_ = std::make_unique<HyperelasticPatch>(
        body_, maker_.mesh({key_.centres.data(), static_cast<std::size_t>(key_.count())}));
  }
  const PatchBalance report = law_->find(nodes_, forces_, patch_effort);
  std::shared_ptr<const Patch> patch = law_->linearise();
  is_balanced_ = report.converged || patch == nullptr;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  {
    const std::lock_guard lock(mutex_);
    telling_.made += patch != nullptr ? 1 : 0;
    telling_.failed += patch == nullptr ? 1 : 0;
    telling_.cuts += report.cuts;
    telling_.with_inverted += report.inverted > 0 ? 1 : 0;
    telling_.most_inverted = std::max(telling_.most_inverted, report.inverted);
    telling_.last_residual = report.residual;
    telling_.longest = std::max(telling_.longest, took.count());
  }
  if (patch != nullptr) take(std::move(patch));
}

void PatchTangents::take(std::shared_ptr<const Patch> patch) {
  std::erase_if(kept_, [](const auto& old) { return old.use_count() == 1; });
  patch_ = std::move(patch);
  if (patch_ != nullptr) kept_.push_back(patch_);
}

PatchTangentTelling PatchTangents::telling() const {
  const std::lock_guard lock(mutex_);
  return telling_;
}

}  // namespace palpate
