// Motion of the body beside the displacement by the present contact forces.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/body/modal_newmark.h"
#include "runtime/core/body/nodal_load.h"
#include "runtime/core/body/surface_load.h"

namespace palpate {

/// Release of the body: forces that end [N], and their rate of change [N/s]. The static displacement by these
/// forces, with the corresponding velocity, is added to the body's motion. The kinetic energy of that
/// velocity is bounded by `energy` [J]: a tool that lifts faster than the body can follow leaves it behind.
struct LetGo {
  NodalLoad force;
  NodalLoad rate;
  double energy = 0.0;
};

/// Factor that reduces a velocity of this kinetic energy [J] to the bound.
double velocity_share(double kinetic_energy, double bound) noexcept;

/// Request for a step of all degrees of freedom, which runs beside the tick.
struct MotionJob {
  std::int64_t step = 0;    ///< number of the step; a step is a whole number of ticks
  std::int64_t let_go = 0;  ///< number of releases up to this step
  /// Step of the last sample received; on two levels of that under which the forces were found.
  std::int64_t seen = 0;
  LetGo release;   ///< last release
  NodalLoad load;  ///< dynamic contact: forces at the end of the step
  /// On two levels: displacement of the load's nodes without these forces, d each [m].
  std::vector<double> without{};
  double left = 1.0;  ///< quasi-static contact: factor on the motion
};

/// Result of a step.
struct MotionSample {
  std::int64_t step = 0;    ///< step of the job that it answers
  std::int64_t let_go = 0;  ///< number of releases included
  /// [n + n_q] displacement without contact forces at the end of the next step, of the stored dofs and of the
  /// coarse field [m].
  std::vector<double> u;
  /// Compliance for contact forces from then on, for a body that is live or on two levels; null: the body's
  /// Green's functions.
  std::shared_ptr<const Greens> compliance{};
  /// [n + n_q] displacement by the job's forces with the compliance before, less that with this one [m];
  /// empty: not known.
  std::vector<double> shift{};
  double force_error = 0.0;  ///< of the job's forces, as a fraction of them
  /// Body on two levels: by which small strain has more force for the same places, as a fraction of it; 0
  /// where the tick's force is not that of the balance.
  double small_strain = 0.0;
  /// [n] live body: displacement without the tool's indentation, moving with the body [m]; else empty.
  std::vector<double> untouched{};
};

/// Snapshot of the free motion, for display: the modes times q, plus u.
struct MotionSnapshot {
  explicit MotionSnapshot(const ElasticBody& body);
  bool moves = false;     ///< if false, the following is out of date
  std::vector<double> q;  ///< [k]
  std::vector<double> u;  ///< [n + n_q] displacement of the stored dofs and of the coarse field [m]
};

/// Displacement of a stored node [m].
Vec3 displacement(const ElasticBody& body, const MotionSnapshot& shown, Index stored) noexcept;

/// Computes the displacement [m] of the first u.size() surface nodes, or of as many as `only` has of these,
/// by the load, plus the free motion if given. `stored` [n] is workspace for the displacement of the stored
/// nodes. For display: too slow for a tick.
void surface_displacement(const ElasticBody& body, const SurfaceLoad& load, std::span<double> stored,
                          std::span<Vec3> u, const MotionSnapshot* motion = nullptr,
                          std::optional<std::span<const Index>> only = {}) noexcept;

/// Free motion of the body: vibration after a release and, with dynamic contact, the effect of inertia and
/// viscosity for the forces so far (theory.md section 5). The tick's contact forces displace the body from
/// there. Quasi-static contact has no inertia: while it lasts, the motion decays within a tenth of a second.
/// Modal dynamics are stepped in the tick, packed ones beside it, by jobs for `MotionSource`. Copies are
/// complete; calls allocate nothing.
class FreeMotion {
 public:
  /// At rest. `tick`: time between ticks [s]; `most_loads`: largest number of stored nodes loaded in a tick.
  /// Throws Error if the file's time step is not a whole number of ticks, or, with dynamic contact, not one
  /// tick.
  FreeMotion(const ElasticBody& body, double tick, Index most_loads);

  /// True if there may be motion: never without dynamics in the file, nor before the first release.
  [[nodiscard]] bool active() const noexcept { return active_; }

  /// Advances to the time of the next tick.
  void begin_tick(const ElasticBody& body) noexcept;

  /// Displacement of a surface node in this tick [m].
  [[nodiscard]] Vec3 at(const ElasticBody& body, Index surface_node) noexcept {
    return active_ ? find_at(body, surface_node) : Vec3(Vec3::Zero());
  }
  /// Change of a surface node's displacement since `at` or this was last called for it [m]; zero the first
  /// time.
  [[nodiscard]] Vec3 advance(const ElasticBody& body, Index surface_node) noexcept {
    const SurfaceNode before = nodes_[surface_node];
    const Vec3 now = find_at(body, surface_node);
    return before.stamp < 0 ? Vec3(Vec3::Zero()) : Vec3(now - before.value);
  }
  /// Bound of the change of any node's displacement in this tick [m]; infinite if it is not known.
  [[nodiscard]] double most_change() const noexcept;
  /// Change of a surface node's displacement since the last tick, where known [m]; valid after `at`.
  [[nodiscard]] const Vec3& change(Index surface_node) const noexcept { return nodes_[surface_node].change; }
  /// Displacement of a stored node in this tick [m].
  [[nodiscard]] Vec3 displacement(const ElasticBody& body, Index stored) const noexcept;
  /// Displacement of a surface node of a live body without the tool's indentation [m], moving with the body.
  /// Zero for other bodies.
  [[nodiscard]] Vec3 untouched(const ElasticBody& body, Index surface_node) const noexcept;
  /// Copies the motion of this tick.
  void snapshot(MotionSnapshot& shown) const noexcept;

