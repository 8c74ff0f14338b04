// How the body moves beside what the present contact forces do to it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/body/modal_newmark.h"
#include "runtime/body/nodal_load.h"
#include "runtime/body/surface_load.h"

namespace palpate {

/// What the body is told when it is let go: forces that end [N], and how fast they were changing [N/s]. Its
/// static displacement by them, at that velocity, is added to its motion. The velocity's kinetic energy is
/// bounded [J]: a tool that lifts faster than the body comes back by itself leaves it behind.
struct LetGo {
  NodalLoad force;
  NodalLoad rate;
  double energy = 0.0;
};

/// The factor that leaves a velocity of this kinetic energy [J] no more than the bound.
double velocity_share(double kinetic_energy, double bound) noexcept;

/// What is asked of the packed step of all dofs, which runs beside the tick.
struct MotionJob {
  std::int64_t step = 0;    ///< which one: a whole number of ticks from one to the next
  std::int64_t let_go = 0;  ///< how many times the body was let go by then
  LetGo release;            ///< the last of them
  NodalLoad load;           ///< dynamic contact: the forces at the step's end
  double left = 1.0;        ///< quasi-static contact: what it leaves of the motion
};

/// Its answer.
struct MotionSample {
  std::int64_t step = 0;    ///< of the job that it answers
  std::int64_t let_go = 0;  ///< how many are in it
  std::vector<double> u;    ///< [n] without contact forces at the end of the step after [m]
  /// What contact forces act by from then on, for a live or warped body; null: the body's Green's functions.
  std::shared_ptr<const Greens> compliance{};
  bool is_near_limit = false;  ///< a live body's explicit step is close to the longest stable one
  /// [n] Of a live body: as the tool found it, moved along with it [m]; else empty.
  std::vector<double> untouched{};
};

/// A moment of free motion, for the eye: the modes times q plus u.
struct MotionSnapshot {
  explicit MotionSnapshot(const Body& body);
  bool moves = false;     ///< else what follows is old
  std::vector<double> q;  ///< [k]
  std::vector<double> u;  ///< [n] of the stored dofs [m]
};

/// Displacement of a stored node [m].
Vec3 displacement(const Body& body, const MotionSnapshot& shown, Index stored) noexcept;

/// Displacement [S x 3] of all surface nodes [m] by forces, on top of free motion where there is any.
/// `stored` [n] is scratch: that of the stored nodes. For the eye: too long for a tick.
void surface_displacement(const Body& body, const SurfaceLoad& load, std::span<double> stored,
                          std::span<Vec3> u, const MotionSnapshot* motion = nullptr) noexcept;

/// The body's motion on its own: free vibration once it was let go and, with dynamic contact, what inertia
/// and viscosity make of the forces so far (theory.md section 5). Contact forces of the tick displace the
/// body from there. Quasi-static contact has no inertia to answer with: under it the motion dies away in a
/// tenth of a second. Modal dynamics step within the tick; packed ones beside it, by jobs that `MotionSource`
/// does. Copies are complete; calls allocate nothing.
class FreeMotion {
 public:
  /// At rest. `tick` [s]: time from one tick to the next; `most_loads`: stored nodes that a tick can load.
  /// Throws Error when the file's time step is not a whole number of ticks, or, with dynamic contact, one.
  FreeMotion(const Body& body, double tick, Index most_loads);

  /// Whether anything moves: nothing does in a file without dynamics, or until the body was let go first.
  [[nodiscard]] bool active() const noexcept { return active_; }

  /// Goes on to the time of the next tick.
  void begin_tick(const Body& body) noexcept;

  /// Displacement of a surface node in this tick [m].
  [[nodiscard]] Vec3 at(const Body& body, Index surface_node) noexcept {
    return active_ ? find_at(body, surface_node) : Vec3(Vec3::Zero());
  }
  /// By how much more it is than in the tick before, as far as that is known [m]; after `at`.
  [[nodiscard]] const Vec3& change(Index surface_node) const noexcept { return change_[surface_node]; }
  /// Displacement of a stored node in this tick [m].
  [[nodiscard]] Vec3 displacement(const Body& body, Index stored) const noexcept;
  /// Displacement of a surface node of a live body, were it not pressed in [m]: as the tool found the body,
  /// moved along with it. Of other bodies zero.
  [[nodiscard]] Vec3 untouched(const Body& body, Index surface_node) const noexcept;
  /// All of it in this tick.
  void snapshot(MotionSnapshot& shown) const noexcept;

