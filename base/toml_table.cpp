#include "base/toml_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/spelling.h"

namespace palpate {
namespace {

/// A count in words: "two numbers".
std::string some(std::size_t size, const std::string& things) {
  constexpr std::array words = {"no", "one", "two", "three", "four", "five", "six"};
  return std::string(words.at(size)) + " " + things;
}

bool holds(const Keys& keys, std::string_view key) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

}  // namespace

std::string quoted_choice(const Keys& keys) {
  std::string text;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    text += (i == 0 ? "\"" : i + 1 == keys.size() ? " or \"" : ", \"") + std::string(keys[i]) + "\"";
  }
  return text;
}

TomlTable::TomlTable(const toml::table& table, std::string title, const std::string& file, const Keys& known)
    : table_(table), title_(std::move(title)), file_(file) {
  for (const auto& [key, value] : table_) {
    if (holds(known, key.str())) continue;
    const std::string word = shortened(key.str());
    throw Error(
        "unknown key \"" + word + "\"" + (title_.empty() ? "" : " in " + title_), place(key.source().begin),
        "the nearest known key is \"" + std::string(nearest(word, known)) + "\" of " + comma_list(known));
  }
}

std::string_view TomlTable::at_most_one_of(const Keys& kinds) const {
  std::string_view found;
  for (const std::string_view kind : kinds) {
    if (!has(kind)) continue;
    if (!found.empty()) {
      fail(kind, title_ + " has both " + std::string(found) + " and " + std::string(kind),
           "keep one of them");
    }
    found = kind;
  }
  return found;
}

std::string_view TomlTable::only_one_of(const Keys& kinds) const {
  const std::string_view found = at_most_one_of(kinds);
  if (found.empty()) fail("", title_ + " has none of " + comma_list(kinds), "give one of them");
  return found;
}

double TomlTable::number(std::string_view key) const {
  return as_number(required(key), key);
}

