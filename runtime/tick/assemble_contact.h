// From contact points to the contact problem.
#pragma once

#include <array>

#include "runtime/body/body.h"

namespace palpate {

struct State;

/// One row of J: a force of 1 along it puts -body[n] on the near node at places[n], and `force` and `moment`
/// about its origin on the tool.
struct ContactRow {
  std::array<Index, 3> places{-1, -1, -1};                             ///< in State::near, -1 for none
  std::array<Vec3, 3> body{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< zero where there is no node
  Index tool = -1;                                                     ///< -1: the row does not act on a tool
  Vec3 force = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  ///< [m]
};

/// Fills state.problem and state.rows for state.contact_points: W = J Xi J^T + what the couplings give way, b
/// the motion along the rows when the tools go to where the devices want them and the body goes to rest, and
/// as a guess the forces of the same contacts in the tick before.
///
/// After the rows of all contacts come those of the tilt of edges and faces that carried force. Contact with
/// a straight edge or flat face under a tool of radius R is nonlinear in its slope s along the surface: the
/// gap loses R s^2 / 2. That is a spring of stiffness lambda_n R against tilting further in this tick, the
/// positive part of Newton's geometric stiffness; without it ticks overshoot and the contact buzzes. It
/// vanishes when nothing moves, so the answer is not changed.
void assemble_contact(const Body& body, State& state) noexcept;

}  // namespace palpate