  /// Ends a tick with its forces.
  void end_tick(const Body& body, const SurfaceLoad& load) noexcept;

  /// Some of the forces of the tick before are gone: those now are `load`. What they did, which is
  /// `displacement` [n] of the stored nodes, becomes free motion, and `displacement` what `load` does.
  /// Between begin_tick and end_tick. A hand that `grabs` the body pulls it along as fast as it moves, a tool
  /// that lifts does not.
  void let_go(const Body& body, const SurfaceLoad& load, std::span<double> displacement, bool grabs) noexcept;

  /// What the forces of the tick before did, which is `displacement` [n]. Before let_go.
  void note_strain(std::span<const double> displacement) noexcept;

  /// For MotionSource: what is to be done next; the sample that it made.
  [[nodiscard]] const MotionJob& job() const noexcept { return job_; }
  /// False where it is old.
  bool receive(const MotionSample& sample) noexcept;
  /// The part of the motion that contact forces make is another by -u [n] from now on, as their compliance
  /// is: u comes to the motion beside them until the next sample. After `receive`.
  void take_over(const Body& body, std::span<const double> u, double sign) noexcept;
  [[nodiscard]] std::int64_t sample_step() const noexcept { return sample_step_; }  ///< of the last
  /// Whether the last sample is of an explicit step that is close to the longest stable one.
  [[nodiscard]] bool is_near_limit() const noexcept { return is_near_limit_; }
  /// Whether the packed dynamics are behind their time, after begin_tick: what is seen waits for them.
  [[nodiscard]] bool is_late() const noexcept { return ends_step() && job_.step > sample_step_; }

 private:
  [[nodiscard]] Vec3 find_at(const Body& body, Index surface_node) noexcept;
  void begin_modal_step(const Body& body) noexcept;
  void fade_held(double omega) noexcept;
  void add_rate(const NodalLoad& last, bool grabs) noexcept;
  [[nodiscard]] bool ends_step() const noexcept { return phase_ == ticks_per_step_; }

  int dimension_;
  double tick_;
  std::int64_t ticks_per_step_ = 1;
  double decay_;  // what quasi-static contact leaves of the motion in a step
  bool dynamic_contact_;
  bool active_;
  std::int64_t ticks_ = 0;
  std::int64_t phase_ = 1;        // of the present step's ticks, the last one ends it
  std::vector<NodalLoad> loads_;  // [history] of the last ticks, in turn
  std::vector<double> strains_;   // [history] the body's energy under them [J]
  double returned_ = 0.0;         // of it, what the body gave back of late [J]
  LetGo pending_;                 // not yet in the motion

  // What stays where it was: until it is in the motion, and of modal dynamics what the modes do not carry.
  std::vector<double> held_;          // [n] times fade_
  std::vector<double> pending_held_;  // [n]
  double fade_ = 0.0;
  double since_let_go_ = 0.0;  // [s]

  // Modal.
  std::optional<ModalNewmark> modal_;
  std::vector<double> q_before_;  // [k] at the beginning of the step
  std::vector<double> q_held_;    // [k] the modes' part of held_
  std::vector<double> shown_;     // [k] modal coordinates of what is seen, but for held_
  std::vector<double> g_, rate_;  // [k] scratch

  // Packed.
  MotionJob job_;
  std::int64_t sample_step_ = 0;
  bool is_near_limit_ = false;
  bool held_in_flight_ = false;       // held_ until a sample has it
  std::int64_t sample_phase_ = 0;     // phase in which the sample came
  std::vector<double> u_before_, u_;  // [n] samples between which the tick is
  double share_ = 1.0;                // of u_
  std::vector<double> untouched_;     // [n] of a live body

  // By surface node.
  std::vector<std::int64_t> stamp_;  // tick of the value
  std::vector<Vec3> value_, change_;
};

}  // namespace palpate
