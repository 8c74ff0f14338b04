// Numbers that people write, read the same in every locale.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A finite number and nothing else but spaces round it, or nothing.
std::optional<double> parse_number(std::string_view text);

/// "x,y" or "x,y,z": two or three finite numbers, or nothing.
std::optional<std::vector<double>> parse_vector(std::string_view text);

/// A whole number from 0 on, or nothing.
std::optional<Index> parse_index(std::string_view text);

/// The parts of `text` between commas, without spaces round them.
std::vector<std::string_view> split_commas(std::string_view text);

}  // namespace palpate
