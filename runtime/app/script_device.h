// Scripted tool: a CSV file in place of a haptic device.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/safety/device.h"

namespace palpate {

/// Plays rows of t, x, y, z [, qw, qx, qy, qz] [, grab] (seconds, metres, a quaternion of any length except
/// 0, 0 or 1). Columns are found by name, as spreadsheets and loggers write them. Between rows the tool moves
/// along straight lines and rotates about a fixed axis at constant speed (slerp, the shorter way); the grab
/// button is that of the previous row. Without a quaternion the tool is not rotated; without a grab column it
/// never grabs.
class ScriptDevice : public Device {
 public:
  /// Reads `file`. Throws Error that names file and line.
  static ScriptDevice read(const std::filesystem::path& file);

  /// Reads `text`; `name` stands for the file in messages.
  static ScriptDevice parse(std::string_view text, const std::string& name);

  /// Names of the columns that are ignored.
  [[nodiscard]] const std::vector<std::string>& unread() const noexcept { return unread_; }

  /// Returns the pose at time t [s]: before the first row that of the first row without grabbing, after the
  /// last row that of the last.
  [[nodiscard]] ToolPose pose(double t) const noexcept;

  /// Time of the last row [s].
  [[nodiscard]] double end_time() const noexcept { return rows_.back().t; }

  /// Sets the ticks per second; the default is 1000.
  void set_rate(std::int64_t rate) noexcept { rate_ = rate; }
  /// Number of ticks from 0 to the last row.
  [[nodiscard]] std::int64_t ticks() const noexcept;

  /// Returns the pose at the tick's time, and the velocity since the previous tick.
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
