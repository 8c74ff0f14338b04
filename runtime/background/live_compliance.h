// Compliance of a live body, renewed as it deforms and rotates.
#pragma once

#include <memory>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/live/live_model.h"
#include "runtime/live/step_compliance.h"

namespace palpate {

/// State of a live body at rest under its loads, as used by the tick.
LiveState state_at_rest(const Body& body);

/// Local model of a live body between its steps: the compliance W of one step. It starts as that of the body
/// at rest (Body::greens). Once the body has deformed, or W is found to be wrong, the tangent at the present
/// state is factorised and W computed from it in slices, one per step. The W of a body without supports is
/// rotated with it, by the rotation in its mean deformation gradient. Old ones live until the tick and all
/// displays of the surface have released them, so that the tick frees none.
class LiveCompliance {
 public:
  /// `body` must have a live one, and outlive this. Without `renews`, W stays that of the body at rest.
  LiveCompliance(const Body& body, bool renews);

  /// Resets to the body at rest.
  void rest() noexcept;
  /// Performs a slice of the work after a step that ended in `state`. `error`: error of W in that step, as a
  /// fraction of the force. Returns true if W has changed.
  bool follow(const LiveState& state, double error) noexcept;

  /// W; null for that of the body at rest.
  [[nodiscard]] const std::shared_ptr<const Greens>& renewed() const noexcept { return renewed_; }
  [[nodiscard]] const Greens& now() const noexcept {
    return renewed_ != nullptr ? *renewed_ : body_.greens();
  }
  /// Time of the body at which the tangent of W was factorised [s].
  [[nodiscard]] double factored() const noexcept { return at_.time; }
  [[nodiscard]] std::int64_t renewals() const noexcept { return renewals_; }  ///< renewals from a new factor
  [[nodiscard]] std::int64_t turns() const noexcept { return turns_; }        ///< renewals by rotation

 private:
  /// Deformation of a body.
  struct Shape {
    std::vector<Mat3> F;  // [quadrature points]
    Mat3 R = Mat3::Identity();
    double time = 0.0;
  };

  void look(const LiveState& state, Shape& shape) const;
  [[nodiscard]] double change(const Shape& from, const Shape& to) const;
  [[nodiscard]] bool is_due(double error) const;
  bool go_on(const LiveState& state, double error);
  void deliver(const PackedGreens& W, const Mat3& Q);

  const Body& body_;
  const LiveBody& live_;
  bool renews_;  // false: W is never renewed
  bool turns_with_body_;
  StepCompliance maker_;
  bool is_making_ = false;
  int steps_since_ = 0;    // steps since the last renewal of W
  Shape at_, next_, now_;  // at the factorisation of W, at that of the next W, and after the last step
  Mat3 R_delivered_ = Mat3::Identity();
  PackedGreens W_;  // factorised W; empty for that of the body at rest
  std::shared_ptr<const Greens> renewed_;
  std::vector<std::shared_ptr<const Greens>> kept_;
  std::int64_t renewals_ = 0, turns_ = 0;
};

}  // namespace palpate
