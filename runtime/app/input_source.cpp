#include "runtime/app/input_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "base/private_file.h"
#include "base/program.h"
#include "runtime/app/script_device.h"
#include "runtime/devices/bridge/bridge_port.h"
#include "runtime/devices/hid/hid_choice.h"
#include "runtime/devices/hid/hid_port.h"
#include "runtime/loop/output.h"
#include "runtime/loop/replay_device.h"
#include "runtime/safety/safety.h"

namespace palpate {
namespace {

constexpr double stiffer_than_surface = 50.0;  // coupling of a mouse, relative to the surface

/// Default position of the device's origin: above the body, such that half of the workspace's radius moves
/// the tool down to it.
Vec3 place_above(const Body& body, const Tool& tool, double radius, double motion_scale) {
  constexpr double usual_radius = 0.1;  // m
  const double reach = motion_scale * (std::isfinite(radius) ? radius : usual_radius);
  const int up = body.dimension() - 1;
  Vec3 place = body.bounds().center();
  place[up] = body.bounds().max()[up] + tool.radius + 0.5 * reach;
  return place;
}

Settings settle_hand(Settings settings, const DeviceLimits& limits, const Body& body) {
  if (!settings.safety) {
    settings.safety.emplace();
    // Free vibration returns energy that would look like activity.
    if (body.swings() && body.coarse() == nullptr) settings.safety->max_damping = 0.0;
  }
  *settings.safety = limited(*settings.safety, limits);
  settings.tool.coupling_stiffness =
      std::min(settings.tool.coupling_stiffness,
               settings.safety->max_stiffness / (settings.motion_scale * settings.force_scale));
  if (!settings.origin)
    settings.origin = place_above(body, settings.tool, limits.workspace_radius, settings.motion_scale);
  return settings;
}

/// Safety options for a run without a hand: the desktop suspends programs, and a pointer rests and jumps,
/// none of which is a fault. Bodies may be as stiff as steel.
SafetyOptions safety_without_hand() {
  constexpr double no_bound = 1e99;  // the rules multiply it
  SafetyOptions safety;
  safety.max_force = safety.max_torque = no_bound;
  safety.max_force_rate = safety.max_torque_rate = no_bound;
  safety.max_stiffness = no_bound;
  safety.max_damping = 0.0;
  safety.max_speed = no_bound;
  safety.ramp = 0.0;
  safety.small_force = no_bound;
  safety.calm_time = 0.0;
  safety.deadline.tolerance = no_bound;
  safety.silence.most = no_bound;
  safety.silence.fade_from = 0.5 * no_bound;
  safety.silence.frozen = no_bound;
  safety.stale.time_to_live = no_bound;
  safety.buzz.speed = safety.buzz.force = no_bound;
  return safety;
}

Settings settle_mouse(Settings settings, const Body& body) {
  if (!settings.safety) settings.safety = safety_without_hand();
  if (std::isinf(settings.tool.coupling_stiffness))
    settings.tool.coupling_stiffness = stiffer_than_surface * surface_stiffness(body);
  return settings;
}

/// Returns the port for `hid` or `bridge`, not yet opened. Throws Error that lists the choices if the device
/// is ambiguous or unavailable.
std::unique_ptr<DevicePort> make_port(const DeviceChoice& choice, const SafetyOptions& safety,
                                      Guardian* guardian) {
  if (choice.kind == DeviceChoice::Kind::bridge) {
    return std::make_unique<BridgePort>(BridgeOptions{.socket = choice.target.empty()
                                                                    ? private_file("bridge.socket")
                                                                    : std::filesystem::path(choice.target),
                                                      .max_force = safety.max_force,
                                                      .stale = safety.stale});
  }
  std::vector<NamedProfile> profiles = known_profiles();
  if (!choice.profile.empty()) profiles = {find_profile(choice.profile)};
  return std::make_unique<HidPort>(choose_hid_device(attached_devices(), profiles, choice.target), guardian);
}

}  // namespace

InputSource make_input_source(const PlayOptions& options, Guardian* guardian) {
  using Kind = DeviceChoice::Kind;
  InputSource input;
  if (options.device.kind == Kind::script) {
    auto script = std::make_unique<ScriptDevice>(ScriptDevice::read(options.device.target));
    script->set_rate(options.settings.rate);
    for (const std::string& column : script->unread())
      say(stderr, "{}: the column {} is not read\n", options.device.target, column);
    input.ticks = script->ticks();
    input.device = std::move(script);
  } else if (options.device.kind == Kind::replay) {
    auto replay = std::make_unique<ReplayDevice>(*options.session);
    input.ticks = replay->ticks();
    input.replay = replay.get();
    input.device = std::move(replay);
  } else if (options.device.kind != Kind::mouse) {
    const SafetyOptions safety = options.settings.safety.value_or(SafetyOptions{});
    auto link = std::make_unique<DeviceLink>(
        make_port(options.device, safety, guardian),
        DeviceLinkOptions{
            .max_force = safety.max_force, .max_force_rate = safety.max_force_rate, .stale = safety.stale});
    input.link = link.get();
    input.device = std::move(link);
  }
  if (options.duration) {
    const double ticks = std::ceil(*options.duration * static_cast<double>(options.settings.rate));
    input.ticks = std::min(input.ticks, static_cast<std::int64_t>(std::min(ticks, 1e15)));
  }
  return input;
}

void add_mouse(InputSource& input, const PlayOptions& options, const Body& body) {
  const int up = body.dimension() - 1;
  PointerPose above;
  above.lifted = true;
  above.pose.position = body.bounds().center();
  above.pose.position[up] =
      body.bounds().max()[up] + options.settings.tool.radius + 0.25 * body.bounds().diagonal().norm();
  auto mouse = std::make_unique<MouseDevice>(above, options.settings.rate);
  input.mouse = mouse.get();
  input.device = std::move(mouse);
}

void wait_for(const DeviceLink& link, bool is_bridge, const std::atomic<bool>& stop) {
  using namespace std::chrono_literals;
  const auto start = std::chrono::steady_clock::now();
  bool told = false;
  std::string refusals;
  while (!link.has_reported() && !stop) {
    const auto waited = std::chrono::steady_clock::now() - start;
    if (!told && waited > 300ms) {
      say(stderr, "waiting for {}\n", link.name());
      told = true;
    }
    // Input arrives, but is invalid.
    if (refusals.empty() && !(refusals = link.refusals()).empty()) print_warning("refused: " + refusals);
    if (!is_bridge && waited > 5s) {
      throw Error("it was opened but says nothing", link.name(),
                  "plug it out and in again, see that it is calibrated and no other program uses it");
    }
    std::this_thread::sleep_for(5ms);
  }
}

Settings apply_defaults(Settings settings, const InputSource& input, const Body& body) {
  if (input.link != nullptr) return settle_hand(std::move(settings), input.link->limits(), body);
  if (input.mouse != nullptr) return settle_mouse(std::move(settings), body);
  return settings;
}

void print_device(const InputSource& input, const Settings& settings) {
  if (input.mouse != nullptr)
    say(stderr, "device: the viewer's pointer; the coupling is {:.4g} N/m\n",
        settings.tool.coupling_stiffness);
  if (input.link == nullptr) return;
  const Vec3& at = *settings.origin;
  say(stderr,
      "device: {}; its origin lies at ({:.4g}, {:.4g}, {:.4g}) m, axes along {}; motion x {:g}, force x "
      "{:g}; at most {:g} N and, by the coupling, {:g} N/m on the body's side\n",
      input.link->name(), at.x(), at.y(), at.z(), settings.axes, settings.motion_scale, settings.force_scale,
      settings.safety->max_force, settings.tool.coupling_stiffness);
}

double surface_stiffness(const Body& body) {
  constexpr std::size_t most_samples = 400;
  const std::vector<Index>& nodes = body.free_surface_nodes();
  const std::size_t stride = nodes.size() / most_samples + 1;
  std::vector<double> compliance;
  for (std::size_t k = 0; k < nodes.size(); k += stride)
    compliance.push_back(body.greens().block(nodes[k], nodes[k]).trace() / body.dimension());
  const auto middle = compliance.begin() + std::ssize(compliance) / 2;
  std::nth_element(compliance.begin(), middle, compliance.end());
  return 1.0 / *middle;
}

}  // namespace palpate