double TomlTable::number(std::string_view key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

double TomlTable::positive(std::string_view key) const {
  const double value = number(key);
  if (!(value > 0.0)) {
    fail(key, name_of(key) + " must be greater than 0, not " + shown(value), "give a positive number");
  }
  return value;
}

double TomlTable::positive(std::string_view key, double fallback) const {
  return has(key) ? positive(key) : fallback;
}

double TomlTable::within(std::string_view key, double low, double high) const {
  const double value = number(key);
  if (value < low || value > high) {
    fail(key, name_of(key) + " must be from " + shown(low) + " to " + shown(high) + ", not " + shown(value),
         "choose a value in that range");
  }
  return value;
}

double TomlTable::within(std::string_view key, double low, double high, double fallback) const {
  return has(key) ? within(key, low, high) : fallback;
}

std::int32_t TomlTable::integer(std::string_view key, std::int32_t low, std::int32_t high) const {
  return as_integer(required(key), key, low, high);
}

std::int32_t TomlTable::integer(std::string_view key, std::int32_t low, std::int32_t high,
                                std::int32_t fallback) const {
  return has(key) ? integer(key, low, high) : fallback;
}

bool TomlTable::boolean(std::string_view key, bool fallback) const {
  if (!has(key)) return fallback;
  const auto value = required(key).value_exact<bool>();
  if (!value) wrong_type(required(key), key, "true or false");
  return *value;
}

std::string TomlTable::text(std::string_view key) const {
  const auto value = required(key).value_exact<std::string>();
  if (!value) wrong_type(required(key), key, "a text in quotes");
  return *value;
}

std::string TomlTable::choice(std::string_view key, const Keys& choices) const {
  std::string value = text(key);
  if (!holds(choices, value)) {
    fail(key, name_of(key) + " is \"" + shortened(value) + "\"", "use " + quoted_choice(choices));
  }
  return value;
}

std::vector<std::string> TomlTable::choices(std::string_view key, const Keys& choices) const {
  std::vector<std::string> result;
  for (const toml::node& node : array(key, "a list of texts")) {
    const auto value = node.value_exact<std::string>();
    if (!value) wrong_type(node, key, "[a list of texts]");
    if (!holds(choices, *value)) {
      const std::string word = shortened(*value);
      fail_at(node, name_of(key) + " holds \"" + word + "\"",
              choices.size() == 1 ? "it can hold " + quoted_choice(choices) + " only"
                                  : "the nearest known is \"" + std::string(nearest(word, choices)) +
                                        "\" of " + comma_list(choices));
    }
    result.push_back(*value);
  }
  return result;
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t size) const {
  std::vector<double> result;
  for (const toml::node& node : array(key, some(size, "numbers"), size)) {
    result.push_back(as_number(node, key));
  }
  return result;
}

std::vector<double> TomlTable::positives(std::string_view key, std::size_t size) const {
  std::vector<double> result = numbers(key, size);
  for (const double value : result) {
    if (!(value > 0.0)) {
      fail(key, name_of(key) + " must be greater than 0, not " + shown(value), "give positive numbers");
    }
  }
  return result;
}

Eigen::Vector3d TomlTable::vector(std::string_view key, int dimension, const std::string& hint) const {
  const auto size = static_cast<std::size_t>(dimension);
  const toml::array* given = required(key).as_array();
  if (!hint.empty() && (given == nullptr || given->size() != size)) {
    fail(key, name_of(key) + " must be [" + some(size, "numbers") + "]", hint);
  }
  const std::vector<double> values = numbers(key, size);
  return {values[0], values[1], dimension == 3 ? values[2] : 0.0};
}

Eigen::Vector3d TomlTable::positive_vector(std::string_view key, int dimension) const {
  const std::vector<double> values = positives(key, static_cast<std::size_t>(dimension));
  return {values[0], values[1], dimension == 3 ? values[2] : 0.0};
}

std::vector<Eigen::Vector3d> TomlTable::points(std::string_view key) const {
  return as_points(required(key), key);
}

std::vector<std::vector<Eigen::Vector3d>> TomlTable::point_lists(std::string_view key) const {
  std::vector<std::vector<Eigen::Vector3d>> result;
  for (const toml::node& list : array(key, "lists of points")) {
    result.push_back(as_points(list, key));
  }
  return result;
}

std::vector<std::int32_t> TomlTable::integers(std::string_view key, std::size_t size, std::int32_t low,
                                              std::int32_t high) const {
  std::vector<std::int32_t> result;
  for (const toml::node& value : array(key, some(size, "whole numbers"), size)) {
    result.push_back(as_integer(value, key, low, high));
  }
  return result;
}

std::vector<std::int32_t> TomlTable::integers(std::string_view key) const {
  std::vector<std::int32_t> result;
  for (const toml::node& value : array(key, "a list of whole numbers")) {
    result.push_back(as_integer(value, key, least_integer, largest_integer));
  }
  if (result.empty()) fail(key, name_of(key) + " is empty", "list at least one number");
  return result;
}

std::pair<std::vector<std::int32_t>, std::vector<std::string>> TomlTable::integers_and_texts(
    std::string_view key) const {
  std::pair<std::vector<std::int32_t>, std::vector<std::string>> result;
  for (const toml::node& value : array(key, "a list of whole numbers and texts")) {
    if (const auto text = value.value_exact<std::string>()) {
      result.second.push_back(*text);
    } else {
      result.first.push_back(as_integer(value, key, least_integer, largest_integer));
    }
  }
  if (result.first.empty() && result.second.empty())
    fail(key, name_of(key) + " is empty", "list at least one number or name");
  return result;
}

std::vector<bool> TomlTable::booleans(std::string_view key, std::size_t size) const {
  const std::string expected = some(size, "of true or false");
  std::vector<bool> result;
  for (const toml::node& node : array(key, expected, size)) {
    const auto value = node.value_exact<bool>();
    if (!value) wrong_type(node, key, "[" + expected + "]");
    result.push_back(*value);
  }
  return result;
}

TomlTable TomlTable::table(std::string_view key, const Keys& known) const {
  const toml::node& node = required(key);
  if (!node.is_table()) wrong_type(node, key, "a table {" + comma_list(known) + "}");
  return {*node.as_table(), title_.empty() ? "[" + std::string(key) + "]" : name_of(key), file_, known};
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, const Keys& known,
                                         const std::string& hint) const {
  const toml::array* entries = required(key).as_array();
  if (entries == nullptr || entries->empty()) {
    fail(key, name_of(key) + " must be a list of at least one table", hint);
  }
  // "[overlay]" and "region" make "[[overlay.region]]".
  const std::string path =
      (title_.empty() ? "" : title_.substr(1, title_.size() - 2) + ".") + std::string(key);
  std::vector<TomlTable> result;
  for (const toml::node& entry : *entries) {
    if (!entry.is_table()) fail_at(entry, "every entry of " + name_of(key) + " must be a table", hint);
    result.emplace_back(*entry.as_table(), "[[" + path + "]]", file_, known);
  }
  return result;
}

void TomlTable::fail(std::string_view key, const std::string& what, const std::string& hint) const {
  throw Error(what, place_of(key), hint);
}

std::string TomlTable::place_of(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return place((node != nullptr ? *node : table_).source().begin);
}

std::string TomlTable::name_of(std::string_view key) const {
  return (title_.empty() ? "" : title_ + " ") + std::string(key);
}

std::string TomlTable::place(const toml::source_position& at) const {
  return at.line == 0 ? file_ : file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
}

void TomlTable::fail_at(const toml::node& node, const std::string& what, const std::string& hint) const {
  throw Error(what, place(node.source().begin), hint);
}

void TomlTable::wrong_type(const toml::node& node, std::string_view key, const std::string& expected) const {
  fail_at(node, name_of(key) + " must be " + expected, "write " + std::string(key) + " = " + expected);
}

const toml::node& TomlTable::required(std::string_view key) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    fail(key, name_of(key) + " is missing",
         title_.empty() ? "add it at the top level" : "add it to " + title_);
  }
  return *node;
}

