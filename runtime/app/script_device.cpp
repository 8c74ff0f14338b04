#include "runtime/app/script_device.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
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
    "name the columns t,x,y,z[,qw,qx,qy,qz][,grab] in the first line (seconds, metres, a quaternion, 0 or 1)";

constexpr std::array<std::string_view, 9> script_columns = {"t",  "x",  "y",  "z",   "qw",
                                                            "qx", "qy", "qz", "grab"};
constexpr std::size_t place_columns = 4, first_turn_column = 4,
                      grab_column = 8;  // number of columns, and first columns of the optional ones

/// Positions of the known columns in a table; an absent one is empty.
struct Columns {
  char separator = ',';
  std::array<std::optional<std::size_t>, script_columns.size()> places{};
  std::size_t count = 0;
  std::vector<std::string> unread{};
  std::string twice{};  // name of a duplicate column; empty if none
};

/// Removes the next line from the front of `text`.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + (text.substr(end).starts_with("\r\n") ? 2 : 1), text.size()));
  return line;
}

/// Returns the fields of a line, without surrounding spaces and quotes; the separator ' ' is any number of
/// blanks.
std::vector<std::string> split_fields(std::string_view line, char separator) {
  std::vector<std::string> fields(1);
  char quote = '\0';
  bool was_quoted = false;
  for (const char c : line) {
    if (quote != '\0') {
      if (c == quote) {
        quote = '\0';
      } else {
        fields.back() += c;
      }
    } else if ((c == '"' || c == '\'') && fields.back().empty() && !was_quoted) {
      quote = c;
      was_quoted = true;
    } else if (c == separator || (separator == ' ' && c == '\t')) {
      if (separator != ' ' || !fields.back().empty()) fields.emplace_back();
      was_quoted = false;
    } else if (c != ' ' || !fields.back().empty()) {
      fields.back() += c;
    }
  }
  for (std::string& field : fields) field.erase(field.find_last_not_of(" \t") + 1);
  if (separator == ' ' && fields.back().empty()) fields.pop_back();
  return fields;
}

char separator_of(std::string_view header) {
  for (const char separator : {';', '\t', ','})
    if (header.find(separator) != std::string_view::npos) return separator;
  return ' ';
}

/// Returns the columns by name, in any order and case.
Columns read_header(std::string_view line) {
  Columns columns{.separator = separator_of(line)};
  for (std::string& name : split_fields(line, columns.separator)) {
    std::string small = name;
    for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const auto place = static_cast<std::size_t>(
        std::find(script_columns.begin(), script_columns.end(), small) - script_columns.begin());
    if (place == script_columns.size()) {
      if (!name.empty()) columns.unread.push_back(std::move(name));
    } else if (columns.places[place]) {
      columns.twice = small;
    } else {
      columns.places[place] = columns.count;
    }
    ++columns.count;
  }
  return columns;
}

/// Returns the missing columns: required ones and, if any part of a quaternion is present, the rest of it.
std::string missing_columns(const Columns& columns) {
  const auto there = [&](std::size_t place) { return columns.places[place].has_value(); };
  const bool turns = there(4) || there(5) || there(6) || there(7);
  std::string names;
  for (std::size_t place = 0; place < (turns ? grab_column : place_columns); ++place)
    if (!there(place)) names += (names.empty() ? "" : ", ") + std::string(script_columns[place]);
  return names;
}

/// Parses a number with a decimal point or, unless commas separate fields, a decimal comma.
double read_number(const std::string& text, const std::string& where) {
  std::string with_point = text;
  if (with_point.find('.') == std::string::npos) std::replace(with_point.begin(), with_point.end(), ',', '.');
  const std::optional<double> number = parse_number(with_point);
  if (!number) throw Error("'" + text + "' is not a finite number", where, header_hint);
  return *number;
}

/// Returns the rotation of a quaternion w, x, y, z of any length except 0.
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

/// Returns the values of a row in the known columns; 0 for absent ones.
std::array<double, script_columns.size()> read_row(std::string_view line, const Columns& columns,
                                                   const std::string& where) {
  std::vector<std::string> fields = split_fields(line, columns.separator);
  while (fields.size() > columns.count && fields.back().empty()) fields.pop_back();
  if (fields.size() != columns.count) {
    throw Error(fmt::format("has {} fields where the header has {}", fields.size(), columns.count), where,
                "give each row a value for each column; decimal commas need semicolons between the columns");
  }
  std::array<double, script_columns.size()> values{};
  for (std::size_t k = 0; k < script_columns.size(); ++k)
    if (columns.places[k]) values[k] = read_number(fields[*columns.places[k]], where);
  return values;
}

ToolPose read_pose(std::span<const double, script_columns.size()> values, const Columns& columns,
                   const std::string& where) {
  ToolPose pose;
  pose.position = Vec3(values[1], values[2], values[3]);
  if (columns.places[first_turn_column])
    pose.orientation = read_orientation(values.subspan<first_turn_column, 4>(), where);
  if (values[grab_column] != 0.0 && values[grab_column] != 1.0)
    throw Error(fmt::format("grab is {}", values[grab_column]), where,
                "write 1 while the tool holds, else 0");
  pose.grab = values[grab_column] == 1.0;
  return pose;
}

/// True for lines that loggers and spreadsheets write beside the table. A comment that names the columns is
/// the header.
bool is_comment(std::string_view line, bool has_header) {
  if (line.starts_with("sep=")) return true;
  if (line.front() != '#') return false;
  return has_header || !missing_columns(read_header(line.substr(1))).empty();
}

}  // namespace

ScriptDevice ScriptDevice::read(const std::filesystem::path& file) {
  return parse(read_all(file, "check the name after 'script:'"), file.string());
}

ScriptDevice ScriptDevice::parse(std::string_view text, const std::string& name) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());

  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw Error("is text of UTF-16", name, "save it as CSV in UTF-8");

  ScriptDevice device;
  std::optional<Columns> columns;
  for (int line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = next_line(text);
    const std::string where = name + ":" + std::to_string(line_number);
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (line.empty() || is_comment(line, columns.has_value())) continue;
    if (!columns) {
      columns = read_header(line.substr(line.front() == '#' ? 1 : 0));
      if (!columns->twice.empty())
        throw Error(fmt::format("the header names the column {} twice", columns->twice), where, header_hint);
      if (const std::string names = missing_columns(*columns); !names.empty())
        throw Error("the header names no column " + names, where, header_hint);
      device.unread_ = columns->unread;
      continue;
    }
    const std::array<double, script_columns.size()> values = read_row(line, *columns, where);
    const double t = values[0];
    if (t < 0.0 || (!device.rows_.empty() && t <= device.rows_.back().t)) {
      throw Error(fmt::format("the time {} s is not after the one before it", t), where,
                  "order the rows by time, from 0 on, each time once");
    }
    if (t > longest_script)
      throw Error(fmt::format("the time {} s is more than a day", t), where, "give times in seconds");
    device.rows_.push_back({t, read_pose(values, *columns, where)});
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
  constexpr double rounding = 1e-6;  // fraction of a tick: 0.003 s is tick 3 although 0.003 * 1000 is not 3
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
