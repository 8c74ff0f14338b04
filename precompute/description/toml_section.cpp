#include "precompute/description/toml_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace palpate {
namespace {

/// "two numbers".
std::string some(std::size_t size, const std::string& things) {
  constexpr std::array words = {"no", "one", "two", "three", "four", "five", "six"};
  return std::string(words.at(size)) + " " + things;
}

}  // namespace

std::string quoted_choice(const Keys& keys) {
  std::string text;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    text += (i == 0 ? "\"" : i + 1 == keys.size() ? " or \"" : ", \"") + std::string(keys[i]) + "\"";
  }
  return text;
}

Section::Section(const toml::table& table, std::string title, const std::string& file, const Keys& known)
    : table_(table), title_(std::move(title)), file_(file) {
  for (const auto& [key, value] : table_) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
      const toml::source_position at = key.source().begin;
      const std::string word = shortened(key.str());
      throw Error(
          "unknown key \"" + word + "\"" + (title_.empty() ? "" : " in " + title_),
          file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
          "the nearest known key is \"" + std::string(nearest(word, known)) + "\" of " + comma_list(known));
    }
  }
}

std::string_view Section::at_most_one_of(const Keys& kinds) const {
  std::string_view found;
  for (const std::string_view kind : kinds) {
    if (!has(kind)) {
      continue;
    }
    if (!found.empty()) {
      fail(kind, title_ + " has both " + std::string(found) + " and " + std::string(kind),
           "keep one of them");
    }
    found = kind;
  }
  return found;
}

std::string_view Section::only_one_of(const Keys& kinds) const {
  const std::string_view found = at_most_one_of(kinds);
  if (found.empty()) {
    fail("", title_ + " has none of " + comma_list(kinds), "give one of them");
  }
  return found;
}

double Section::number(std::string_view key) const {
  return as_number(required(key), key);
}

double Section::number(std::string_view key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

double Section::positive(std::string_view key) const {
  const double value = number(key);
  if (!(value > 0.0)) {
    fail(key, name_of(key) + " must be greater than 0, not " + shown(value), "give a positive number");
  }
  return value;
}

double Section::positive(std::string_view key, double fallback) const {
  return has(key) ? positive(key) : fallback;
}

double Section::within(std::string_view key, double low, double high, double fallback) const {
  const double value = number(key, fallback);
  if (value < low || value > high) {
    fail(key, name_of(key) + " must be from " + shown(low) + " to " + shown(high) + ", not " + shown(value),
         "choose a value in that range");
  }
  return value;
}

Index Section::integer(std::string_view key) const {
  return as_integer(required(key), key);
}

int Section::count(std::string_view key) const {
  return as_count(required(key), key);
}

bool Section::boolean(std::string_view key, bool fallback) const {
  if (!has(key)) {
    return fallback;
  }
  const auto value = required(key).value_exact<bool>();
  if (!value) {
    wrong_type(required(key), key, "true or false");
  }
  return *value;
}

std::string Section::text(std::string_view key) const {
  const auto value = required(key).value_exact<std::string>();
  if (!value) {
    wrong_type(required(key), key, "a text in quotes");
  }
  return *value;
}

std::string Section::choice(std::string_view key, const Keys& choices) const {
  std::string value = text(key);
  if (std::find(choices.begin(), choices.end(), value) == choices.end()) {
    fail(key, name_of(key) + " is \"" + shortened(value) + "\"", "use " + quoted_choice(choices));
  }
  return value;
}

std::vector<std::string> Section::choices(std::string_view key, const Keys& choices) const {
  std::vector<std::string> result;
  for (const toml::node& node : array(key, "a list of texts", 0)) {
    const auto value = node.value_exact<std::string>();
    if (!value) {
      wrong_type(node, key, "[a list of texts]");
    }
    if (std::find(choices.begin(), choices.end(), *value) == choices.end()) {
      throw Error(name_of(key) + " holds \"" + shortened(*value) + "\"", place(node),
                  choices.size() == 1
                      ? "it can hold " + quoted_choice(choices) + " only"
                      : "the nearest known is \"" + std::string(nearest(shortened(*value), choices)) +
                            "\" of " + comma_list(choices));
    }
    result.push_back(*value);
  }
  return result;
}

std::vector<double> Section::numbers(std::string_view key, std::size_t size) const {
  std::vector<double> result;
  for (const toml::node& node : array(key, some(size, "numbers"), size)) {
    result.push_back(as_number(node, key));
  }
  return result;
}

Vec3 Section::vector(std::string_view key, int dimension) const {
  const toml::array* given = required(key).as_array();
  if (given == nullptr || given->size() != static_cast<std::size_t>(dimension)) {
    fail(key, name_of(key) + " must be " + (dimension == 3 ? "[three numbers]" : "[two numbers]"),
         dimension == 3 ? "in space write " + std::string(key) + " = [x, y, z]; a body in the plane has " +
                              R"(plane = "stress" or "strain" at the top level)"
                        : "in the plane write " + std::string(key) + " = [x, y]");
  }
  const std::vector<double> values = numbers(key, given->size());
  return {values[0], values[1], dimension == 3 ? values[2] : 0.0};
}

Vec3 Section::vector(std::string_view key, int dimension, const Vec3& fallback) const {
  return has(key) ? vector(key, dimension) : fallback;
}

Vec3 Section::positive_vector(std::string_view key, int dimension) const {
  Vec3 value = vector(key, dimension);
  if (!(value.head(dimension).minCoeff() > 0.0)) {
    fail(key, name_of(key) + " must be greater than 0 in each direction", "give positive numbers");
  }
  return value;
}

std::vector<Vec3> Section::points(std::string_view key) const {
  return as_points(required(key), key);
}

std::vector<std::vector<Vec3>> Section::point_lists(std::string_view key) const {
  std::vector<std::vector<Vec3>> result;
  for (const toml::node& list : array(key, "lists of points", 0)) {
    result.push_back(as_points(list, key));
  }
  return result;
}

std::vector<int> Section::counts(std::string_view key, std::size_t size) const {
  std::vector<int> result;
  for (const toml::node& value : array(key, some(size, "whole numbers"), size)) {
    result.push_back(as_count(value, key));
  }
  return result;
}

std::vector<Index> Section::integers(std::string_view key) const {
  std::vector<Index> result;
  for (const toml::node& value : array(key, "a list of whole numbers", 0)) {
    result.push_back(as_integer(value, key));
  }
  if (result.empty()) {
    fail(key, name_of(key) + " is empty", "list at least one number");
  }
  return result;
}

Section Section::section(std::string_view key, const Keys& known) const {
  const toml::node& node = required(key);
  if (!node.is_table()) {
    wrong_type(node, key, "a table {" + comma_list(known) + "}");
  }
  return Section(*node.as_table(), title_.empty() ? std::string("[").append(key).append("]") : name_of(key),
                 file_, known);
}

std::vector<Section> Section::sections(std::string_view key, const Keys& known,
                                       const std::string& hint) const {
  const toml::array* entries = required(key).as_array();
  if (entries == nullptr || entries->empty()) {
    fail(key, name_of(key) + " must be a list of at least one table", hint);
  }
  // "[overlay]" and "region" make "[[overlay.region]]".
  const std::string path =
      (title_.empty() ? "" : title_.substr(1, title_.size() - 2) + ".") + std::string(key);
  std::vector<Section> result;
  for (const toml::node& entry : *entries) {
    if (!entry.is_table()) {
      throw Error("every entry of " + name_of(key) + " must be a table", place(entry), hint);
    }
    result.emplace_back(*entry.as_table(), "[[" + path + "]]", file_, known);
  }
  return result;
}

void Section::fail(std::string_view key, const std::string& what, const std::string& hint) const {
  throw Error(what, place_of(key), hint);
}

std::string Section::place_of(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return place(node != nullptr ? *node : table_);
}

std::string Section::name_of(std::string_view key) const {
  return (title_.empty() ? "" : title_ + " ") + std::string(key);
}

std::string Section::place(const toml::node& node) const {
  const toml::source_position at = node.source().begin;
  return at.line == 0 ? file_ : file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
}

void Section::wrong_type(const toml::node& node, std::string_view key, const std::string& expected) const {
  throw Error(name_of(key) + " must be " + expected, place(node),
              "write " + std::string(key) + " = " + expected);
}

const toml::node& Section::required(std::string_view key) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) {
    fail(key, name_of(key) + " is missing",
         title_.empty() ? "add it at the top level" : "add it to " + title_);
  }
  return *node;
}

