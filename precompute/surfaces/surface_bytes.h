// Surfaces sent by a child process.
#pragma once

#include <string>
#include <vector>

#include "base/child_process.h"
#include "precompute/surfaces/triangle_surface.h"

namespace palpate {

/// Appends a surface, for take_surface.
inline void append_surface(Bytes& bytes, const TriangleSurface& surface) {
  append_array(bytes, std::span(surface.nodes));
  append_array(bytes, std::span(surface.triangles));
}

/// Takes a surface from the front of `bytes`. Throws Error if they do not hold one.
inline TriangleSurface take_surface(std::span<const std::byte>& bytes) {
  TriangleSurface surface;
  surface.nodes = take_array<Vec3>(bytes);
  surface.triangles = take_array<Triangle>(bytes);
  return surface;
}

inline void append_text(Bytes& bytes, const std::string& text) {
  append_array(bytes, std::span<const char>(text));
}

inline std::string take_text(std::span<const std::byte>& bytes) {
  const std::vector<char> text = take_array<char>(bytes);
  return {text.begin(), text.end()};
}

/// Appends lines with their number, for take_lines.
inline void append_lines(Bytes& bytes, const std::vector<std::string>& lines) {
  const std::size_t count = lines.size();
  append_array(bytes, std::span(&count, 1));
  for (const std::string& line : lines) append_text(bytes, line);
}

inline std::vector<std::string> take_lines(std::span<const std::byte>& bytes) {
  std::vector<std::string> lines(take_array<std::size_t>(bytes).at(0));
  for (std::string& line : lines) line = take_text(bytes);
  return lines;
}

}  // namespace palpate
