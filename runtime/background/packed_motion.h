// Packed dynamics as a motion stepper.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/background/motion_stepper.h"
#include "runtime/body/body.h"
#include "runtime/body/packed_newmark.h"

namespace palpate {

/// Newmark's method with the packed inverse from the file.
class PackedMotion final : public MotionStepper {
 public:
  /// `body` must outlive this; `jobs` threads multiply. Throws Error unless the body's dynamics are packed.
  PackedMotion(const Body& body, int jobs);

  void rest() noexcept override { newmark_.rest(); }
  void do_job(const MotionJob& job, bool lets_go, std::span<double> u) noexcept override;

 private:
  void let_go(const LetGo& release) noexcept;

  const Body& body_;
  PackedNewmark newmark_;
  std::vector<double> f_, u_, v_;  // [n] workspace
  std::vector<std::int64_t> touched_;
};

}  // namespace palpate
