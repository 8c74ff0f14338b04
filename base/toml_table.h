// Tables of a TOML file: values by key, every failure with its line and column.
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/words.h"

namespace palpate {

using Keys = std::vector<std::string_view>;

/// Keys as a message lists them: `"a", "b" or "c"`.
std::string quoted_choice(const Keys& keys);

/// One table of a TOML file. Its title is as written there, "[mesh]"; that of the whole file is "". Values
/// that are missing, of the wrong type or out of range throw Error, and so do numbers that are not finite.
/// Does not own the table.
class TomlTable {
 public:
  static constexpr std::int32_t least_integer = std::numeric_limits<std::int32_t>::min();
  static constexpr std::int32_t largest_integer = std::numeric_limits<std::int32_t>::max();

  /// Throws Error when the table holds a key that is not in `known`.
  TomlTable(const toml::table& table, std::string title, const std::string& file, const Keys& known);

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  [[nodiscard]] bool is_table(std::string_view key) const { return table_[key].is_table(); }
  /// The one key of `kinds` that is present, empty when none is.
  [[nodiscard]] std::string_view at_most_one_of(const Keys& kinds) const;
  [[nodiscard]] std::string_view only_one_of(const Keys& kinds) const;

  [[nodiscard]] double number(std::string_view key) const;
  [[nodiscard]] double number(std::string_view key, double fallback) const;
  [[nodiscard]] double positive(std::string_view key) const;
  [[nodiscard]] double positive(std::string_view key, double fallback) const;
  [[nodiscard]] double within(std::string_view key, double low, double high) const;
  [[nodiscard]] double within(std::string_view key, double low, double high, double fallback) const;
  [[nodiscard]] std::int32_t integer(std::string_view key, std::int32_t low = least_integer,
                                     std::int32_t high = largest_integer) const;
  [[nodiscard]] std::int32_t integer(std::string_view key, std::int32_t low, std::int32_t high,
                                     std::int32_t fallback) const;
  /// A whole number from 1.
  [[nodiscard]] std::int32_t count(std::string_view key) const { return integer(key, 1); }
  [[nodiscard]] bool boolean(std::string_view key, bool fallback) const;
  [[nodiscard]] std::string text(std::string_view key) const;
  /// A text that must be one of `choices`.
  [[nodiscard]] std::string choice(std::string_view key, const Keys& choices) const;
  /// A list of texts, each one of `choices`.
  [[nodiscard]] std::vector<std::string> choices(std::string_view key, const Keys& choices) const;

  /// List of `size` numbers (1 to 6).
  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t size) const;
  [[nodiscard]] std::vector<double> positives(std::string_view key, std::size_t size) const;
  /// List of `dimension` numbers (2 or 3) as a vector, other components 0. `hint` is for a list of another
  /// length.
  [[nodiscard]] Eigen::Vector3d vector(std::string_view key, int dimension,
                                       const std::string& hint = {}) const;
  [[nodiscard]] Eigen::Vector3d positive_vector(std::string_view key, int dimension) const;
  /// A list of at least three pairs of numbers, as vectors in the plane.
  [[nodiscard]] std::vector<Eigen::Vector3d> points(std::string_view key) const;
  /// A list of lists of at least three pairs of numbers.
  [[nodiscard]] std::vector<std::vector<Eigen::Vector3d>> point_lists(std::string_view key) const;
  /// List of `size` whole numbers (1 to 6).
  [[nodiscard]] std::vector<std::int32_t> integers(std::string_view key, std::size_t size, std::int32_t low,
                                                   std::int32_t high = largest_integer) const;
  /// A list of at least one whole number.
  [[nodiscard]] std::vector<std::int32_t> integers(std::string_view key) const;
  /// A list of at least one whole number or text.
  [[nodiscard]] std::pair<std::vector<std::int32_t>, std::vector<std::string>> integers_and_texts(
      std::string_view key) const;
  /// List of `size` truth values (1 to 6).
  [[nodiscard]] std::vector<bool> booleans(std::string_view key, std::size_t size) const;

  [[nodiscard]] TomlTable table(std::string_view key, const Keys& known) const;
  /// Tables of a list [[key]], at least one; `hint` is for a list that is missing or empty.
  [[nodiscard]] std::vector<TomlTable> tables(std::string_view key, const Keys& known,
                                              const std::string& hint) const;

  /// Throws Error located at the value of `key`, or at the table itself if `key` is empty or absent.
  [[noreturn]] void fail(std::string_view key, const std::string& what, const std::string& hint) const;
  /// File, line and column of the value of `key`, or of the table itself if `key` is empty or absent.
  [[nodiscard]] std::string place_of(std::string_view key) const;
  /// Name of a key in messages: "[mesh] grading".
  [[nodiscard]] std::string name_of(std::string_view key) const;

 private:
  [[nodiscard]] std::string place(const toml::source_position& at) const;
  [[noreturn]] void fail_at(const toml::node& node, const std::string& what, const std::string& hint) const;
  [[noreturn]] void wrong_type(const toml::node& node, std::string_view key,
                               const std::string& expected) const;
  [[nodiscard]] const toml::node& required(std::string_view key) const;
  /// List of any size if `size` is 0.
  [[nodiscard]] const toml::array& array(std::string_view key, const std::string& expected,
                                         std::size_t size = 0) const;
  [[nodiscard]] double as_number(const toml::node& node, std::string_view key) const;
  [[nodiscard]] std::int32_t as_integer(const toml::node& node, std::string_view key, std::int32_t low,
                                        std::int32_t high) const;
  [[nodiscard]] std::vector<Eigen::Vector3d> as_points(const toml::node& node, std::string_view key) const;

  const toml::table& table_;
  std::string title_;
  const std::string& file_;
};

}  // namespace palpate
