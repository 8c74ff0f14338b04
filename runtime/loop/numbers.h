// Parsing of numbers, independent of the locale.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Parses a finite number, with nothing else except spaces around it; otherwise empty.
std::optional<double> parse_number(std::string_view text);

/// Finite numbers between commas, or nothing.
std::optional<std::vector<double>> parse_numbers(std::string_view text);

/// Parses "x,y" or "x,y,z": two or three finite numbers; otherwise empty.
std::optional<std::vector<double>> parse_vector(std::string_view text);

/// Parses a whole number from 0; otherwise empty.
std::optional<Index> parse_index(std::string_view text);

/// Returns the parts of `text` between commas, without surrounding spaces.
std::vector<std::string_view> split_commas(std::string_view text);

/// A part NAME=VALUE.
struct NamedText {
  std::string_view name, value;
};
/// Without "=" all of it is the name.
NamedText split_named(std::string_view part);

}  // namespace palpate