  /// Ends a tick with its forces.
  void end_tick(const ElasticBody& body, const SurfaceLoad& load) noexcept;

  /// Releases some forces of the last tick: those that remain are `load`. The displacement by the last
  /// forces, `displacement` [n] of the stored nodes, becomes free motion, and `displacement` becomes that by
  /// `load`. Call between begin_tick and end_tick. A hand that `grabs` the body passes on its velocity; a
  /// lifting tool does not.
  void let_go(const ElasticBody& body, const SurfaceLoad& load, std::span<double> displacement,
              bool grabs) noexcept;

  /// Records the strain energy of the last tick's forces, which displace by `displacement` [n]. Call before
  /// let_go.
  void note_strain(std::span<const double> displacement) noexcept;

  /// Next step requested from MotionSource.
  [[nodiscard]] const MotionJob& job() const noexcept { return sampled_.job; }
  /// Takes over a sample; false if it is out of date.
  bool receive(const MotionSample& sample) noexcept;
  /// Adds sign * u [n or n + n_q] to the motion until the next sample, to compensate a change of the
  /// displacement by contact forces when their compliance changes. Call after `receive`.
  void take_over(const ElasticBody& body, std::span<const double> u, double sign) noexcept;
  [[nodiscard]] std::int64_t sample_step() const noexcept { return sampled_.step; }     ///< last sample's
  [[nodiscard]] double force_error() const noexcept { return sampled_.force_error; }    ///< last sample's
  [[nodiscard]] double small_strain() const noexcept { return sampled_.small_strain; }  ///< last sample's
  /// True if packed dynamics are late, after begin_tick: the displayed motion waits for them.
  [[nodiscard]] bool is_late() const noexcept { return ends_step() && sampled_.job.step > sampled_.step; }

 private:
  [[nodiscard]] Vec3 find_at(const ElasticBody& body, Index surface_node) noexcept;
  void begin_modal_step(const ElasticBody& body) noexcept;
  void fade_held(double omega) noexcept;
  void add_rate(const NodalLoad& last, bool grabs) noexcept;
  [[nodiscard]] bool ends_step() const noexcept { return phase_ == ticks_per_step_; }

  /// Forces of the last ticks, and the release that follows once they end.
  struct History {
    std::vector<NodalLoad> loads;  // [history]
    std::vector<double> strains;   // [history] strain energies under them [J]
    double returned = 0.0;         // strain energy released by the body recently [J]
    LetGo pending;                 // release not yet in the motion
  };
  /// Displacement held fixed: until it enters the motion, and for modal dynamics the part not represented by
  /// modes.
  struct Held {
    std::vector<double> u;        // [n] times fade
    std::vector<double> pending;  // [n]
    double fade = 0.0;
    double since_let_go = 0.0;  // [s]
  };
  struct Modal {
    std::optional<ModalNewmark> newmark;
    std::vector<double> q_before;  // [k] at the beginning of the step
    std::vector<double> q_held;    // [k] the modes' part of what is held
    std::vector<double> shown;     // [k] modal coordinates of what is seen, but for what is held
    std::vector<double> g, rate;   // [k] workspace
  };
  /// Samples of a step beside the tick.
  struct Sampled {
    MotionJob job;
    std::int64_t step = 0;          // of the last sample
    bool held_in_flight = false;    // what is held stays until a sample has it
    std::int64_t begun = 0;         // tick after which the sample came
    std::int64_t length = 1;        // ticks until it is reached
    std::vector<double> before, u;  // [n] samples between which the tick lies
    double share = 1.0;             // of u
    double last_share = 1.0;        // in the last tick
    double most_change = -1.0;      // from `before` to u, of any dof; negative: not known
    std::vector<double> untouched;  // [n] empty unless live
    double force_error = 0.0;       // MotionSample::force_error
    double small_strain = 0.0;      // MotionSample::small_strain
  };
  struct SurfaceNode {
    std::int64_t stamp = -2;  // tick of the value
    Vec3 value = Vec3::Zero();
    Vec3 change = Vec3::Zero();
  };

  int dimension_;
  double tick_;
  std::int64_t ticks_per_step_ = 1;
  double decay_;  // factor of quasi-static contact on the motion, per step
  bool dynamic_contact_;
  bool is_on_two_levels_;
  bool active_;
  std::int64_t ticks_ = 0;
  std::int64_t phase_ = 1;  // tick within the present step, from 1; the last one ends it
  History history_;
  Held held_;
  Modal modal_;
  Sampled sampled_;
  std::vector<SurfaceNode> nodes_;  // [S]
};

}  // namespace palpate
