#include <fmt/format.h>

#include <numbers>

#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

std::optional<DynamicsMethod> read_method(const TomlTable& dynamics, Scope scope) {
  const std::string method =
      dynamics.has("method") ? dynamics.choice("method", {"auto", "packed", "modal"}) : "auto";
  if (method == "auto") {
    return std::nullopt;
  }
  if (method == "modal") {
    return DynamicsMethod::modal;
  }
  if (scope != Scope::full) {
    dynamics.fail("method",
                  "[dynamics] method \"packed\" needs every free dof, but the scope in [storage] is not full",
                  "set scope = \"full\" in [storage], or method = \"modal\"");
  }
  return DynamicsMethod::packed;
}

Newmark read_newmark(const TomlTable& dynamics) {
  Newmark newmark;
  newmark.time_step = dynamics.positive("time_step", newmark.time_step);
  newmark.alpha = dynamics.number("alpha", newmark.alpha);
  newmark.delta = dynamics.number("delta", newmark.delta);
  if (newmark.delta < 0.5) {
    dynamics.fail("delta",
                  "[dynamics] delta must be at least 0.5, not " + shown(newmark.delta) +
                      ": below, energy grows from step to step",
                  "leave it out for 0.5, which adds no damping; more than 0.5 damps high frequencies");
  }
  if (!newmark.stable()) {
    dynamics.fail(
        "alpha",
        fmt::format("[dynamics] alpha must be at least (delta + 1/2)^2 / 4 = {:.6g}, not {}: below, it is "
                    "unstable where frequencies are high",
                    newmark.least_alpha(), shown(newmark.alpha)),
        fmt::format("set alpha = {:.6g}", newmark.least_alpha()));
  }
  return newmark;
}

double not_negative(const TomlTable& damping, std::string_view key) {
  const double value = damping.number(key, 0.0);
  if (value < 0.0) {
    damping.fail(key, damping.name_of(key) + " must be 0 or more, not " + shown(value),
                 "negative damping lets oscillations grow");
  }
  return value;
}

Rayleigh read_ratios(const TomlTable& damping) {
  const std::vector<double> ratios = damping.numbers("ratios", 2), f = damping.numbers("frequencies", 2);
  if (ratios[0] < 0.0 || ratios[1] < 0.0) {
    damping.fail(
        "ratios",
        damping.name_of("ratios") + " must be 0 or more, not " + shown(std::min(ratios[0], ratios[1])),
        "0 is undamped, 1 is critical");
  }
  if (!(f[0] > 0.0) || !(f[1] > 0.0)) {
    damping.fail(
        "frequencies",
        damping.name_of("frequencies") + " must be greater than 0, not " + shown(std::min(f[0], f[1])),
        "give two frequencies in Hz");
  }
  if (f[0] == f[1]) {
    damping.fail("frequencies", damping.name_of("frequencies") + " are equal: " + shown(f[0]),
                 "give two different frequencies in Hz, or damping = {mass = ...} or {stiffness = ...}");
  }
  constexpr double turn = 2.0 * std::numbers::pi;
  const Rayleigh result = rayleigh_damping(turn * f[0], ratios[0], turn * f[1], ratios[1]);
  for (const auto& [name, value] :
       {std::pair{"mass", result.mass}, std::pair{"stiffness", result.stiffness}}) {
    if (value < 0.0) {
      damping.fail("ratios",
                   fmt::format("{}: {} at {} Hz and {} at {} Hz give {} = {:.4g}, negative damping",
                               damping.name_of("ratios"), shown(ratios[0]), shown(f[0]), shown(ratios[1]),
                               shown(f[1]), name, value),
                   "bring the ratios or the frequencies nearer to each other");
    }
  }
  return result;
}

Rayleigh read_damping(const TomlTable& dynamics) {
  const TomlTable damping = dynamics.table("damping", keys_of("[dynamics] damping"));
  const bool by_ratios = damping.has("ratios") || damping.has("frequencies");
  if (!by_ratios) {
    return {.mass = not_negative(damping, "mass"), .stiffness = not_negative(damping, "stiffness")};
  }
  for (const std::string_view key : {"mass", "stiffness"}) {
    if (damping.has(key)) {
      damping.fail(key, damping.name_of(key) + " is given beside ratios and frequencies, which decide it",
                   "give {mass, stiffness} or {ratios, frequencies}");
    }
  }
  return read_ratios(damping);
}

}  // namespace

DynamicsOptions read_dynamics(const TomlTable& dynamics, Scope scope) {
  DynamicsOptions result;
  result.method = read_method(dynamics, scope);
  result.newmark = read_newmark(dynamics);
  result.lumped = dynamics.has("mass") && dynamics.choice("mass", {"consistent", "lumped"}) == "lumped";
  if (dynamics.has("damping")) {
    result.damping = read_damping(dynamics);
  }
  if (dynamics.has("modes")) {
    if (result.method == DynamicsMethod::packed) {
      dynamics.fail("modes", "[dynamics] modes applies to method \"modal\" only",
                    "remove modes, or set method = \"modal\"");
    }
    result.modes = dynamics.count("modes");
  }
  result.place = dynamics.place_of(dynamics.has("modes") ? "modes" : "");
  return result;
}

}  // namespace palpate
