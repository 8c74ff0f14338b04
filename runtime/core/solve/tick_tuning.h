// All tuned numbers of the tick.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vectors.h"

namespace palpate {

// Units are in brackets; [edge] is the mean edge of the body's surface at rest, [1] a pure number. The
// measurement behind a value is named; where none is named, none is on record. Limits of arithmetic
// (rounding, denormal numbers) are defined beside the formulas in which they occur.

/// Motion of the tools with their devices.
struct FollowingTuning {
  double margin = 0.03;       ///< [edge] least distance from a tool within which the surface is searched
  double most_motion = 0.25;  ///< [edge or radius, the larger] largest motion of a tool per tick
};

/// Detection of contact points between tools and surface.
struct DetectionTuning {
  double same_place = 1e-4;      ///< [edge] contact points closer than this are one
  double same_direction = 1e-6;  ///< [1] if 1 - cos of the angle between their normals is smaller as well
  double deepest_inside = 0.25;  ///< [edge] a tool whose core is deeper is lost in the body
  /// [edge of the simplex] radius above which a sphere touches corners alone: chords of the smooth surface
  /// keep it out by edge^2 / 6 R, corners let it sink in. Error of the force on the half-space, 0.05 and 0.1
  /// R deep, with faces and edges / corners alone: at 2.6 edges +16 and +21 / -35 and -13 %, at 3.5 +20 and
  /// +20 / -15 and -3, at 4.4 +21 and +10 / -9 and -1, at 5.3 +18 and +10 / 0 and -3.
  double smooth_radius = 3.0;
  double slips = 0.7;  ///< cosine between a normal and the surface's at rest from which on fine nodes are
                       ///< held by friction (docs/overlays.md)
  double holds = 0.5;  ///< the same where it is a friction of 1, and beyond which they are not touched: of
                       ///< 40 000 ticks of palpation with a sphere of 5 mm (palpation_study, friction 0.2) it
                       ///< is lost in the body in 20 in place of 365, and 51 take more than 1 ms, not 141
  double large_disc = 2.0;    ///< [edge of the simplex] radius above which a disc needs no points of the rim
                              ///< inside faces: its arc between two edges is within 1/16 of an edge of its
                              ///< chord
  double steep = 0.2;         ///< [sin] a disc's rim touches the inside of a face at its nearest point if the
                              ///< face is steeper to the disc, otherwise at eight places. Measured for a disc
                              ///< of two edges: nearest points of faces at 0.12 to 0.15 jumped back and forth
                              ///< by 0.3 %
  double still_steep = 0.15;  ///< [sin] threshold for a face touched in this way in the last tick
  double rim_apart = 0.1;     ///< [edge of the simplex] the crossing of an edge and a disc's rim is a contact
                              ///< point of its own if it is this far from the nearest point of the two
  double ahead = 0.05;        ///< [edge] beyond a tool's reach, within which one node per tick becomes near
  double on_surface = 1e-6;   ///< [edge] distance below which the normal is that of the face
};

/// Assembly of the contact problem at the present positions.
struct AssemblyTuning {
  double closed_gap = 0.01;        ///< [edge] a contact with a smaller gap may be closed
  double least_tilt_radius = 0.5;  ///< [edge] radius assumed for the tilt of contacts of sharper tools
  double most_roll = 0.25;         ///< [1] largest rotation of a contact's normal per tick by the device
  double coincident_share = 1e-9;  ///< [mean compliance] added to every contact, so that coincident points
                                   ///< divide the force
  double wall_share = 0.01;        ///< [compliance of the stiffest node] compliance of a fixed boundary
};

/// Newton passes within a tick.
struct PassTuning {
  int most = 3;                ///< largest number of passes per tick
  Index most_blocks = 1500;    ///< blocks of C for nodes that came in the tick; after more there is no other
                               ///< pass. They take 0.03 us each, of compressed Green's functions 0.25 us
  double penetration = 0.002;  ///< [edge] a deeper penetration requires another pass
  double most_motion = 0.25;   ///< [edge] plus that of the tools; a larger one of the surface is scaled down
  double left_behind = 1e-3;   ///< [largest force] a smaller one that scaling leaves beside all tools goes
};

/// Solver for contact with friction. Budget and tolerances were chosen from problems of tools that slide over
/// the demo's bodies.
struct ConeTuning {
  double tolerance = 1e-6;   ///< [largest force] target of the residual
  double accepted = 1e-4;    ///< [largest force] accepted residual if `tolerance` is not reached
  double no_change = 1e-10;  ///< [largest force] target in a tick in which nothing moves
  int fewest_rounds = 4;     ///< least number of rounds, whatever their cost
  int most_rounds = 60;
  double most_work = 6e5;     ///< multiplications; measured: about 0.2 ms
  double easy_share = 0.1;    ///< [most_work] a smaller share of work leaves time for another pass
  int sweeps = 3;             ///< block Gauss-Seidel sweeps if the Newton step is not taken
  int local_rounds = 3;       ///< rounds at a contact within a sweep
  int plain_rounds = 5;       ///< rounds before the proximal steps
  int spring_rounds = 12;     ///< rounds of each proximal step
  double first_share = 0.01;  ///< [w_ii] weight of the first proximal step
  double next_share = 0.5;  ///< [previous weight] measured with first_share: of 250 problems of a sphere and
                            ///< a point sliding over the liver that plain rounds had not solved, these solve
                            ///< 220, the rest to 2e-4 of the force
  /// [Newton step] fractions tried in turn, the whole step first: near the solution it converges
  /// quadratically.
  std::array<double, 4> step_shares = {1.0, 0.5, 0.25, 0.1};
  double least_gain = 0.5;  ///< [residual times fraction] a fraction of the step that gains less is not taken
  int return_stride = 5;    ///< rounds without a step sweep from its end, but one out of this many from its
                            ///< start, since steps can cycle
};

/// Solver for contact with many points. The numbers are those of a comparison of solvers on the demo's bodies
/// (docs/decisions).
struct ManyTuning {
  int few_contacts = 36;         ///< most contact points for the direct solvers, with friction
  int few_closed = 10;           ///< most closed contact points for the direct solvers, with friction
  int few_frictionless = 200;    ///< most contact points for the direct solvers, without friction
  double open_gap = 0.02;        ///< [edge] a contact without force and with a larger gap is left out
  double least_residual = 2e-8;  ///< [largest force] residual of the guess at which it is the solution
  double no_change = 1e-7;  ///< [largest force] target if nothing moves in the tick: rounding changes as much
  double reduction = 0.1;   ///< [residual of the guess] target, at most `tolerance`, so that rest is reached
  double tolerance = 1e-4;  ///< [largest force] target of the residual
  double rough_tolerance = 3e-4;  ///< [largest force] accepted beyond `smooth_work` or `rough_failures`
  double deep_precision = 0.01;  ///< [tolerances] on two levels, where W is soft near an instability and what
                                 ///< slides by the residual of each tick adds up
  double smooth_work = 3e6;      ///< multiplications
  int rough_failures = 3;        ///< failed Newton steps
  double late_tolerance = 1e-3;  ///< [largest force] accepted in motion if another round exceeds `late_work`
  double late_work = 5e6;        ///< multiplications. Measured: spheres of 150 and 500 mm on the liver with
                                 ///< edges of 3.6 mm, friction 0.2 (docs/decisions-contact.md)
  double accepted = 3e-3;        ///< [largest force] accepted at the end of the budget
  int most_rounds = 60;      ///< rounds of sweeps, each with a Newton step until these have failed. With 20 a
                             ///< sliding disc left 11 of 300 ticks unsolved, with 60 it leaves 2
  double most_work = 1.4e7;  ///< multiplications
  Index product_overhead = 200;  ///< [columns] overhead of a product with W
  int sweeps = 2;                ///< block Gauss-Seidel sweeps before and after a Newton step
  int local_rounds = 8;          ///< rounds for the direction of a slipping contact
  float local_tolerance = 1e-4F;
  int fewest_steps = 16;  ///< GMRES steps
  int most_steps = 48;
  double step_work = 6e6;  ///< multiplications of GMRES, between fewest and most steps
  float linear_tolerance = 0.01F;
  double gain = 0.7;       ///< [previous residual] a Newton step that gains less has failed
  double slipping = 1e-5;  ///< [1] a contact closer to the edge of the cone slips
  int most_failures = 5;   ///< failed Newton steps after which there are only sweeps
};

/// Merging of contact points at neighbouring nodes (runtime/core/tick/contact_merging.h). Measured on the
/// liver with edges of 3.6 mm, spheres of 150 and 500 mm that merge from 64 contact points on: with a defect
/// of 0.003 / 0.01 / 0.03 edges a tick takes 0.55 to 0.7 / 0.4 to 0.6 / 0.35 to 0.6 of the time without
/// merging, and no force differs from that without by more than 0.14 / 0.24 / 0.26 % of the largest
/// (docs/decisions).
struct MergingTuning {
  Index from = 160;  ///< pressed nodes from which on they are merged; also if contact points fill three
                     ///< quarters of their capacity. Below three quarters of either they are split again
  Index fewest = 3;  ///< least number of closed contact points in a group to be merged
  double least_mean_normal = 0.98;  ///< [1] least length of the mean of a group's normals
  Index crowd = 200;      ///< contact points from which on sticking and slipping nodes are merged alike
  double sticking = 0.7;  ///< [available friction] sticking nodes that use less are merged
  double no_longer_sticking = 0.85;  ///< [available friction] sticking nodes that use more are split again
  double slipping = 0.9999;          ///< [available friction] nodes that use more slip; they are not split
  Index most_new = 2;                ///< groups merged per tick, unless contact points exceed their capacity
  Index most_parted = 1;             ///< groups split per tick because their defect became too large
  double defect = 0.01;  ///< [edge] largest deviation of the gaps of merged contact points from their mean
};

/// Force given to the hand.
struct HandTuning {
  double usual_tick = 0.001;         ///< [s] reference for the fractions per millisecond
  double fade_time = 20.0;           ///< [ms] time in which the force of a lost contact fades
  double patience = 0.3;             ///< [s] time without motion after which the force should be constant
  double settled_share = 1e-6;       ///< [recent force] change per tick that is still accepted then
  double memory = 0.98;              ///< [1/ms] decay of the recent force, the reference of a fade
  int rolling_passes = 3;            ///< passes in which the local model follows the rotation of normals
  double rolling_tolerance = 0.003;  ///< [change of the force] tolerance of these passes
  Index most_turning = 32;     ///< closed contacts with rotating normals; with more the body does not respond
  Index most_following = 128;  ///< rows of closed contacts; with more the body does not respond
  double curvature_share = 0.1;  ///< [radius] beyond, normals rotate too much for the local model
  double error_margin = 1.4;     ///< [estimate] reported error of a best-effort force. Measured: without the
                              ///< margin half of the estimates for solvers stopped early are below the true
                              ///< error (tests/runtime/solve/imbalance_test) and two of three for contacts
                              ///< left out (liver), mostly by a quarter; with it one of six, and two of five
};

/// Updates of the far surface per tick.
struct FarTuning {
  Index nodes = 64;             ///< nodes of the body whose displacement is updated
  Index patch_nodes = 8;        ///< nodes of the patch's surface
  Index blocks = 8192;          ///< pairs of loaded and updated nodes
  Index moves = 64;             ///< surface nodes moved with them
  Index run = 16;               ///< stored nodes per run; runs near tools are updated more often, as an
                                ///< outdated node is touched too early or too late
  std::int64_t all_stride = 4;  ///< one tick out of this many continues with the whole body
  double unfollowed = 0.03;     ///< [edge] motion of the body that nodes beside a tool may lag, as much as
                                ///< the margin of the search
  double tree_margin = 0.5;     ///< [edge] margin of the tree's boxes; at 0.1 ticks take up to a fifth
                                ///< longer, for refitting boxes
};

/// Near field and free motion.
struct BodyTuning {
  std::int64_t patience = 200;      ///< ticks for which an unwanted node stays near: a tool often returns
  Index usual_nodes = 300;          ///< with more near nodes, that time is proportionally shorter
  std::int64_t fine_patience = 10;  ///< the same on a fine surface (LocalCompliance). Sphere of 5 mm at 200
                                    ///< mm/s on the liver, median of a tick: 450 us with 40, 390 with 20, 360
                                    ///< with 10, 350 with 5
  int most_forgotten = 16;          ///< nodes of such a surface that are forgotten in a tick
  double settling = 0.1;            ///< [s] time constant by which quasi-static contact damps a body
  double least_fade = 1e-6;         ///< [1] least factor on the held displacement of a released body
  std::size_t least_history = 4;    ///< ticks of contact needed for the rate of its forces
  std::size_t history = 8;          ///< ticks over which that rate is taken
};

/// Placement of overlays.
struct PatchTuning {
  double clearly_more = 0.1;     ///< [1] lead over the centre that another node needs, of all weights
  double farther = 0.5;          ///< [edge of the fine surface] the same for graded overlays, in distance
  double near_edges = 3.0;       ///< [edge of the body's mesh] a free tool nearer than this has an overlay
  double smoothing = 0.05;       ///< [1/tick] smoothing of the tool's velocity
  std::int64_t look_stride = 8;  ///< ticks between searches around a free tool
  std::array<double, 4> times_ahead = {15.0, 40.0, 80.0, 150.0};  ///< [ticks] for which patches are requested
};

/// All tuned numbers of a tick.
struct TickTuning {
  FollowingTuning following;
  DetectionTuning detection;
  AssemblyTuning assembly;
  PassTuning passes;
  ConeTuning cone;
  ManyTuning many;
  MergingTuning merging;
  HandTuning hand;
  FarTuning far;
  BodyTuning body;
  PatchTuning patches;
};

inline constexpr TickTuning tuning{};

}  // namespace palpate
