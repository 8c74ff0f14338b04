#include "runtime/devices/reports/profile_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/words.h"

namespace palpate {
ProfileTable::ProfileTable(const toml::table& table, std::string title, const std::string& file,
                           const std::vector<std::string_view>& known)
    : table_(table), title_(std::move(title)), file_(file) {
  for (const auto& [key, value] : table_) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    const toml::source_position at = key.source().begin;
    const std::string word = shortened(key.str());
    const std::string in = title_.empty() ? "" : " in " + title_;
    throw Error("unknown key \"" + word + "\"" + in,
                file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
                known.empty() ? "remove it"
                              : "the nearest known key is \"" + std::string(nearest(word, known)) + "\" of " +
                                    comma_list(known));
  }
}

std::string ProfileTable::text(std::string_view key) const {
  const toml::node& node = required(key);
  const auto value = node.value_exact<std::string>();
  if (!value || value->empty()) {
    fail_at(node, name_of(key) + " must be a text", "write " + std::string(key) + " = \"...\"");
  }
  return *value;
}

double ProfileTable::number(std::string_view key, double least, double largest) const {
  const toml::node& node = required(key);
  const double value = as_number(node, key);
  if (value < least || value > largest) {
    fail_at(
        node,
        name_of(key) + " must be from " + shown(least) + " to " + shown(largest) + ", not " + shown(value),
        "choose a value in that range");
  }
  return value;
}

double ProfileTable::positive(std::string_view key) const {
  const toml::node& node = required(key);
  const double value = as_number(node, key);
  if (!(value > 0.0)) {
    fail_at(node, name_of(key) + " must be greater than 0, not " + shown(value), "give a positive number");
  }
  return value;
}

std::int64_t ProfileTable::integer(std::string_view key, std::int64_t least, std::int64_t largest) const {
  return as_integer(required(key), key, least, largest);
}

std::vector<double> ProfileTable::numbers(std::string_view key, std::size_t size) const {
  std::vector<double> result;
  for (const toml::node& node : list(key, size, "numbers")) {
    result.push_back(as_number(node, key));
  }
  return result;
}

std::vector<double> ProfileTable::positives(std::string_view key, std::size_t size) const {
  std::vector<double> result = numbers(key, size);
  for (const double value : result) {
    if (!(value > 0.0)) {
      fail(key, name_of(key) + " must be greater than 0, not " + shown(value), "give positive numbers");
    }
  }
  return result;
}

std::vector<std::int64_t> ProfileTable::integers(std::string_view key, std::size_t size, std::int64_t least,
                                                 std::int64_t largest) const {
  std::vector<std::int64_t> result;
  for (const toml::node& node : list(key, size, "whole numbers")) {
    result.push_back(as_integer(node, key, least, largest));
  }
  return result;
}

std::vector<bool> ProfileTable::booleans(std::string_view key, std::size_t size) const {
  std::vector<bool> result;
  for (const toml::node& node : list(key, size, "of true or false")) {
    const auto value = node.value_exact<bool>();
    if (!value) fail_at(node, name_of(key) + " must hold true or false", "write true or false");
    result.push_back(*value);
  }
  return result;
}

Vec3 ProfileTable::vector(std::string_view key) const {
  const std::vector<double> values = numbers(key, 3);
  return {values[0], values[1], values[2]};
}

Vec3 ProfileTable::positive_vector(std::string_view key) const {
  const std::vector<double> values = positives(key, 3);
  return {values[0], values[1], values[2]};
}

ProfileTable ProfileTable::table(std::string_view key, const std::vector<std::string_view>& known) const {
  const toml::node& node = required(key);
  if (!node.is_table()) {
    fail_at(node, name_of(key) + " must be a table",
            "write [" + std::string(key) + "] with " + comma_list(known));
  }
  return {*node.as_table(), "[" + std::string(key) + "]", file_, known};
}

std::vector<ProfileTable> ProfileTable::tables(std::string_view key,
                                               const std::vector<std::string_view>& known) const {
  const toml::node& node = required(key);
  const std::string title = "[[" + std::string(key) + "]]";
  const std::string hint = "write " + title + " with some of " + comma_list(known);
  const toml::array* entries = node.as_array();
  if (entries == nullptr || entries->empty()) fail_at(node, name_of(key) + " must be a list of tables", hint);
  std::vector<ProfileTable> result;
  for (const toml::node& entry : *entries) {
    if (!entry.is_table()) fail_at(entry, name_of(key) + " must be a list of tables", hint);
    result.emplace_back(*entry.as_table(), title, file_, known);
  }
  return result;
}

void ProfileTable::fail(std::string_view key, const std::string& what, const std::string& hint) const {
  const toml::node* node = table_.get(key);
  fail_at(node != nullptr ? *node : table_, what, hint);
}

const toml::node& ProfileTable::required(std::string_view key) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    fail(key, name_of(key) + " is missing",
         title_.empty() ? "add it at the top of the file" : "add it to " + title_);
  }
  return *node;
}

const toml::array& ProfileTable::list(std::string_view key, std::size_t size, const std::string& of) const {
  const toml::node& node = required(key);
  const toml::array* values = node.as_array();
  if (values == nullptr || values->size() != size) {
    fail_at(node, name_of(key) + " must be a list of " + std::to_string(size) + " " + of,
            "write " + std::string(key) + " = [...] with " + std::to_string(size) + " of them");
  }
  return *values;
}

double ProfileTable::as_number(const toml::node& node, std::string_view key) const {
  const auto value = node.value<double>();
  if (!value || !node.is_number() || !std::isfinite(*value)) {
    fail_at(node, name_of(key) + " must be a finite number", "write a number, such as 0.05");
  }
  return *value;
}

std::int64_t ProfileTable::as_integer(const toml::node& node, std::string_view key, std::int64_t least,
                                      std::int64_t largest) const {
  const auto value = node.value_exact<std::int64_t>();
  const std::string range = std::to_string(least) + " to " + std::to_string(largest);
  if (!value) fail_at(node, name_of(key) + " must be a whole number", "write one from " + range);
  if (*value < least || *value > largest) {
    fail_at(node, name_of(key) + " must be from " + range + ", not " + std::to_string(*value),
            "choose a value in that range");
  }
  return *value;
}

std::string ProfileTable::name_of(std::string_view key) const {
  return (title_.empty() ? "" : title_ + " ") + std::string(key);
}

void ProfileTable::fail_at(const toml::node& node, const std::string& what, const std::string& hint) const {
  const toml::source_position at = node.source().begin;
  throw Error(what,
              at.line == 0 ? file_ : file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
              hint);
}

}  // namespace palpate
