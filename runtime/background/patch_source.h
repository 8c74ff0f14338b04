// Provides overlays to the tick: built ahead of the tools by a thread of its own, within a memory budget.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "base/latest.h"
#include "base/ring.h"
#include "runtime/background/patch_choice.h"
#include "runtime/background/patch_tangents.h"
#include "runtime/body/patch_maker.h"

namespace palpate {

/// Law of the fine mesh of an overlay.
enum class PatchLaw : std::uint8_t {
  linear,       ///< same as the body around it
  neo_hookean,  ///< LiveLaw::neo_hookean: a patch from its tangent is used where the tool presses
};

/// Returns the name as users give it: linear, neo-hookean.
const char* name_of(PatchLaw law) noexcept;

struct PatchSourceOptions {
  int rings = OverlayOptions{}.rings;
  double finest = 0.0;  ///< of graded patches (PatchMaker) [m]
  PatchLaw law = PatchLaw::linear;
  std::size_t memory = std::size_t{512} << 20;  ///< limit for all patches [byte]
  bool in_background = true;  ///< false: `serve` builds missing patches itself, for runs without a hand
};

/// Statistics on overlays.
struct PatchCounts {
  std::int64_t ticks = 0;       ///< ticks with a tool near the body
  std::int64_t older = 0;       ///< ticks among these with an older patch or none
  std::int64_t in_contact = 0;  ///< ticks in contact
  std::int64_t older_in_contact = 0;
  std::int64_t switches = 0;  ///< changes of the patch
};

/// Overlays of one loop. The loop calls `serve` before each tick, on its thread: it never waits, locks or
/// allocates. The builder frees patches once they are no longer used.
class PatchSource {
 public:
  /// Starts the builder, which makes the requested patches, then those in the file. `body` must outlive this;
  /// `state` is the loop's state or a copy, with the capacity given by patch_room.
  PatchSource(const Body& body, const State& state, const PatchSourceOptions& options);
  ~PatchSource();
  PatchSource(const PatchSource&) = delete;
  PatchSource& operator=(const PatchSource&) = delete;

  /// Sets the patch for the next tick: the wanted one or, until it is available, that of the last tick. For a
  /// nonlinear law the builder makes one patch after the other from the forces of the last tick; without
  /// background, every few ticks.
  void serve(State& state) noexcept;

  /// Sets, in a replay, the patch around a stored node, built if necessary (-1: none yet), and whether it was
  /// an older one. Not in the background.
  void serve(State& state, Index centre, bool older) noexcept;

  /// Stored node at the centre of the last tick's patch (the first of several); -1 before the first patch.
  [[nodiscard]] Index centre() const noexcept { return used_.centres[0]; }
  [[nodiscard]] const PatchCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::int64_t built() const noexcept { return built_; }            ///< patches so far
  [[nodiscard]] double longest_build() const noexcept { return longest_build_; }  ///< [s]
  [[nodiscard]] std::int64_t failed() const noexcept { return failed_; }  ///< patches that could not be made
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }     ///< size of the cache
  /// Maker of patches for a nonlinear law; null for linear ones.
  [[nodiscard]] const PatchTangents* tangents() const noexcept { return tangents_ ? &*tangents_ : nullptr; }

 private:
  /// Patch that the tick may use from now on; null: no longer.
  struct Delivery {
    Index slot = -1;
    PatchKey key;
    std::shared_ptr<const Patch> patch;
  };
  /// Patch kept by the builder.
  struct Kept {
    Index slot = -1;
    std::shared_ptr<const Patch> patch;
    std::int64_t wanted = 0;  // last round in which it was wanted
  };

  /// Last patch from a tangent; null: none.
  struct Tangent {
    PatchKey key;
    std::shared_ptr<const Patch> patch;
  };

  void receive() noexcept;
  void post_load(const State& state, const PatchKey& wanted) noexcept;
  [[nodiscard]] bool take_tangent(State& state, const PatchKey& wanted) noexcept;
  [[nodiscard]] bool take_linear(State& state, const PatchKey& wanted) noexcept;
  void unlink(Index slot) noexcept;
  [[nodiscard]] const std::shared_ptr<const Patch>* find(const PatchKey& key) const noexcept;
  void count(const State& state) noexcept;

  void build_wishes();
  bool build_next(const PatchRequests& requests);
  bool build_stored();
  bool build(const PatchKey& key);
  bool follow_load(const PatchLoad& load) noexcept;
  void make_room();
  void deliver(Delivery delivery);

  const Body& body_;
  PatchSourceOptions options_;
  PatchMaker maker_;
  PatchChoice choice_;
  PatchCounts counts_;
  PatchKey used_;  // key of state.surface.patch

  // The tick's side.
  std::vector<Delivery> slots_;
  std::vector<Index> first_slot_;  // [centres] first slot of patches with this first centre; -1: none
  std::vector<Index> next_slot_;   // [slots] next one with the same first centre
  Latest<PatchRequests> requests_;
  Ring<Delivery> deliveries_;
  Latest<PatchLoad> loads_;
  Latest<Tangent> delivered_tangents_;

  // The builder's side.
  std::map<PatchKey, Kept> kept_;
  std::vector<Index> free_slots_;
  std::vector<std::shared_ptr<const Patch>> retired_;
  std::optional<PatchTangents> tangents_;
  std::size_t next_stored_ = 0;  // next patch of the file
  std::int64_t round_ = 0;
  std::atomic<std::int64_t> built_ = 0;
  std::atomic<std::int64_t> failed_ = 0;
  std::atomic<double> longest_build_ = 0.0;
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread builder_;
};

}  // namespace palpate
