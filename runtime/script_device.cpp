#include "runtime/script_device.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "meshes/error.h"
#include "runtime/numbers.h"

namespace palpate {
namespace {

constexpr double longest_script = 24.0 * 3600.0;  // s
const std::string header_hint = "write the columns t,x,y,z or t,x,y,z,grab (seconds, metres, 0 or 1)";

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

/// Number of columns that the header promises.
std::size_t read_header(std::string_view line, const std::string& where) {
  const std::vector<std::string_view> names = split_commas(line);
  const std::vector<std::string_view> expected = {"t", "x", "y", "z", "grab"};
  const bool known =
      (names.size() == 4 || names.size() == 5) && std::equal(names.begin(), names.end(), expected.begin());
  if (!known) throw Error("is not a header of a script", where, header_hint);
  return names.size();
}

}  // namespace

ScriptDevice ScriptDevice::read(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.is_open() || stream.bad())
    throw Error("cannot be read", file.string(), "check the name after 'script:'");
  return parse(text, file.string());
}

ScriptDevice ScriptDevice::parse(std::string_view text, const std::string& name) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());

  ScriptDevice device;
  std::size_t columns = 0;
  for (int line_number = 1; !text.empty(); ++line_number) {
    const std::string_view line = next_line(text);
    const std::string where = name + ":" + std::to_string(line_number);
    if (is_blank(line)) continue;
    if (columns == 0) {
      columns = read_header(line, where);
      continue;
    }

    const std::vector<std::string_view> fields = split_commas(line);
    if (fields.size() != columns) {
      throw Error(
          "has " + std::to_string(fields.size()) + " fields where the header has " + std::to_string(columns),
          where, "give each row a value for each column");
    }
    std::vector<double> values;
    for (const std::string_view field : fields) {
      const std::optional<double> value = parse_number(field);
      if (!value) throw Error("'" + std::string(field) + "' is not a finite number", where, header_hint);
      values.push_back(*value);
    }
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
    if (columns == 5 && values[4] != 0.0 && values[4] != 1.0) {
      throw Error("grab is '" + std::string(fields[4]) + "'", where, "write 1 while the tool holds, else 0");
    }
    device.rows_.push_back({t, Vec3(values[1], values[2], values[3]), columns == 4 || values[4] == 1.0});
  }
  if (device.rows_.empty()) throw Error("has no rows", name, header_hint);
  return device;
}

ToolPose ScriptDevice::pose(double t) const noexcept {
  const auto after = std::upper_bound(rows_.begin(), rows_.end(), t,
                                      [](double time, const Row& row) { return time < row.t; });
  ToolPose pose;
  if (after == rows_.begin()) {
    pose.position = rows_.front().position;
    return pose;
  }
  const Row& row = *(after - 1);
  pose.position = row.position;
  pose.grab = row.grab;
  if (after != rows_.end()) {
    pose.position += (t - row.t) / (after->t - row.t) * (after->position - row.position);
  }
  return pose;
}

}  // namespace palpate
