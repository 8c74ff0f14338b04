// Workspace of a tick.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/contact_solver.h"
#include "runtime/core/solve/imbalance.h"
#include "runtime/core/tick/greens_error.h"
#include "runtime/core/touch/compliance.h"
#include "runtime/core/touch/contact_point.h"
#include "runtime/core/touch/rolling.h"
#include "runtime/core/touch/touching_pair.h"

namespace palpate {

/// Largest use of each fixed capacity by a tick.
struct HighWater {
  Index near_nodes = 0;      ///< limit: NearField::capacity
  Index contact_points = 0;  ///< limit: State::max_contacts
  Index unknowns = 0;        ///< rows of the contact problem, of Scratch::rows
  Index simplices = 0;       ///< near a tool, of DetectionScratch::pairs; if larger, not all were examined
};

/// Contact point before it is added to the contact problem.
struct UpcomingContact {
  Index last = -1;             ///< number of the same contact in LastContacts
  bool stays_open = false;     ///< open in this tick: it has no rows
  bool has_place = false;      ///< it has a place in AssemblyScratch::order
  Vec3 motion = Vec3::Zero();  ///< relative motion of tool and surface if no force changes, and the gap [m]
};

/// Group of surface nodes that was one contact point in the last tick.
struct MergedGroup {
  Index last = -1;      ///< number in LastContacts
  double defect = 0.0;  ///< largest deviation of its members' gaps from their mean [m]
};

/// Workspace for merging contact points.
struct MergingScratch {
  MergingScratch(Index surface_nodes, Index groups, Index most_members, Index max_contacts);

  std::vector<Index> candidate_of_node;  ///< [S] candidate at a surface node; -1: none, -2: several
  std::vector<MergedGroup> merged;       ///< [max_contacts] groups of the last tick
  std::vector<double> weights;           ///< [members] weights of the group being merged
  std::vector<Eigen::Matrix3d> maps;     ///< [members] maps of the group being merged
  std::vector<std::int64_t> feature;     ///< [groups] feature of each group's contact point; -1: none
  bool has_changed = false;              ///< other nodes are merged than in the last tick or pass
};

/// Contact points of the last tick or pass, indexed by their features.
class LastContacts {
 public:
  explicit LastContacts(Index max_contacts);

  /// Stores these contact points.
  void remember(std::span<const ContactPoint> now) noexcept;
  /// Rebuilds the index after features have changed.
  void list_features() noexcept;
  /// Number of the contact with this feature; -1 if there is none.
  [[nodiscard]] Index number_of(std::int64_t feature) const noexcept;

  std::vector<ContactPoint> contacts;  ///< [max_contacts]
  Index count = 0;

 private:
  void enter(Index number) noexcept;

  std::vector<Index> of_feature_;  // [power of 2] numbers of contacts, hashed by feature
};

/// Workspace of contact detection; S surface nodes, F simplices.
struct DetectionScratch {
  DetectionScratch(const ElasticBody& body, Index tools, Index max_contacts);

  std::vector<Index> found;              ///< [F] simplices near a tool; also used by free motion
  std::vector<double> found_distance;    ///< [F] squared [m^2]
  std::size_t found_count = 0;           ///< entries of `found` within a tool's reach
  std::vector<TouchingPair> pairs;       ///< [8 max_contacts]
  std::vector<ContactPoint> candidates;  ///< [24 max_contacts tools] before merging, and before the deepest
                                         ///< are chosen
  Index candidate_count = 0;
  Index simplex_ahead = -1;               ///< a simplex soon within a tool's reach; -1: none
  std::vector<Index> candidate_at_node;   ///< [S] last candidate found at a surface node
  std::vector<Index> candidates_between;  ///< [as candidates] candidates that are not at a surface node
  Index between_count = 0;
  std::vector<LeftOut> left_out;  ///< places that exceed the capacity
  Index left_out_count = 0;
};

/// Workspace for the assembly of W and b.
struct AssemblyScratch {
  AssemblyScratch(const ElasticBody& body, Index max_contacts, Index near_nodes);

  std::vector<double> row_response;       ///< [d near_nodes] column of Xi J^T [m/N]
  std::vector<double> guess_force;        ///< [d near_nodes] [N]
  std::vector<UpcomingContact> upcoming;  ///< [max_contacts]
  std::vector<Index> order;               ///< [max_contacts] where W is kept: who comes to each place
  std::vector<Eigen::Matrix3d> response;  ///< [max_contacts] `linearise`: change of the force by a motion of
                                          ///< the tool's device, a column an axis [N/m]
  std::vector<Eigen::Matrix3d> last_response;  ///< [max_contacts] response of the last tick or pass
  Index response_count = 0;
  BodyCompliance compliance;
  std::tuple<std::vector<double>, std::vector<float>> coupling;  ///< [6 x rows] forces and moments, for W in
                                                                 ///< double and in single precision
  std::vector<double> tilt_spring;  ///< [rows] compliance of the tilt of edges and faces [m/N]
};

/// Workspace for the error estimate of a best effort.
struct ForceErrorScratch {
  ForceErrorScratch(const ElasticBody& body, Index tools, Index max_contacts);

  Imbalance imbalance;                  ///< for an unsolved problem
  std::vector<Vec3> missing_force;      ///< [tools] from the solver [N]
  std::vector<Index> left_out_nodes;    ///< [sampled] stored nodes
  std::vector<double> left_out_blocks;  ///< [d x d sampled] Xi of these nodes [m/N]
};

/// Workspace of linearisation: response of the forces to motions.
struct ChangeScratch {
  ChangeScratch(const ElasticBody& body, Index max_contacts);

  std::vector<double> of_rows;    ///< [d x rows] db for each axis, concatenated [m]
  std::vector<double> of_forces;  ///< [d x rows] dlambda [N]
  RollingScratch rolling;         ///< rotation of normals
};

/// Newton's passes within a tick. In those after the first one, tools and surface are where the device and
/// the body's own motion have taken them.
enum class Pass : std::uint8_t { first, repeated };

/// Data passed between the stages of a tick, grouped by the stage that writes them. No tick needs them from
/// the previous one, except `high_water` and the compliance and responses of many contacts, which otherwise
/// are computed from scratch. The problem's forces may be read until the next tick. Allocated at
/// construction.
struct Scratch {
  /// Capacities: `max_contacts` contacts of all tools together, and the nodes of the near field.
  Scratch(const ElasticBody& body, Index tools, Index max_contacts, const NearField& near);

  LastContacts last;
  DetectionScratch detection;
  MergingScratch merging;
  ContactProblem problem;        ///< [rows] assembly: W and b; solution: lambda
  std::vector<ContactRow> rows;  ///< [rows] assembly: J
  AssemblyScratch assembly;
  ContactSolver solver;
  bool is_solved = true;  ///< the last pass, to the solver's tolerance
  ForceErrorScratch force_error;
  GreensErrorScratch greens_error;       ///< linearise: for compressed Green's functions
  ChangeScratch changes;                 ///< linearise
  std::vector<double> far_displacement;  ///< [d nodes] far surface: updated displacement of a tick [m]
  HighWater high_water;                  ///< detection and assembly: maxima since the start
};

}  // namespace palpate
