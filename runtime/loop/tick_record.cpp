#include "runtime/loop/tick_record.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/body/patch_maker.h"

namespace palpate {
namespace {

constexpr double largest_float = std::numeric_limits<float>::max();

}  // namespace

void set(double (&vector)[3], const Vec3& value) noexcept {
  std::copy_n(value.data(), 3, vector);
}

void set(double (&wxyz)[4], const Eigen::Quaterniond& value) noexcept {
  const std::array<double, 4> numbers = {value.w(), value.x(), value.y(), value.z()};
  std::copy(numbers.begin(), numbers.end(), wxyz);
}

void set(double (&symmetric)[6], const Eigen::Matrix3d& value) noexcept {
  const std::array<double, 6> numbers = {value(0, 0), value(1, 1), value(2, 2),
                                         value(0, 1), value(1, 2), value(2, 0)};
  std::copy(numbers.begin(), numbers.end(), symmetric);
}

void record_tool(TickRecord& record, const Body& body, const State& state, const ToolState& tool,
                 const ToolPose& wanted, Index centre) noexcept {
  set(record.device_position, wanted.position);
  set(record.device_orientation, wanted.orientation);
  record.grab = wanted.grab ? 1 : 0;
  set(record.tool_position, tool.pose.position);
  set(record.tool_orientation, tool.pose.orientation);
  set(record.force, -tool.wrench.force);
  set(record.torque, -tool.wrench.torque);
  set(record.stiffness, tool.local.stiffness);
  record.contacts = tool.contacts;
  record.status = static_cast<std::uint32_t>(state.status);
  if (centre >= 0) record.patch = recorded_centre(body, centre);
  record.motion_step = state.surface.motion.sample_step();
  record.force_error = static_cast<float>(std::min<double>(tool.force_error, largest_float));
  record.left_out = tool.left_out;
  record.small_strain = static_cast<float>(
      std::clamp<double>(state.surface.motion.small_strain(), -largest_float, largest_float));
  record.greens_error = static_cast<float>(std::min<double>(tool.greens_error, largest_float));
}

}  // namespace palpate
