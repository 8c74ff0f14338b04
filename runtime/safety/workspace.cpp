#include "runtime/safety/workspace.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace palpate {
namespace {

void check_scale(double scale, const char* of) {
  if (scale > 0.0 && std::isfinite(scale)) return;
  throw Error("the scale of " + std::string(of) + " is " + std::to_string(scale), "Workspace",
              "give a positive number");
}

WorkspaceOptions checked(WorkspaceOptions options) {
  check_scale(options.motion_scale, "motion");
  check_scale(options.force_scale, "force");
  if (!options.device_origin.allFinite() || !options.body_origin.allFinite())
    throw Error("an origin is not finite", "Workspace", "give three numbers in metres");
  const double length = options.axes.norm();
  if (!(length > 0.0 && std::isfinite(length)))
    throw Error("the axes are a quaternion of length " + std::to_string(length), "Workspace",
                "give one of any other length");
  options.axes.normalize();
  return options;
}

}  // namespace

Workspace::Workspace(const WorkspaceOptions& options)
    : options_(checked(options)), axes_(options_.axes.toRotationMatrix()) {}

Vec3 Workspace::position_in_body(const Vec3& device) const noexcept {
  return options_.body_origin + options_.motion_scale * (axes_ * (device - options_.device_origin));
}

Vec3 Workspace::position_in_device(const Vec3& body) const noexcept {
  return options_.device_origin + axes_.transpose() * (body - options_.body_origin) / options_.motion_scale;
}

DeviceState Workspace::in_body(const DeviceState& device) const noexcept {
  DeviceState body = device;
  body.pose.position = position_in_body(device.pose.position);
  body.pose.orientation = options_.axes * device.pose.orientation;
  body.velocity = options_.motion_scale * (axes_ * device.velocity);
  return body;
}

DeviceCommand Workspace::in_device(const DeviceCommand& body) const noexcept {
  const double s = options_.motion_scale;
  const double c = options_.force_scale;
  DeviceCommand device;
  device.wrench.force = c * (axes_.transpose() * body.wrench.force);
  device.wrench.torque = c / s * (axes_.transpose() * body.wrench.torque);
  device.local.force = c * (axes_.transpose() * body.local.force);
  device.local.stiffness = s * c * (axes_.transpose() * body.local.stiffness * axes_);
  device.local.point = position_in_device(body.local.point);
  device.local.radius = body.local.radius / s;
  return device;
}

}  // namespace palpate
