// Tables of a device profile: values by key, every failure with its line and column.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// One table of a profile, "[arm]"; that of the whole file is "". What is missing, of another type or out of
/// range throws Error. Does not own the table.
class ProfileTable {
 public:
  /// Throws Error when the table holds a key that is not in `known`.
  ProfileTable(const toml::table& table, std::string title, const std::string& file,
               const std::vector<std::string_view>& known);

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  [[nodiscard]] std::string text(std::string_view key) const;
  [[nodiscard]] double number(std::string_view key, double least, double largest) const;
  [[nodiscard]] double positive(std::string_view key) const;
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t least, std::int64_t largest) const;
  /// `size` of them.
  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t size) const;
  [[nodiscard]] std::vector<double> positives(std::string_view key, std::size_t size) const;
  [[nodiscard]] std::vector<std::int64_t> integers(std::string_view key, std::size_t size, std::int64_t least,
                                                   std::int64_t largest) const;
  [[nodiscard]] std::vector<bool> booleans(std::string_view key, std::size_t size) const;
  [[nodiscard]] Vec3 vector(std::string_view key) const;
  [[nodiscard]] Vec3 positive_vector(std::string_view key) const;

  [[nodiscard]] ProfileTable table(std::string_view key, const std::vector<std::string_view>& known) const;
  /// The tables of a list [[key]], at least one.
  [[nodiscard]] std::vector<ProfileTable> tables(std::string_view key,
                                                 const std::vector<std::string_view>& known) const;

  /// Throws Error that points at the value of `key`, or at the table where there is none.
  [[noreturn]] void fail(std::string_view key, const std::string& what, const std::string& hint) const;

 private:
  [[nodiscard]] const toml::node& required(std::string_view key) const;
  [[nodiscard]] const toml::array& list(std::string_view key, std::size_t size, const std::string& of) const;
  [[nodiscard]] double as_number(const toml::node& node, std::string_view key) const;
  [[nodiscard]] std::int64_t as_integer(const toml::node& node, std::string_view key, std::int64_t least,
                                        std::int64_t largest) const;
  [[nodiscard]] std::string name_of(std::string_view key) const;
  [[noreturn]] void fail_at(const toml::node& node, const std::string& what, const std::string& hint) const;

  const toml::table& table_;
  std::string title_;
  const std::string& file_;
};

}  // namespace palpate
