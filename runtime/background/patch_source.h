// Brings overlays to the tick: built ahead of the tools by a thread of its own, kept within a budget.
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

/// How the fine mesh of an overlay answers deformation.
enum class PatchLaw : std::uint8_t {
  linear,       ///< as the body around it
  neo_hookean,  ///< LiveLaw::neo_hookean: where the tool presses, a patch by its tangent takes the place
};

/// The names that users give: linear, neo-hookean.
const char* name_of(PatchLaw law) noexcept;

struct PatchSourceOptions {
  int rings = OverlayOptions{}.rings;
  PatchLaw law = PatchLaw::linear;
  std::size_t memory = std::size_t{512} << 20;  ///< that patches may take [bytes]
  bool in_background = true;  ///< false: `serve` builds what is missing itself, for runs that nobody feels
};

/// What is told of it.
struct PatchCounts {
  std::int64_t ticks = 0;       ///< with a tool near the body
  std::int64_t older = 0;       ///< of them with another patch than wanted, or none
  std::int64_t in_contact = 0;  ///< ticks in which something is touched
  std::int64_t older_in_contact = 0;
  std::int64_t switches = 0;  ///< from one patch to another
};

/// The overlays of one loop. The loop calls `serve` before each tick, from the tick's thread: it never waits,
/// locks or allocates. Patches are freed by the builder, after nobody uses them any more.
class PatchSource {
 public:
  /// Starts the builder, which makes the patches that the file has, after those requested. `body` must
  /// live as long; `state` is one that the loop will use, or a copy, with room as patch_room says.
  PatchSource(const Body& body, const State& state, const PatchSourceOptions& options);
  ~PatchSource();
  PatchSource(const PatchSource&) = delete;
  PatchSource& operator=(const PatchSource&) = delete;

  /// Sets the patch that the next tick is to use: the one that is wanted, and while that is not there the one
  /// of the tick before. Of a law that is not linear the builder makes one after the other by the forces of
  /// the last tick; without background, every few ticks.
  void serve(State& state) noexcept;

  /// For a replay: sets the patch that lies round a stored node, built if need be (-1: none yet), and whether
  /// it was an older one. Not in the background.
  void serve(State& state, Index centre, bool older) noexcept;

  /// The stored node that the patch which the last tick was given lies round (the first, of several), -1
  /// before there was one.
  [[nodiscard]] Index centre() const noexcept { return used_.centres[0]; }
  [[nodiscard]] const PatchCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::int64_t built() const noexcept { return built_; }            ///< patches so far
  [[nodiscard]] double longest_build() const noexcept { return longest_build_; }  ///< [s]
  [[nodiscard]] std::int64_t failed() const noexcept { return failed_; }  ///< patches that could not be made
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }     ///< that the cache takes
  /// What makes patches of a law that is not linear; null for linear ones.
  [[nodiscard]] const PatchTangents* tangents() const noexcept { return tangents_ ? &*tangents_ : nullptr; }

 private:
  /// A patch that the tick may use from now on, or, with null, no more.
  struct Delivery {
    Index slot = -1;
    PatchKey key;
    std::shared_ptr<const Patch> patch;
  };
  /// What the builder keeps.
  struct Kept {
    Index slot = -1;
    std::shared_ptr<const Patch> patch;
    std::int64_t wanted = 0;  // in which round last
  };

  /// The last patch by a tangent, with null: none.
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
  PatchKey used_;  // of state.surface.patch

  // The tick's side.
  std::vector<Delivery> slots_;
  std::vector<Index> first_slot_;  // [stored nodes] of the patches whose first centre each is, -1 for none
  std::vector<Index> next_slot_;   // [slots] of the same first centre
  Latest<PatchRequests> requests_;
  Ring<Delivery> deliveries_;
  Latest<PatchLoad> loads_;
  Latest<Tangent> delivered_tangents_;

  // The builder's side.
  std::map<PatchKey, Kept> kept_;
  std::vector<Index> free_slots_;
  std::vector<std::shared_ptr<const Patch>> retired_;
  std::optional<PatchTangents> tangents_;
  std::size_t next_stored_ = 0;  // of the file's patches
  std::int64_t round_ = 0;
  std::atomic<std::int64_t> built_ = 0;
  std::atomic<std::int64_t> failed_ = 0;
  std::atomic<double> longest_build_ = 0.0;
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread builder_;
};

}  // namespace palpate