double Section::as_number(const toml::node& node, std::string_view key) const {
  const auto value = node.value<double>();
  if (!value || !node.is_number()) {
    wrong_type(node, key, "a number");
  }
  if (!std::isfinite(*value)) {
    throw Error(name_of(key) + " is not a finite number", place(node), "replace nan or inf by a number");
  }
  return *value;
}

Index Section::as_integer(const toml::node& node, std::string_view key) const {
  const auto value = node.value_exact<std::int64_t>();
  if (!value) {
    wrong_type(node, key, "a whole number");
  }
  if (*value < std::numeric_limits<Index>::min() || *value > std::numeric_limits<Index>::max()) {
    throw Error(name_of(key) + " is out of range: " + std::to_string(*value), place(node),
                "node, region and tag numbers have 32 bits");
  }
  return static_cast<Index>(*value);
}

int Section::as_count(const toml::node& node, std::string_view key) const {
  const Index value = as_integer(node, key);
  if (value < 1) {
    throw Error(name_of(key) + " must be at least 1, not " + std::to_string(value), place(node),
                "give a positive whole number");
  }
  return value;
}

std::vector<Vec3> Section::as_points(const toml::node& node, std::string_view key) const {
  const std::string expected = "a list of at least three points [x, y]";
  const toml::array* list = node.as_array();
  if (list == nullptr || list->size() < 3) {
    wrong_type(node, key, expected);
  }
  std::vector<Vec3> result;
  for (const toml::node& point : *list) {
    const toml::array* pair = point.as_array();
    if (pair == nullptr || pair->size() != 2) {
      wrong_type(point, key, expected);
    }
    result.emplace_back(as_number((*pair)[0], key), as_number((*pair)[1], key), 0.0);
  }
  return result;
}

const toml::array& Section::array(std::string_view key, const std::string& expected, std::size_t size) const {
  const toml::array* values = required(key).as_array();
  if (values == nullptr || (size != 0 && values->size() != size)) {
    wrong_type(required(key), key, "[" + expected + "]");
  }
  return *values;
}

}  // namespace palpate
