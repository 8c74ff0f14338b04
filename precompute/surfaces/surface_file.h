// The formats of surfaces: OFF, OBJ, STL and PLY.
#pragma once

#include <filesystem>
#include <string>

#include "precompute/surfaces/polygon_soup.h"

namespace palpate {

/// Reads the bytes of an OFF, OBJ, STL (ASCII and binary) or PLY file, by its extension. What the file has
/// beside points and polygons is skipped. Throws Error with the line, or in binary files the number of the
/// polygon, where something is not what it should be. Takes memory only for what it has read.
PolygonSoup read_polygon_soup(const std::string& bytes, const std::filesystem::path& file);

}  // namespace palpate
