// Every tuned number of the tick in one place.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

// Units stand in brackets; [edge] is the mean edge of the body's surface at rest, [1] a pure number. Where a
// value was chosen by a measurement, the measurement is named; of the others none is on record. Limits of
// arithmetic (rounding, denormal numbers) stay beside the formulas that they belong to.

/// How tools follow their devices.
struct FollowingTuning {
  double margin = 0.03;       ///< [edge] the surface is looked for at least this far from a tool
  double most_motion = 0.25;  ///< [edge or radius, the larger] a tool moves in a tick
};

/// Where tools and surface touch.
struct DetectionTuning {
  double same_place = 1e-4;      ///< [edge] contact points nearer than this are one
  double same_direction = 1e-6;  ///< [1] if 1 - cos of their normals is smaller as well
  double deepest_inside = 0.25;  ///< [edge] a tool whose core is deeper is lost in the body
  /// [edge of the simplex] A larger sphere touches corners alone: chords of the smooth surface hold it out by
  /// edge^2 / 6 R, corners let it sink in. Force against the half-space, 0.05 and 0.1 R deep, with faces and
  /// edges / corners alone: at 2.6 edges +16 and +21 / -35 and -13 %, at 3.5 +20 and +20 / -15 and -3, at 4.4
  /// +21 and +10 / -9 and -1, at 5.3 +18 and +10 / 0 and -3.
  double smooth_radius = 3.0;
  double large_disc = 2.0;    ///< [edge of the simplex] of a larger one no points of the rim within faces are
                              ///< needed: its arc between two edges is within 1/16 of an edge of its chord
  double steep = 0.2;         ///< [sin] a disc's rim touches the inside of a face that is steeper to the disc
                              ///< where it is nearest, a flatter one at eight places. Measured, disc of two
                              ///< edges: nearest points of faces at 0.12 to 0.15 ran to and fro by 0.3 %
  double still_steep = 0.15;  ///< [sin] where it touched so in the tick before
  double rim_apart = 0.1;     ///< [edge of the simplex] where an edge passes over a disc's rim is a contact
                              ///< point of its own if this far from where the two are nearest
  double ahead = 0.05;        ///< [edge] of what is that much beyond a tool's reach, a node a tick comes near
  double on_surface = 1e-6;   ///< [edge] nearer, the normal is the face's and not the distance's
};

/// The contact problem about where everything is.
struct AssemblyTuning {
  double closed_gap = 0.01;        ///< [edge] a contact with a smaller gap may be closed
  double least_tilt_radius = 0.5;  ///< [edge] a sharper tool's contact slides on its face as if it were this
  double most_roll = 0.25;         ///< [1] that a contact's normal turns in a tick by the device's motion
  double coincident_share = 1e-9;  ///< [mean compliance] added to every contact, so that points that coincide
                                   ///< share the force
  double wall_share = 0.01;        ///< [compliance of the stiffest node] what a fixed boundary gives way by
};

/// Newton's passes within a tick.
struct PassTuning {
  int most = 3;                ///< passes in a tick
  Index most_rows = 150;       ///< of W where contacts are many: three passes with more would exceed 1 ms
  double penetration = 0.002;  ///< [edge] a deeper one calls for another pass
  double most_motion = 0.25;   ///< [edge] and what the tools may move: farther, the surface retreats
};

