// Choice of the overlays that the tools need, now and soon.
#pragma once

#include <array>
#include <compare>
#include <vector>

#include "runtime/body/patch_maker.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/state.h"

namespace palpate {

/// Centres of a patch, ascending: stored nodes, of a rounded body surface nodes; unused entries are -1.
struct PatchKey {
  std::array<Index, most_overlay_tools> centres{-1, -1, -1, -1};

  [[nodiscard]] bool empty() const noexcept { return centres[0] < 0; }
  [[nodiscard]] Index count() const noexcept;
  void add(Index centre) noexcept;
  // NOLINTNEXTLINE(modernize-use-nullptr): the 0 that it sees is the language's
  auto operator<=>(const PatchKey&) const = default;
};

/// Requested overlays, the most urgent first, without duplicates.
struct PatchRequests {
  static constexpr std::size_t most = 8;
  std::array<PatchKey, most> keys{};
  std::size_t count = 0;
  Vec3 direction = Vec3::Zero();  ///< direction of the first tool's motion, unit vector or zero

  void add(const PatchKey& key) noexcept;
};

/// Follows the tools and chooses the places of overlays: around the body's node with the largest weight where
/// a tool is deepest in the body at rest, or nearest to a free tool. The centre changes only if another node
/// has clearly more weight, so that a tool between two nodes does not switch back and forth. Forces are not
/// used: outside a patch the body is stiffer and carries more, so the patch would move away from where it is
/// needed. All memory is allocated at construction.
class PatchChoice {
 public:
  PatchChoice(const Body& body, const State& state);

  /// Updates the choice from the last tick. Each tick looks ahead to one time, in turn.
  void follow(const Body& body, const State& state) noexcept;

  [[nodiscard]] const PatchKey& now() const noexcept { return now_; }  ///< empty while no tool is near
  [[nodiscard]] const PatchRequests& requests() const noexcept { return requests_; }

 private:
  struct Followed {
    Index centre = -1;
    Vec3 velocity = Vec3::Zero();  // smoothed velocity of the device [m/tick]
  };

  void follow_tool(const Body& body, const State& state, std::size_t number) noexcept;
  [[nodiscard]] PatchKey key_at(const Body& body, const State& state, double ticks) noexcept;
  [[nodiscard]] Index touched_centre(const Body& body, const State& state, std::size_t number) noexcept;
  [[nodiscard]] Index nearest_centre(const Body& body, const NearestSimplex& found, Index present) noexcept;
  void add_share(const Body& body, Index surface_node, double share) noexcept;
  [[nodiscard]] Index chosen(Index present) const noexcept;
  [[nodiscard]] Index nearest_to_middle(const Body& body, Index present) const noexcept;

  double reach_;  // distance from the body within which a tool gets overlays [m]
  std::int64_t ticks_ = 0;
  std::vector<Followed> tools_;
  // Workspace of a choice.
  std::size_t count_ = 0;
  std::vector<Index> touched_;  // stored nodes with a weight
  std::vector<double> share_;   // their weights
  PatchKey now_;
  std::array<PatchKey, tuning.patches.times_ahead.size()> ahead_;  // predicted centres
  PatchRequests requests_;
};

}  // namespace palpate
