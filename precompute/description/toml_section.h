// Tables of a TOML file: values by key, every failure with its line and column.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>
#include <vector>

#include "base/words.h"
#include "meshes/mesh.h"

namespace palpate {

using Keys = std::vector<std::string_view>;

/// `"a", "b" or "c"`.
std::string quoted_choice(const Keys& keys);

/// One table of a TOML file. Its title is as a person would write it, "[mesh]"; that of the whole file is "".
/// Values that are missing or of another type or range throw Error. Does not own the table.
class Section {
 public:
  /// Throws Error when the table holds a key that is not in `known`.
  Section(const toml::table& table, std::string title, const std::string& file, const Keys& known);

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  /// The one key of `kinds` that is present, empty when none is.
  [[nodiscard]] std::string_view at_most_one_of(const Keys& kinds) const;
  [[nodiscard]] std::string_view only_one_of(const Keys& kinds) const;

  [[nodiscard]] double number(std::string_view key) const;
  [[nodiscard]] double number(std::string_view key, double fallback) const;
  [[nodiscard]] double positive(std::string_view key) const;
  [[nodiscard]] double positive(std::string_view key, double fallback) const;
  [[nodiscard]] double within(std::string_view key, double low, double high, double fallback) const;
  [[nodiscard]] Index integer(std::string_view key) const;
  /// A whole number from 1.
  [[nodiscard]] int count(std::string_view key) const;
  [[nodiscard]] bool boolean(std::string_view key, bool fallback) const;
  [[nodiscard]] std::string text(std::string_view key) const;
  /// One of the given texts.
  [[nodiscard]] std::string choice(std::string_view key, const Keys& choices) const;
  /// A list of some of the given texts.
  [[nodiscard]] std::vector<std::string> choices(std::string_view key, const Keys& choices) const;

  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t size) const;
  /// `dimension` numbers; the others are 0.
  [[nodiscard]] Vec3 vector(std::string_view key, int dimension) const;
  [[nodiscard]] Vec3 vector(std::string_view key, int dimension, const Vec3& fallback) const;
  [[nodiscard]] Vec3 positive_vector(std::string_view key, int dimension) const;
  /// A list of pairs of numbers, as vectors in the plane.
  [[nodiscard]] std::vector<Vec3> points(std::string_view key) const;
  /// A list of such lists.
  [[nodiscard]] std::vector<std::vector<Vec3>> point_lists(std::string_view key) const;
  /// `size` whole numbers from 1.
  [[nodiscard]] std::vector<int> counts(std::string_view key, std::size_t size) const;
  /// A list of at least one whole number.
  [[nodiscard]] std::vector<Index> integers(std::string_view key) const;

  [[nodiscard]] Section section(std::string_view key, const Keys& known) const;
  /// The tables of a list [[key]]; `hint` says what else to write where there are none.
  [[nodiscard]] std::vector<Section> sections(std::string_view key, const Keys& known,
                                              const std::string& hint) const;
  [[nodiscard]] bool is_table(std::string_view key) const { return table_[key].is_table(); }

  /// Throws Error that points at the value of `key`; at the table itself where it is empty or absent.
  [[noreturn]] void fail(std::string_view key, const std::string& what, const std::string& hint) const;
  /// File, line and column of the value of `key`; of the table itself where it is empty or absent.
  [[nodiscard]] std::string place_of(std::string_view key) const;
  /// "[mesh] grading".
  [[nodiscard]] std::string name_of(std::string_view key) const;

 private:
  [[nodiscard]] std::string place(const toml::node& node) const;
  [[noreturn]] void wrong_type(const toml::node& node, std::string_view key,
                               const std::string& expected) const;
  [[nodiscard]] const toml::node& required(std::string_view key) const;
  [[nodiscard]] double as_number(const toml::node& node, std::string_view key) const;
  [[nodiscard]] Index as_integer(const toml::node& node, std::string_view key) const;
  [[nodiscard]] int as_count(const toml::node& node, std::string_view key) const;
  [[nodiscard]] std::vector<Vec3> as_points(const toml::node& node, std::string_view key) const;
  /// `size` 0 is any size.
  [[nodiscard]] const toml::array& array(std::string_view key, const std::string& expected,
                                         std::size_t size) const;

  const toml::table& table_;
  std::string title_;
  const std::string& file_;
};

}  // namespace palpate