/// The solver for contact with friction. Budget and tolerances were chosen from problems of tools that slide
/// over the demo's bodies.
struct ConeTuning {
  double tolerance = 1e-6;   ///< [largest force] of the residual
  double accepted = 1e-4;    ///< [largest force] where `tolerance` is not met
  double no_change = 1e-10;  ///< [largest force] in a tick in which nothing moves
  int fewest_rounds = 4;     ///< whatever they cost
  int most_rounds = 60;
  double most_work = 6e5;     ///< multiplications; measured: some 0.2 ms
  double easy_share = 0.1;    ///< [most_work] less leaves time for another pass
  int sweeps = 3;             ///< block Gauss-Seidel sweeps where Newton's step is not taken
  int local_rounds = 3;       ///< of a sweep at a contact
  int plain_rounds = 5;       ///< before the proximal steps
  int spring_rounds = 12;     ///< of each proximal step
  double first_share = 0.01;  ///< [w_ii] springs of the first proximal step
  double next_share = 0.5;  ///< [spring before] measured with first_share: of 250 problems of a sphere and a
                            ///< point sliding over the liver that plain rounds had not solved, these solve
                            ///< 220, the rest to 2e-4 of the force
  /// [Newton's step] tried in turn, the whole step first: near the solution it converges quadratically.
  std::array<double, 4> step_shares = {1.0, 0.5, 0.25, 0.1};
  double least_gain = 0.5;  ///< [residual times the share taken] a share that gains less is not taken
  int return_stride = 5;  ///< rounds without a step taken sweep from the step's end, one out of so many from
                          ///< its start, as steps can run in circles
};

/// The solver for contact of many points. The numbers are those of a comparison of solvers on the demo's
/// bodies (docs/decisions).
struct ManyTuning {
  int few_contacts = 36;         ///< contact points that the direct solvers have room for, where some rub,
  int few_closed = 10;           ///< of which so many may be closed;
  int few_frictionless = 200;    ///< and contact points where none rubs
  double open_gap = 0.02;        ///< [edge] a contact without force that is farther is left out of the tick
  double least_residual = 2e-8;  ///< [largest force] of the guess: nothing is to be done
  double no_change = 1e-7;  ///< [largest force] in a tick in which nothing moves: rounding changes as much
  double reduction = 0.1;   ///< [residual of the guess] that a tick reaches at least: rest is reached
  double tolerance = 1e-4;  ///< [largest force]
  double rough_tolerance = 3e-4;  ///< [largest force] beyond `smooth_work`,
  double smooth_work = 3e6;       ///< multiplications,
  int rough_failures = 3;         ///< or where steps of Newton's method have failed so often
  double late_tolerance = 1e-3;  ///< [largest force] where, while something moves, another round would exceed
  double late_work = 5e6;        ///< multiplications. Measured: spheres of 150 and 500 mm on the liver with
                                 ///< edges of 3.6 mm, friction 0.2 (docs/decisions-contact.md)
  double accepted = 3e-3;        ///< [largest force] at the end of the budget
  int most_rounds = 60;      ///< of sweeps, and steps of Newton's method before they have failed. With 20 a
                             ///< disc that slides left 11 of 300 ticks unsolved, with 60 it leaves 2
  double most_work = 1.4e7;  ///< multiplications
  Index product_overhead = 200;  ///< [columns] that a product with W costs beside its own
  double easy_share = 0.2;       ///< [most_work] less leaves time for another pass
  int sweeps = 2;                ///< block Gauss-Seidel sweeps before and after a step of Newton's method
  int local_rounds = 8;          ///< for the direction of a contact that slips
  float local_tolerance = 1e-4F;
  int fewest_steps = 16;  ///< of GMRES
  int most_steps = 48;
  double step_work = 6e6;  ///< multiplications of GMRES, between these bounds
  float linear_tolerance = 0.01F;
  double gain = 0.7;       ///< [residual before] a step of Newton's method that gains less has failed
  double slipping = 1e-5;  ///< [1] nearer to the cone's edge, a contact slips
  int most_failures = 5;   ///< from here on there are sweeps alone
};

