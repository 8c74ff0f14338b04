// Small surfaces and a folder to write them into, for the geometry tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "meshes/mesh.h"
#include "precompute/surfaces/surface_input.h"

namespace palpate::testing {

/// A folder that is removed at the end.
class TempFolder {
 public:
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "palpate-geometry-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() { std::filesystem::remove_all(path_); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

inline std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// Box [0, s]^3 of twelve triangles.
inline TriangleSurface cube(double s = 1.0) {
  TriangleSurface cube;
  for (int i = 0; i < 8; ++i) {
    cube.nodes.emplace_back(s * (i & 1), s * (i >> 1 & 1), s * (i >> 2 & 1));
  }
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return cube;
}

inline TriangleSurface tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

/// Every triangle in four, new nodes by `place`.
template <typename Place>
TriangleSurface refine(const TriangleSurface& coarse, const Place& place) {
  TriangleSurface fine{coarse.nodes, {}};
  std::map<std::pair<Index, Index>, Index> middle;
  const auto between = [&](Index a, Index b) {
    const auto [entry, is_new] = middle.try_emplace(std::minmax(a, b), static_cast<Index>(fine.nodes.size()));
    if (is_new) {
      fine.nodes.push_back(place((fine.nodes[at(a)] + fine.nodes[at(b)]) / 2.0));
    }
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const Index ab = between(a, b), bc = between(b, c), ca = between(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

/// Unit sphere: an octahedron refined `times` times.
inline TriangleSurface ball(int times) {
  TriangleSurface ball{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int i = 0; i < times; ++i) {
    ball = refine(ball, [](const Vec3& x) -> Vec3 { return x.normalized(); });
  }
  return ball;
}

inline TriangleSurface fine_cube(int times, double s = 1.0) {
  TriangleSurface result = cube(s);
  for (int i = 0; i < times; ++i) {
    result = refine(result, [](const Vec3& x) { return x; });
  }
  return result;
}

inline TriangleSurface joined(TriangleSurface a, const TriangleSurface& b, const Vec3& shift) {
  const auto first = static_cast<Index>(a.nodes.size());
  for (const Vec3& x : b.nodes) {
    a.nodes.emplace_back(x + shift);
  }
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return a;
}

/// Volume inside, by the divergence theorem: sum of det[a, b, c] / 6.
inline double volume(const TriangleSurface& s) {
  double sum = 0.0;
  for (const auto& [a, b, c] : s.triangles) {
    sum += s.nodes[at(a)].cross(s.nodes[at(b)]).dot(s.nodes[at(c)]) / 6.0;
  }
  return sum;
}

/// Corner i of tetrahedron e.
inline const Vec3& corner(const Mesh& mesh, Index e, std::size_t i) {
  return mesh.nodes[at(mesh.element_nodes(e)[i])];
}

/// Volume of tetrahedron e, whatever its sign.
inline double volume(const Mesh& mesh, Index e) {
  const Vec3 &x = corner(mesh, e, 0), p = corner(mesh, e, 1) - x, q = corner(mesh, e, 2) - x,
             r = corner(mesh, e, 3) - x;
  return std::abs(p.cross(q).dot(r)) / 6.0;
}

/// Sum of the tetrahedra's volumes.
inline double volume(const Mesh& mesh) {
  double sum = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    sum += volume(mesh, e);
  }
  return sum;
}

inline std::string off(const TriangleSurface& s) {
  std::string text =
      "OFF\n" + std::to_string(s.nodes.size()) + " " + std::to_string(s.triangles.size()) + " 0\n";
  for (const Vec3& x : s.nodes) {
    text += std::to_string(x[0]) + " " + std::to_string(x[1]) + " " + std::to_string(x[2]) + "\n";
  }
  for (const auto& [a, b, c] : s.triangles) {
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  }
  return text;
}

/// Runs `work`, which must throw Error, and returns "WHERE: WHAT (HINT)".
template <typename Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_FALSE(error.hint().empty());
    return error.where() + ": " + error.what() + " (" + error.hint() + ")";
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

/// Expects every piece in the text.
inline void expect_mentions(const std::string& text, const std::vector<std::string>& pieces) {
  for (const std::string& piece : pieces) {
    EXPECT_NE(text.find(piece), std::string::npos) << "\"" << piece << "\" is not in: " << text;
  }
}

}  // namespace palpate::testing
