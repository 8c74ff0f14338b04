// Overlays of a neo-Hookean law, linearised at the forces of the tool.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/hyperelastic_patch.h"
#include "runtime/background/patch_choice.h"
#include "runtime/body/patch_maker.h"

namespace palpate {

/// Forces at the end of a tick, and the overlay wanted for them.
struct PatchLoad {
  explicit PatchLoad(std::size_t room) : nodes(room), forces(room, Vec3::Zero()) {}

  void clear() noexcept { count = 0; }
  /// Adds a force [N] on a surface node, up to the capacity.
  void add(Index surface_node, const Vec3& force) noexcept;
  [[nodiscard]] std::span<const Index> loaded() const noexcept { return {nodes.data(), count}; }
  [[nodiscard]] std::span<const Vec3> applied() const noexcept { return {forces.data(), count}; }

  PatchKey key;
  const Patch* by = nullptr;  ///< patch used by the tick
  std::size_t count = 0;
  std::vector<Index> nodes;
  std::vector<Vec3> forces;
};

/// Statistics of the search for balance.
struct PatchTangentTelling {
  std::int64_t made = 0;           ///< linearised patches
  std::int64_t failed = 0;         ///< patches that could not be made
  std::int64_t cuts = 0;           ///< halved steps
  std::int64_t with_inverted = 0;  ///< patches with inverted quadrature points
  Index most_inverted = 0;
  double last_residual = 0.0;  ///< residual force relative to the largest force [-]
  double longest = 0.0;        ///< longest time for one patch [s]
};

/// Makes one patch after the other. The tick uses x = x(f_p) + W (f - f_p): f_p are the forces of the load
/// for which the patch was made, x(f_p) the state under them, W its tangent. The forces f at the end of a
/// later tick are the next f_p, so that a body at rest is at the balance of HyperelasticPatch. For one thread
/// at a time, except `telling`.
class PatchTangents {
 public:
  /// `body` and `maker` must outlive this.
  PatchTangents(const Body& body, PatchMaker& maker) : body_(body), maker_(maker) {}

  /// Continues under a load, with another patch or, without forces, with none. False if there is nothing to
  /// do, or the load is from a tick that did not have the last patch yet.
  bool follow(const PatchLoad& load) noexcept;

  /// Centres of the last patch.
  [[nodiscard]] const PatchKey& key() const noexcept { return key_; }
  [[nodiscard]] const std::shared_ptr<const Patch>& patch() const noexcept { return patch_; }  ///< null: none
  [[nodiscard]] PatchTangentTelling telling() const;                                           ///< any thread

 private:
  [[nodiscard]] bool is_settled(const PatchLoad& load) const noexcept;
  void make(const PatchLoad& load);
  void take(std::shared_ptr<const Patch> patch);

  const Body& body_;
  PatchMaker& maker_;
  std::unique_ptr<HyperelasticPatch> law_;
  PatchKey key_;
  bool is_balanced_ = false;
  std::vector<Index> nodes_;  // loaded nodes of the last load
  std::vector<Vec3> forces_;
  std::shared_ptr<const Patch> patch_;
  std::vector<std::shared_ptr<const Patch>> kept_;  // until the tick has released them: the tick frees none
  mutable std::mutex mutex_;                        // guards telling_
  PatchTangentTelling telling_;
};

}  // namespace palpate
