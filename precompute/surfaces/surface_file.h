// Reader of the surface formats OFF, OBJ, STL and PLY.
#pragma once

#include <filesystem>
#include <string>

#include "precompute/surfaces/polygon_soup.h"

namespace palpate {

/// Reads the bytes of an OFF, OBJ, STL (ASCII and binary) or PLY file, by its extension. Skips everything
/// except points and polygons. Throws Error with the line, or in binary files the number of the polygon, for
/// invalid contents. Allocates memory only for data that it has read.
PolygonSoup read_polygon_soup(const std::string& bytes, const std::filesystem::path& file);

}  // namespace palpate
