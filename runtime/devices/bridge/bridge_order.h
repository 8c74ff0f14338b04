// Which of a bridge's datagrams are new.
#pragma once

#include <cstdint>

#include "runtime/devices/bridge/bridge_datagram.h"

namespace palpate {

/// Sees the datagrams of one partner as they arrive. Both clocks are monotonic, but neither knows when the
/// other began, and they need not run equally fast: a datagram's age is by how much longer it was on its way
/// than the quickest one, which is forgotten by a thousandth of the time that passes.
class BridgeOrder {
 public:
  static constexpr double most_age = 0.020;  ///< [s]; a device that is silent for so long shows no force

  /// `order`, `time` or `age`, or none: then the next one must be ahead of this one. `sequence` wraps around;
  /// `time` of the bridge [ns], `arrived` of ours [ns].
  Refusal see(std::uint32_t sequence, std::uint64_t time, std::int64_t arrived) noexcept;

  /// Numbers that were skipped so far: lost, refused, or overtaken by later ones.
  [[nodiscard]] std::uint64_t skipped() const noexcept { return skipped_; }

  /// Another partner: anything is new. What was skipped stays counted.
  void reset() noexcept { seen_any_ = false; }

 private:
  std::uint64_t time_ = 0;    // of the last one taken [ns]
  std::int64_t arrived_ = 0;  // of the last one that was new [ns]
  double quickest_ = 0.0;     // arrived - time, of the quickest [ns]
  std::uint64_t skipped_ = 0;
  std::uint32_t sequence_ = 0;  // of the last one taken
  bool seen_any_ = false;
};

}  // namespace palpate
