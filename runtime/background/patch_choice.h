// Which overlays the tools want, now and soon.
#pragma once

#include <array>
#include <compare>
#include <vector>

#include "runtime/body/patch_maker.h"
#include "runtime/solve/tick_tuning.h"
#include "runtime/tick/state.h"

namespace palpate {

/// The centres of a patch, stored nodes, ascending; -1 behind the last.
struct PatchKey {
  std::array<Index, most_overlay_tools> centres{-1, -1, -1, -1};

  [[nodiscard]] bool empty() const noexcept { return centres[0] < 0; }
  [[nodiscard]] Index count() const noexcept;
  void add(Index centre) noexcept;
  auto operator<=>(const PatchKey&) const = default;
};

/// What is wanted of overlays, the most urgent first, each once.
struct PatchRequests {
  static constexpr std::size_t most = 8;
  std::array<PatchKey, most> keys{};
  std::size_t count = 0;
  Vec3 direction = Vec3::Zero();  ///< in which the first tool moves, unit, or zero

  void add(const PatchKey& key) noexcept;
};

/// Follows the tools and tells where overlays belong: round the node of the body that has the largest part in
/// the places where a tool is deepest in the body at rest, or that a free tool is nearest to. It changes to
/// another node only when that one clearly has more, so that a tool on the border between two does not go to
/// and fro. Forces have no say: beside a patch the body is stiffer and carries more, so that the patch would
/// follow its own absence. All memory is taken at construction.
class PatchChoice {
 public:
  PatchChoice(const Body& body, const State& state);

  /// By the tick before. Looks ahead to one time a tick, in turn.
  void follow(const Body& body, const State& state) noexcept;

  [[nodiscard]] const PatchKey& now() const noexcept { return now_; }  ///< empty while no tool is near
  [[nodiscard]] const PatchRequests& requests() const noexcept { return requests_; }

 private:
  struct Followed {
    Index centre = -1;
    Vec3 velocity = Vec3::Zero();  // of the device, smoothed [m a tick]
  };

  void follow_tool(const Body& body, const State& state, std::size_t number) noexcept;
  [[nodiscard]] PatchKey key_at(const Body& body, const State& state, double ticks) noexcept;
  [[nodiscard]] Index touched_centre(const Body& body, const State& state, std::size_t number) noexcept;
  [[nodiscard]] Index nearest_centre(const Body& body, const NearestSimplex& found, Index present) noexcept;
  void add_share(const Body& body, Index surface_node, double share) noexcept;
  [[nodiscard]] Index chosen(Index present) const noexcept;

  double reach_;  // how far from the body overlays are made for a tool [m]
  std::int64_t ticks_ = 0;
  std::vector<Followed> tools_;
  // Scratch of a choice.
  std::size_t count_ = 0;
  std::vector<Index> touched_;  // stored nodes that have a part in the places that count
  std::vector<double> share_;   // and how much
  PatchKey now_;
  std::array<PatchKey, tuning.patches.times_ahead.size()> ahead_;  // where the tools will be
  PatchRequests requests_;
};

}  // namespace palpate
