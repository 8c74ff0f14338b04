#include "runtime/live/plastic_flow.h"

#include <cmath>

#include "statics/live_forces.h"

namespace palpate {

FlowSums flow(const LiveBody& body, const Eigen::VectorXd& x, double time, std::span<Mat3> plastic) {
  const Plasticity& rule = body.options().plasticity;
  const double share = -std::expm1(-rule.creep * time);
  FlowSums sums;
  for (Index point = 0; point < body.all_points(); ++point) {
    const Index element = point / body.points();
    const LawConstants& c = body.constants(element);
    const Mat3 elastic = rotated_strain(body.options().law, c, deformation_gradient(body, x, point)) -
                         body.initial_strain(element) - plastic[point];
    const double size = elastic.norm();
    if (!(size > rule.yield)) continue;
    ++sums.flowing;
    Mat3 grown = plastic[point] + share * (size - rule.yield) / size * elastic;
    const double total = grown.norm();
    if (total > rule.maximum) grown *= rule.maximum / total;
    const Mat3 change = grown - plastic[point];
    const Mat3 between = elastic - 0.5 * change;
    sums.work += body.weight(point) * (c.lambda * between.trace() * change.trace() +
                                       2.0 * c.mu * between.cwiseProduct(change).sum());
    plastic[point] = grown;
  }
  return sums;
}

}  // namespace palpate
