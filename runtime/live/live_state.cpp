#include "runtime/live/live_state.h"

namespace palpate {

LiveState::LiveState(const LiveBody& body) : x(body.start()), v(Eigen::VectorXd::Zero(body.dofs())) {
  if (body.options().plasticity.flows())
    plastic.assign(static_cast<std::size_t>(body.all_points()), Mat3::Zero());
}

}  // namespace palpate
