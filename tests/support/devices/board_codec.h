// The reports of a home-made board as its firmware has them: those that it sends, and the one that it is
// sent.
#pragma once

#include <algorithm>
#include <optional>
#include <span>

#include "runtime/devices/reports/little_endian.h"
#include "runtime/devices/reports/palpate_board.h"
#include "tests/support/devices/bytes.h"

namespace palpate {

inline Bytes encode_board_input(const BoardInput& input) {
  const auto axes = static_cast<std::size_t>(std::clamp(input.axes, least_board_axes, most_board_axes));
  Bytes report(board_input_bytes(static_cast<int>(axes)));
  report[0] = 1;
  write_number(report, 1, input.sequence);
  for (std::size_t k = 0; k < axes; ++k) write_number(report, 5 + 4 * k, input.values[k]);
  write_number(report, 5 + 4 * axes, input.buttons);
  return report;
}

/// Empty for another id or length.
inline std::optional<BoardForce> decode_board_force(std::span<const std::uint8_t> report) {
  if (report.size() != board_force_bytes || report[0] != 2) return std::nullopt;
  BoardForce force;
  force.sequence = read_number<std::uint32_t>(report, 1);
  for (std::size_t k = 0; k < 3; ++k) force.counts[k] = read_number<std::int16_t>(report, 5 + 2 * k);
  return force;
}

inline Bytes encode_board_feature(const BoardFeature& feature) {
  Bytes report(board_feature_bytes);
  report[0] = 3;
  report[1] = board_version;
  report[2] = static_cast<std::uint8_t>(feature.axes);
  write_number(report, 3, feature.watchdog);
  write_number(report, 5, feature.force_unit);
  write_number(report, 9, feature.max_force);
  write_number(report, 13, feature.max_stiffness);
  write_number(report, 17, feature.max_damping);
  write_number(report, 21, feature.workspace_radius);
  return report;
}

}  // namespace palpate
