// Time integrators of live bodies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

enum class Integrator : std::uint8_t {
  semi_implicit_euler,  ///< explicit: velocity first, then position by the new velocity
  implicit_euler,       ///< damps motion faster than its step
  midpoint,             ///< implicit; keeps energy, momentum and angular momentum
};

/// The names that users give: semi-implicit-euler, implicit-euler, midpoint.
constexpr const char* name_of(Integrator integrator) noexcept {
  constexpr std::array<const char*, 3> names = {"semi-implicit-euler", "implicit-euler", "midpoint"};
  return names[static_cast<std::size_t>(integrator)];
}

constexpr bool is_implicit(Integrator integrator) noexcept {
  return integrator != Integrator::semi_implicit_euler;
}

}  // namespace palpate