/// Merging of contact points at neighbouring nodes (runtime/tick/contact_merging.h). Measured on the liver
/// with edges of 3.6 mm, spheres of 150 and 500 mm that merge from 64 contact points on: with a defect of
/// 0.003 / 0.01 / 0.03 edges a tick takes 0.55 to 0.7 / 0.4 to 0.6 / 0.35 to 0.6 of the time without, and no
/// force is farther from that without than 0.14 / 0.24 / 0.26 % of the largest (docs/decisions).
struct MergingTuning {
  Index from = 160;  ///< pressed nodes from which on they are merged; or where contact points fill three
                     ///< quarters of their room. They are parted again where a quarter less is left
  Index fewest = 3;  ///< closed contact points of a group that is worth it
  double least_mean_normal = 0.98;  ///< [1] length of the mean of a group's normals
  Index crowd = 200;  ///< contact points from which on nodes are merged whether they stick or slip; before
  double sticking = 0.7;  ///< [friction that a contact can bear] with less, nodes that stick are merged, and
  double no_longer_sticking = 0.85;  ///< parted with more,
  double slipping = 0.9999;          ///< but for those that slip
  Index most_new = 2;     ///< groups that are merged in a tick, as long as all contact points have room
  Index most_parted = 1;  ///< groups that are parted in a tick as they have become wrong
  double defect = 0.01;   ///< [edge] that the gaps of merged contact points may differ from their mean
};

/// What the hand is given.
struct HandTuning {
  double usual_tick = 0.001;         ///< [s] the unit of the shares a millisecond
  double fade_time = 20.0;           ///< [ms] in which the force of a lost contact fades
  double patience = 0.3;             ///< [s] that nothing moves, after which the force is expected to rest
  double settled_share = 1e-6;       ///< [recent force] that it may still change in a tick
  double memory = 0.98;              ///< [1/ms] of the recent force, the measure of a fade
  int rolling_passes = 3;            ///< that the turning of normals is followed in the local model
  double rolling_tolerance = 0.003;  ///< [change of the force] where they end
  Index most_turning = 32;     ///< closed contacts of a tool whose normals turn; with more the body does not
  Index most_following = 128;  ///< answer to the turning, nor with more rows of closed contacts
  double curvature_share = 0.1;  ///< [radius] farther, the normals turn too much for the local model
  double error_margin = 1.4;  ///< [estimate] that a force which is a best effort is said to be off. Measured:
                              ///< without it half of the estimates of solvers cut short are under the truth
                              ///< (tests/runtime/solve/imbalance_test) and two of three of contacts left out
                              ///< (liver), mostly by a quarter; with it one of six, and two of five
};

/// How much of the far surface a tick renews.
struct FarTuning {
  Index nodes = 64;             ///< of the body, whose displacement a tick renews
  Index patch_nodes = 8;        ///< of the patch's surface
  Index blocks = 8192;          ///< pairs of loaded and renewed nodes
  Index moves = 64;             ///< surface nodes that are moved with them
  Index run = 16;               ///< stored nodes of a run; near tools, runs are renewed more often, as a node
                                ///< that lies where it was is met too early or too late
  std::int64_t all_stride = 4;  ///< one tick out of so many goes on with the whole body
  double tree_margin = 0.5;     ///< [edge] how much larger the tree's boxes are; at 0.1 ticks take up to a
                                ///< fifth longer, for boxes that are made anew
};

/// The near field and the free motion.
struct BodyTuning {
  std::int64_t patience = 200;    ///< ticks that an unwanted node stays near: a tool often comes back;
  Index usual_nodes = 300;        ///< of more near nodes in proportion less, as each costs in every tick
  double settling = 0.1;          ///< [s] in which quasi-static contact stills a body
  double least_fade = 1e-6;       ///< [1] what is held of a released body below this is forgotten
  std::size_t least_history = 4;  ///< ticks of contact that say how fast its forces change
  std::size_t history = 8;        ///< ticks that this velocity is taken over
};

/// Where overlays belong.
struct PatchTuning {
  double clearly_more = 0.1;     ///< [1] of all shares, that another node must have to become the centre
  double near_edges = 3.0;       ///< [edge of the body's mesh] nearer, a free tool has an overlay
  double smoothing = 0.05;       ///< [1/tick] of the tool's velocity
  std::int64_t look_stride = 8;  ///< ticks from one look at a free tool's surroundings to the next
  std::array<double, 4> times_ahead = {15.0, 40.0, 80.0, 150.0};  ///< [ticks] that patches are asked for
};

/// The tuned numbers of a tick.
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
