// Overlays of a neo-Hookean law, linearised where the tool's forces have them.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "runtime/background/hyperelastic_patch.h"
#include "runtime/background/patch_choice.h"
#include "runtime/body/patch_maker.h"

namespace palpate {

/// Forces that a tick ended with, and the overlay that is wanted for them.
struct PatchLoad {
  explicit PatchLoad(std::size_t room) : nodes(room), forces(room, Vec3::Zero()) {}

  void clear() noexcept { count = 0; }
  /// Adds a force [N] on a surface node; as many as there is room for.
  void add(Index surface_node, const Vec3& force) noexcept;
  [[nodiscard]] std::span<const Index> loaded() const noexcept { return {nodes.data(), count}; }
  [[nodiscard]] std::span<const Vec3> applied() const noexcept { return {forces.data(), count}; }

  PatchKey key;
  const Patch* by = nullptr;  ///< the patch that the tick had
  std::size_t count = 0;
  std::vector<Index> nodes;
  std::vector<Vec3> forces;
};

/// What is told of the search for balance.
struct PatchTangentTelling {
  std::int64_t made = 0;           ///< patches that were linearised
  std::int64_t failed = 0;         ///< that could not be made
  std::int64_t cuts = 0;           ///< times that one was cut in half
  std::int64_t with_inverted = 0;  ///< patches with quadrature points that are inside out
  Index most_inverted = 0;
  double last_residual = 0.0;  ///< forces left, of the largest [-]
  double longest = 0.0;        ///< time that one took [s]
};

/// Makes one patch after the other. The tick meets x = x(f_p) + W (f - f_p): f_p are the forces of the load
/// that the patch was made for, x where the patch is under them, W its tangent. The forces f that a later
/// tick ends with are the next f_p, so that at rest the body is where HyperelasticPatch has it. For one
/// thread at a time, except `telling`.
class PatchTangents {
 public:
  /// `body` and `maker` must live as long.
  PatchTangents(const Body& body, PatchMaker& maker) : body_(body), maker_(maker) {}

  /// Goes on under a load, to another patch or, without forces, to none. False where nothing is to be done,
  /// or the load is of a tick that did not have the last patch yet.
  bool follow(const PatchLoad& load) noexcept;

  /// Where the last patch is.
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
  std::vector<Index> nodes_;  // of the last load
  std::vector<Vec3> forces_;
  std::shared_ptr<const Patch> patch_;
  std::vector<std::shared_ptr<const Patch>> kept_;  // until the tick has let go of them: none is freed there
  mutable std::mutex mutex_;                        // of telling_
  PatchTangentTelling telling_;
};

}  // namespace palpate