const toml::array& TomlTable::array(std::string_view key, const std::string& expected,
                                    std::size_t size) const {
  const toml::array* values = required(key).as_array();
  if (values == nullptr || (size != 0 && values->size() != size)) {
    wrong_type(required(key), key, "[" + expected + "]");
  }
  return *values;
}

double TomlTable::as_number(const toml::node& node, std::string_view key) const {
  const auto value = node.value<double>();
  if (!value || !node.is_number()) wrong_type(node, key, "a number");
  if (!std::isfinite(*value)) {
    fail_at(node, name_of(key) + " is not a finite number", "replace nan or inf by a number");
  }
  return *value;
}

std::int32_t TomlTable::as_integer(const toml::node& node, std::string_view key, std::int32_t low,
                                   std::int32_t high) const {
  const auto value = node.value_exact<std::int64_t>();
  if (!value) wrong_type(node, key, "a whole number");
  if (*value >= low && *value <= high) return static_cast<std::int32_t>(*value);
  const std::string given = std::to_string(*value);
  if (*value < least_integer || *value > largest_integer) {
    fail_at(node, name_of(key) + " is out of range: " + given, "whole numbers here have 32 bits");
  }
  if (high == largest_integer) {
    fail_at(node, name_of(key) + " must be at least " + std::to_string(low) + ", not " + given,
            "give a larger whole number");
  }
  fail_at(node,
          name_of(key) + " must be from " + std::to_string(low) + " to " + std::to_string(high) + ", not " +
              given,
          "choose a value in that range");
}

std::vector<Eigen::Vector3d> TomlTable::as_points(const toml::node& node, std::string_view key) const {
  const std::string expected = "a list of at least three points [x, y]";
  const toml::array* list = node.as_array();
  if (list == nullptr || list->size() < 3) wrong_type(node, key, expected);
  std::vector<Eigen::Vector3d> result;
  for (const toml::node& point : *list) {
    const toml::array* pair = point.as_array();
    if (pair == nullptr || pair->size() != 2) wrong_type(point, key, expected);
    result.emplace_back(as_number((*pair)[0], key), as_number((*pair)[1], key), 0.0);
  }
  return result;
}

}  // namespace palpate
