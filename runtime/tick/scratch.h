// The workspace of a tick.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/solve/active_set.h"
#include "runtime/solve/cone_solver.h"
#include "runtime/solve/contact_problem.h"
#include "runtime/solve/imbalance.h"
#include "runtime/solve/newton_krylov.h"
#include "runtime/tick/compliance.h"
#include "runtime/tick/greens_error.h"
#include "runtime/tick/rolling.h"
#include "runtime/touch/contact_point.h"
#include "runtime/touch/touching_pair.h"

namespace palpate {

/// The most that a tick has used of what has fixed room.
struct HighWater {
  Index near_nodes = 0;      ///< of NearField::capacity
  Index contact_points = 0;  ///< of State::max_contacts
  Index unknowns = 0;        ///< rows of the contact problem, of Scratch::rows
  Index simplices = 0;       ///< near a tool, of DetectionScratch::pairs; more were there where it is larger
};

/// A contact point on its way into the contact problem.
struct UpcomingContact {
  Index last = -1;          ///< the same one in LastContacts
  bool stays_open = false;  ///< in this tick: it has no rows
  bool has_place = false;   ///< in AssemblyScratch::order
  Vec3 motion =
      Vec3::Zero();  ///< of tool and surface against each other if no force changes, and the gap [m]
};

/// A group of surface nodes that were one contact point in the tick before.
struct MergedGroup {
  Index last = -1;      ///< in LastContacts
  double defect = 0.0;  ///< how much its members' gaps differ from their mean at most [m]
};

/// Workspace of the merging of contact points.
struct MergingScratch {
  MergingScratch(Index surface_nodes, Index groups, Index most_members, Index max_contacts);

  std::vector<Index> candidate_of_node;  ///< [S] the candidate at a surface node, -1 none, -2 several
  std::vector<MergedGroup> merged;       ///< [max_contacts] in the tick before
  std::vector<double> weights;           ///< [members] of the group that is merged
  std::vector<Eigen::Matrix3d> maps;     ///< [members] of it
  std::vector<std::int64_t> feature;     ///< [groups] of the contact point of each, -1 none
  bool has_changed = false;              ///< other nodes are merged than in the tick or pass before
};

/// The contact points of the tick before (or the pass before), found by their features.
class LastContacts {
 public:
  explicit LastContacts(Index max_contacts);

  /// Keeps these.
  void remember(std::span<const ContactPoint> now) noexcept;
  /// Lists all anew, as features have changed.
  void list_features() noexcept;
  /// Number of the contact with this feature, -1 where there was none.
  [[nodiscard]] Index number_of(std::int64_t feature) const noexcept;

  std::vector<ContactPoint> contacts;  ///< [max_contacts]
  Index count = 0;

 private:
  void enter(Index number) noexcept;

  std::vector<Index> of_feature_;  // [power of 2] their numbers, hashed by feature
};

/// Workspace of contact detection; S surface nodes, F simplices.
struct DetectionScratch {
  DetectionScratch(const Body& body, Index tools, Index max_contacts);

  std::vector<Index> found;              ///< [F] simplices near a tool; free motion uses it too
  std::vector<double> found_distance;    ///< [F] squared [m^2]
  std::size_t found_count = 0;           ///< of `found`, within a tool's reach
  std::vector<TouchingPair> pairs;       ///< [8 max_contacts]
  std::vector<ContactPoint> candidates;  ///< [24 max_contacts tools] before they are merged, and the deepest
                                         ///< chosen
  Index candidate_count = 0;
  Index simplex_ahead = -1;               ///< soon to be within a tool's reach; -1: none
  std::vector<Index> candidate_at_node;   ///< [S] candidate at a surface node that was found last
  std::vector<Index> candidates_between;  ///< [as candidates] those that are no surface node
  Index between_count = 0;
  std::vector<LeftOut> left_out;  ///< places for which there was no room
  Index left_out_count = 0;
};

/// Workspace of the assembly of W and b.
struct AssemblyScratch {
  AssemblyScratch(const Body& body, Index max_contacts, Index near_nodes);

  std::vector<std::ptrdiff_t> row_first;        ///< [few rows] column of C of the one node of a row
  std::vector<std::array<double, 4>> row_body;  ///< [few rows] what the row has of it
  std::vector<double> row_response;             ///< [d near_nodes] a column of Xi J^T [m/N]
  std::vector<double> guess_force;              ///< [d near_nodes] of many contacts [N]
  std::vector<UpcomingContact> upcoming;        ///< [max_contacts] of many contacts
  std::vector<Index> order;                     ///< [max_contacts] of many contacts: who comes to each place
  std::vector<Eigen::Matrix3d> response;  ///< [max_contacts] `linearise` of many contacts: change of the
                                          ///< force by a motion of the tool's device, a column an axis [N/m]
  std::vector<Eigen::Matrix3d> last_response;  ///< [max_contacts] of the tick or pass before
  Index response_count = 0;
  BodyCompliance compliance;        ///< of many contacts: the body's
  std::vector<float> coupling;      ///< [6 x rows] of many contacts: forces and moments
  std::vector<double> tilt_spring;  ///< [rows] of edges and faces [m/N]
};

/// The solvers, and how the last pass went.
struct SolverScratch {
  SolverScratch(const Body& body, Index max_contacts);

  ActiveSet active_set;        ///< without friction
  ConeSolver cone_solver;      ///< with friction
  NewtonKrylov newton_krylov;  ///< of many contacts
  bool is_solved = true;       ///< to its tolerance
  bool was_improved = false;   ///< few contacts took a second solver
};

/// Workspace of the error estimate of a best effort.
struct ForceErrorScratch {
  ForceErrorScratch(const Body& body, Index tools, Index max_contacts);

  Imbalance imbalance;                  ///< of a problem that was not solved
  std::vector<Vec3> missing_force;      ///< [tools] of the solver [N]
  std::vector<Index> left_out_nodes;    ///< [sampled] stored nodes
  std::vector<double> left_out_blocks;  ///< [d x d sampled] Xi of these [m/N]
};

/// Workspace of linearisation: how forces answer to motions.
struct ChangeScratch {
  ChangeScratch(const Body& body, Index max_contacts);

  std::vector<double> of_rows;    ///< [d x rows] db, an axis after the other [m]
  std::vector<double> of_forces;  ///< [d x rows] dlambda [N]
  RollingScratch rolling;         ///< the turning of normals
};

/// What stages of a tick hand to each other, by who fills it. No tick needs it from the one before: only
/// `high_water` goes on, the compliance and responses of many contacts, without which they are computed from
/// nothing; the problem's forces may be read until the next tick. Sized at start.
struct Scratch {
  /// Room for the tools' contacts: `max_contacts` of all tools together, and what fits into the near field.
  Scratch(const Body& body, Index tools, Index max_contacts, const NearField& near);

  LastContacts last;
  DetectionScratch detection;
  MergingScratch merging;
  bool is_first_pass = true;     ///< solve_contact: of the tick's Newton passes
  ContactProblem problem;        ///< [rows] assembly: W and b; solution: lambda
  std::vector<ContactRow> rows;  ///< [rows] assembly: J
  AssemblyScratch assembly;
  SolverScratch solvers;
  ForceErrorScratch force_error;
  GreensErrorScratch greens_error;       ///< linearise: of compressed Green's functions
  ChangeScratch changes;                 ///< linearise
  std::vector<double> far_displacement;  ///< [d nodes] far surface: what is renewed in a tick [m]
  HighWater high_water;                  ///< detection and assembly: since the start
};

}  // namespace palpate
