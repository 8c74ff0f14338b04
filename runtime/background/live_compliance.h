// The compliance of a live body, renewed as it deforms and turns.
#pragma once

#include <memory>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/live/live_model.h"
#include "runtime/live/step_compliance.h"

namespace palpate {

/// A live body at rest as the tick has it: under its loads.
LiveState state_at_rest(const Body& body);

/// What ticks have of a live body between its steps: the compliance W of one step. It begins as that of the
/// body at rest (Body::greens). Where the body has deformed, or W is found to be wrong, the tangent where the
/// body is then is factored, and W found from it in slices, one a step. A body that nothing holds takes W
/// with it as it turns, by the rotation in its mean deformation gradient. Old ones live on until the tick and
/// whoever shows the surface have let go of them: none is freed by a tick.
class LiveCompliance {
 public:
  /// `body` must have a live one, and live as long. Without `renews`, W stays that of the body at rest.
  LiveCompliance(const Body& body, bool renews);

  /// Back to the body at rest.
  void rest() noexcept;
  /// After a step that ended in `state`: does a slice of the work. `error`: by how much W was wrong in it, as
  /// a share of the force. True where W is another now.
  bool follow(const LiveState& state, double error) noexcept;

  /// W; null for that of the body at rest.
  [[nodiscard]] const std::shared_ptr<const Greens>& renewed() const noexcept { return renewed_; }
  [[nodiscard]] const Greens& now() const noexcept {
    return renewed_ != nullptr ? *renewed_ : body_.greens();
  }
  /// The body's time when the tangent of W was factored [s].
  [[nodiscard]] double factored() const noexcept { return at_.time; }
  [[nodiscard]] std::int64_t renewals() const noexcept { return renewals_; }  ///< factored ones that came
  [[nodiscard]] std::int64_t turns() const noexcept { return turns_; }        ///< turned ones

 private:
  /// How a body is deformed.
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
  bool renews_;  // else W stays as it is
  bool turns_with_body_;
  StepCompliance maker_;
  bool is_making_ = false;
  int steps_since_ = 0;    // W came last
  Shape at_, next_, now_;  // where W was factored, where the one in the making, after the last step
  Mat3 R_delivered_ = Mat3::Identity();
  PackedGreens W_;  // as it was factored; empty for that of the body at rest
  std::shared_ptr<const Greens> renewed_;
  std::vector<std::shared_ptr<const Greens>> kept_;
  std::int64_t renewals_ = 0, turns_ = 0;
};

}  // namespace palpate
