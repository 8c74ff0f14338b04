#include "runtime/app/script_device.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "base/error.h"
#include "base/regular_file.h"
#include "runtime/loop/numbers.h"

namespace palpate {
namespace {

constexpr double longest_script = 24.0 * 3600.0;  // s
const std::string header_hint =
    "write the columns t,x,y,z[,qw,qx,qy,qz][,grab] (seconds, metres, a quaternion, 0 or 1)";

/// The columns of a script: t, x, y, z and those that may follow.
struct Columns {
  bool orientation = false;
  bool grab = false;
  std::size_t count = 0;
};

/// Takes the next line off the front of `text`.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

bool is_blank(std::string_view line) {
  return line.find_first_not_of(" \t\r") == std::string_view::npos;
}

Columns read_header(std::string_view line, const std::string& where) {
  const std::vector<std::string_view> names = split_commas(line);
  for (const bool orientation : {false, true}) {
    for (const bool grab : {false, true}) {
      std::vector<std::string_view> expected = {"t", "x", "y", "z"};
      if (orientation) expected.insert(expected.end(), {"qw", "qx", "qy", "qz"});
      if (grab) expected.emplace_back("grab");
      if (names == expected) return {orientation, grab, names.size()};
    }
  }
  throw Error("is not a header of a script", where, header_hint);
}

std::vector<double> read_numbers(const std::vector<std::string_view>& fields, const std::string& where) {
  std::vector<double> numbers;
  for (const std::string_view field : fields) {
    const std::optional<double> number = parse_number(field);
    if (!number) throw Error("'" + std::string(field) + "' is not a finite number", where, header_hint);
    numbers.push_back(*number);
  }
  return numbers;
}

/// The rotation by a quaternion w, x, y, z of any length but 0.
Eigen::Quaterniond read_orientation(std::span<const double, 4> q, const std::string& where) {
  Eigen::Quaterniond orientation(q[0], q[1], q[2], q[3]);
  const double largest = orientation.coeffs().cwiseAbs().maxCoeff();
  if (largest == 0.0) {
    throw Error("the quaternion is zero, which is no orientation", where,
                "write 1,0,0,0 for a tool that is not turned");
  }
  orientation.coeffs() /= largest;
  return orientation.normalized();
}

ToolPose read_pose(std::span<const double> values, const Columns& columns, const std::string& where) {
  ToolPose pose;
  pose.position = Vec3(values[1], values[2], values[3]);
  if (columns.orientation) pose.orientation = read_orientation(values.subspan<4, 4>(), where);
  if (columns.grab) {
    const double grab = values.back();
    if (grab != 0.0 && grab != 1.0)
      throw Error(fmt::format("grab is {}", grab), where, "write 1 while the tool holds, else 0");
    pose.grab = grab == 1.0;
  }
  return pose;
}

}  // namespace

ScriptDevice ScriptDevice::read(const std::filesystem::path& file) {
  return parse(read_all(file, "check the name after 'script:'"), file.string());
}

ScriptDevice ScriptDevice::parse(std::string_view text, const std::string& name) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());

  ScriptDevice device;
  Columns columns;
  for (int line_number = 1; !text.empty(); ++line_number) {
    const std::string_view line = next_line(text);
    const std::string where = name + ":" + std::to_string(line_number);
    if (is_blank(line)) continue;
    if (columns.count == 0) {
      columns = read_header(line, where);
      continue;
    }

    const std::vector<std::string_view> fields = split_commas(line);
    if (fields.size() != columns.count) {
      throw Error("has " + std::to_string(fields.size()) + " fields where the header has " +
                      std::to_string(columns.count),
                  where, "give each row a value for each column");
    }
    const std::vector<double> values = read_numbers(fields, where);
    const double t = values[0];
    const double before = device.rows_.empty() ? 0.0 : device.rows_.back().t;
    if (t < before || (t == before && !device.rows_.empty())) {
      throw Error("the time " + std::string(fields[0]) + " s is not after the one before it", where,
                  "order the rows by time, from 0 on, each time once");
    }
    if (t > longest_script) {
      throw Error("the time " + std::string(fields[0]) + " s is more than a day", where,
                  "give times in seconds");
    }
    device.rows_.push_back({t, read_pose(values, columns, where)});
  }
  if (device.rows_.empty()) throw Error("has no rows", name, header_hint);
  return device;
}

ToolPose ScriptDevice::pose(double t) const noexcept {
  const auto after = std::upper_bound(rows_.begin(), rows_.end(), t,
                                      [](double time, const Row& row) { return time < row.t; });
  if (after == rows_.begin()) {
    ToolPose pose = rows_.front().pose;
    pose.grab = false;
    return pose;
  }
  const Row& row = *(after - 1);
  ToolPose pose = row.pose;
  if (after != rows_.end()) {
    const double share = (t - row.t) / (after->t - row.t);
    pose.position += share * (after->pose.position - row.pose.position);
    pose.orientation = row.pose.orientation.slerp(share, after->pose.orientation);
  }
  return pose;
}

std::int64_t ScriptDevice::ticks() const noexcept {
  constexpr double rounding = 1e-6;  // of a tick: 0.003 s is tick 3 although 0.003 * 1000 is not 3
  return static_cast<std::int64_t>(std::floor(end_time() * static_cast<double>(rate_) + rounding)) + 1;
}

DeviceNews ScriptDevice::poll(const TickTime& tick) noexcept {
  const auto rate = static_cast<double>(rate_);
  DeviceNews news;
  news.state.pose = pose(static_cast<double>(tick.number) / rate);
  if (tick.number > 0) {
    const Vec3 before = pose(static_cast<double>(tick.number - 1) / rate).position;
    news.state.velocity = rate * (news.state.pose.position - before);
  }
  news.state.buttons = news.state.pose.grab ? 1 : 0;
  news.state.arrived = tick.due;
  news.state.sequence = static_cast<std::uint32_t>(tick.number + 1);
  return news;
}

}  // namespace palpate
