// A scripted tool: a CSV file in place of a hand.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/safety/device.h"

namespace palpate {

/// Plays rows of t, x, y, z [, qw, qx, qy, qz] [, grab] (seconds, metres, a quaternion of any length but 0, 0
/// or 1), found by the names of their columns, as spreadsheets and loggers write them. Between rows the tool
/// moves in straight lines and turns about a fixed axis at constant speed (slerp, the shorter way), and the
/// grab button is that of the row before. Without the quaternion the tool is not turned; without grab it
/// never is set.
class ScriptDevice : public Device {
 public:
  /// Reads `file`. Throws Error naming file and line.
  static ScriptDevice read(const std::filesystem::path& file);

  /// Reads `text`; `name` stands for the file in messages.
  static ScriptDevice parse(std::string_view text, const std::string& name);

  /// Names of columns that mean nothing here.
  [[nodiscard]] const std::vector<std::string>& unread() const noexcept { return unread_; }

  /// The pose at time t [s]: before the first row the tool is at its place without grabbing, after the last
  /// it stays.
  [[nodiscard]] ToolPose pose(double t) const noexcept;

  /// Time of the last row [s].
  [[nodiscard]] double end_time() const noexcept { return rows_.back().t; }

  /// Ticks a second; 1000 unless it is set.
  void set_rate(std::int64_t rate) noexcept { rate_ = rate; }
  /// Number of ticks from 0 to the last row.
  [[nodiscard]] std::int64_t ticks() const noexcept;

  /// The pose at the tick's time, and the velocity from the tick before.
  DeviceNews poll(const TickTime& tick) noexcept override;
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  struct Row {
    double t;
    ToolPose pose;
  };
  std::vector<Row> rows_;  // at least one, ascending in t
  std::vector<std::string> unread_;
  std::int64_t rate_ = 1000;
};

}  // namespace palpate
