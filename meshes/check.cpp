#include "meshes/check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <numeric>

#include "base/error.h"
#include "meshes/element.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

std::string text(const Vec3& x, int dimension) {
  if (dimension == 2) return fmt::format("({:.4g}, {:.4g})", x.x(), x.y());
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", x.x(), x.y(), x.z());
}

/// Mean of an element's corners.
Vec3 centre_of(const Mesh& mesh, Index e) {
  return element_nodes(mesh, e).topRows(traits(mesh.element).corners).colwise().mean().transpose();
}

void check_numbers(const Mesh& mesh, const std::string& where) {
  if (mesh.connectivity.empty()) {
    throw Error("the mesh has no elements", where, "Save the elements of the body, not only its boundary");
  }
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (mesh.nodes[node].allFinite()) continue;
    throw Error(fmt::format("node {} has a coordinate that is not a finite number", node), where,
                "Repair or remake the mesh");
  }
  for (Index e = 0; e < mesh.elements(); ++e) {
    for (const Index node : mesh.element_nodes(e)) {
      if (node >= 0 && static_cast<std::size_t>(node) < mesh.nodes.size()) continue;
      throw Error(fmt::format("element {} uses node {}, but there are only nodes 0 to {}", e, node,
                              static_cast<std::int64_t>(mesh.nodes.size()) - 1),
                  where, "Repair or remake the mesh");
    }
  }
}

std::string remake_hint(const Mesh& mesh) {
  return traits(mesh.element).nodes > traits(mesh.element).corners
             ? "The middles of its edges are too far out or in the wrong order; remake the mesh"
             : "Remake the mesh with a bound on the quality of its elements";
}

/// Volume below which an element counts as flat.
double smallest_volume(const ElementNodes& x, int dimension) {
  const double longest = (x.rowwise() - x.row(0)).rowwise().norm().maxCoeff();
  return 1e-12 * std::pow(longest, dimension);
}

/// Reverses elements of negative volume and returns how many. Throws Error for one without volume.
std::size_t turn_inverted(Mesh& mesh, const std::string& where) {
  const int d = mesh.dimension();
  const std::span<const std::uint8_t> order = reversed_nodes(mesh.element);
  std::size_t inverted = 0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    const double volume = element_volume(mesh.element, x);
    if (std::abs(volume) <= smallest_volume(x, d)) {
      throw Error(fmt::format("element {} near {} has zero {}", e, text(centre_of(mesh, e), d),
                              d == 3 ? "volume" : "area"),
                  where, remake_hint(mesh));
    }
    if (volume > 0.0) continue;
    ++inverted;
    const std::span<const Index> nodes = mesh.element_nodes(e);
    const std::vector<Index> before(nodes.begin(), nodes.end());
    Index* const after = mesh.connectivity.data() + (nodes.data() - mesh.connectivity.data());
    for (std::size_t i = 0; i < order.size(); ++i) after[i] = before[order[i]];
  }
  return inverted;
}

/// Throws Error for quad4, tet10 and hex8 that fold over at a corner, which a positive volume does not
/// exclude.
void check_not_folded(const Mesh& mesh, const std::string& where) {
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    if (smallest_determinant(mesh.element, x) > smallest_volume(x, mesh.dimension())) continue;
    throw Error(fmt::format("element {} near {} is folded or flat at a corner", e,
                            text(centre_of(mesh, e), mesh.dimension())),
                where, remake_hint(mesh));
  }
}

/// Root of an element in a union-find forest, with path halving.
std::size_t find_root(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

using Motion = Eigen::Matrix<double, 6, 1>;  // u(x) = t + w x (x - centre) / size, [t w]

/// The rigid motions of a body, about the mean of its held nodes and scaled by its size.
struct RigidMotions {
  const Mesh& mesh;
  const std::vector<std::uint8_t>& fixed;
  Vec3 centre = Vec3::Zero();
  double size = 0.0;
  std::vector<Eigen::Index> possible;  // of the six; in the plane two translations and a rotation

  RigidMotions(const Mesh& body, const std::vector<std::uint8_t>& held) : mesh(body), fixed(held) {
    possible = mesh.dimension() == 3 ? std::vector<Eigen::Index>{0, 1, 2, 3, 4, 5}
                                     : std::vector<Eigen::Index>{0, 1, 5};
    const auto count = std::count_if(fixed.begin(), fixed.end(), [](std::uint8_t mask) { return mask != 0; });
    for (std::size_t node = 0; node < fixed.size(); ++node) {
      if (fixed[node] != 0) centre += mesh.nodes[node] / static_cast<double>(count);
    }
    for (const Vec3& x : mesh.nodes) size = std::max(size, (x - centre).norm());
  }

  /// Displacement of each held dof by each motion. [held dofs, motions]
  [[nodiscard]] Eigen::MatrixXd at_held_dofs() const {
    std::vector<Motion> rows;
    for (std::size_t node = 0; node < fixed.size(); ++node) {
      for (int axis = 0; axis < mesh.dimension(); ++axis) {
        if ((fixed[node] >> axis & 1) == 0) continue;
        const Vec3 direction = Vec3::Unit(axis), r = (mesh.nodes[node] - centre) / size;
        Motion row;
        row << direction, r.cross(direction);
        rows.push_back(row);
      }
    }
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()),
                           static_cast<Eigen::Index>(possible.size()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
      matrix.row(i) = rows[static_cast<std::size_t>(i)](possible);
    return matrix;
  }

  /// A basis of the motions that move no held dof: the null space by LU with full pivoting. [6, motions left]
  [[nodiscard]] Eigen::MatrixXd left_over() const {
    constexpr double negligible = 1e-9;
    Eigen::FullPivLU<Eigen::MatrixXd> lu(at_held_dofs());
    lu.setThreshold(negligible);
    Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(6, lu.dimensionOfKernel());
    if (basis.cols() == 0) return basis;
    const Eigen::MatrixXd kernel = lu.kernel();
    for (std::size_t i = 0; i < possible.size(); ++i)
      basis.row(possible[i]) = kernel.row(static_cast<Eigen::Index>(i));
    return basis;
  }
};

/// x with rounding errors set to zero, for messages.
Vec3 rounded(const Vec3& x, double size) {
  return (x.array().abs() < 1e-9 * size).select(Vec3::Zero(), x);
}

/// One of the remaining motions, preferably a rotation about a coordinate axis.
Motion a_turning_motion(const Eigen::MatrixXd& left) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::MatrixXd turning = left.bottomRows(3);
    const Eigen::VectorXd combination = turning.fullPivLu().solve(Vec3::Unit(axis));
    if ((turning * combination - Vec3::Unit(axis)).norm() < 1e-6) return left * combination;
  }
  return left.col(left.cols() - 1);
}

/// Text for a rotation: "turn about the axis through (0, 0, 0) m along (0, 0, 1)".
std::string turning_text(const RigidMotions& motions, const Eigen::MatrixXd& left) {
  const Motion motion = a_turning_motion(left);
  const Vec3 t = motion.head(3), w = motion.tail(3);
  const Vec3 point = rounded(motions.centre + motions.size * w.cross(t) / w.squaredNorm(), motions.size);
  if (motions.mesh.dimension() == 2) return fmt::format("turn about the point {} m", text(point, 2));
  const bool about_a_point = left.cols() == 3 && left.topRows(3).norm() < 1e-6;
  if (about_a_point) return fmt::format("turn about the point {} m in every direction", text(point, 3));
  const bool screws = std::abs(t.dot(w)) > 1e-6 * w.squaredNorm();
  return fmt::format("{} about the axis through {} m along {}", screws ? "move like a screw" : "turn",
                     text(point, 3), text(rounded(w.normalized(), 1.0), 3));
}

}  // namespace

std::size_t orient_elements(Mesh& mesh, const std::string& where) {
  check_numbers(mesh, where);
  const std::size_t inverted = turn_inverted(mesh, where);
  check_not_folded(mesh, where);
  return inverted;
}

std::size_t remove_unused_nodes(Mesh& mesh) {
  constexpr Index unused = -1;
  std::vector<Index> number(mesh.nodes.size(), unused);
  for (const Index node : mesh.connectivity) number[static_cast<std::size_t>(node)] = 0;
  std::vector<Vec3> used;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (number[node] == unused) continue;
    number[node] = static_cast<Index>(used.size());
    used.push_back(mesh.nodes[node]);
  }
  const auto renumber = [&](Index& node) { node = number[static_cast<std::size_t>(node)]; };
  std::for_each(mesh.connectivity.begin(), mesh.connectivity.end(), renumber);
  std::for_each(mesh.tagged_facets.begin(), mesh.tagged_facets.end(), renumber);
  std::vector<Index> facets, tags;
  for (std::size_t t = 0; t < mesh.facet_tags.size(); ++t) {
    const std::span<const Index> facet = mesh.tagged_facet(static_cast<Index>(t));
    if (std::find(facet.begin(), facet.end(), unused) != facet.end()) continue;
    facets.insert(facets.end(), facet.begin(), facet.end());
    tags.push_back(mesh.facet_tags[t]);
  }
  mesh.tagged_facets = std::move(facets);
  mesh.facet_tags = std::move(tags);
  const std::size_t removed = mesh.nodes.size() - used.size();
  mesh.nodes = std::move(used);
  return removed;
}

void check_connected(const Mesh& mesh, const std::string& where) {
  const auto elements = static_cast<std::size_t>(mesh.elements());
  std::vector<std::size_t> parent(elements);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  for (std::size_t i = 1; i < sides.size(); ++i) {
    if (sides[i].corners != sides[i - 1].corners) continue;
    parent[find_root(parent, static_cast<std::size_t>(sides[i].element))] =
        find_root(parent, static_cast<std::size_t>(sides[i - 1].element));
  }
  std::map<std::size_t, std::size_t> part_sizes;  // by the element that represents the part
  for (std::size_t e = 0; e < elements; ++e) ++part_sizes[find_root(parent, e)];
  if (part_sizes.size() == 1) return;
  std::string parts;
  for (const auto& [root, size] : part_sizes) {
    if (parts.size() > 200) {
      parts += ", ...";
      break;
    }
    parts += fmt::format("{}{} elements at {}", parts.empty() ? "" : ", ", size,
                         text(centre_of(mesh, static_cast<Index>(root)), mesh.dimension()));
  }
  throw Error(
      fmt::format("the body is in {} disconnected parts: {}", part_sizes.size(), parts), where,
      fmt::format("Keep one part, or join them by shared {}.", mesh.dimension() == 3 ? "faces" : "sides"));
}

void check_held(const Mesh& mesh, const std::vector<std::uint8_t>& fixed, const std::string& where) {
  const int d = mesh.dimension();
  const unsigned every_axis = d == 3 ? 7 : 3;
  unsigned any = 0, all = every_axis;
  for (const std::uint8_t mask : fixed) {
    any |= mask & every_axis;
    all &= mask;
  }
  if (any == 0) {
    throw Error("nothing is fixed: the body can move freely", where,
                "Add a [[fixed]] region that holds a part of the body");
  }
  if (all == every_axis) {
    throw Error("every node is fixed: nothing is left to move", where, "Make the [[fixed]] regions smaller");
  }
  const RigidMotions motions(mesh, fixed);
  const Eigen::MatrixXd left = motions.left_over();
  if (left.cols() == 0) return;
  const std::string begin = left.cols() == 1
                                ? "a rigid motion is left: the body can still "
                                : fmt::format("{} rigid motions are left: the body can still ", left.cols());
  if (any != every_axis) {  // a body slides along the axes along which no node is held
    std::string axes;
    for (int axis = 0; axis < d; ++axis) {
      if ((any >> axis & 1) == 0) axes += fmt::format("{}{}", axes.empty() ? "" : " and ", "xyz"[axis]);
    }
    throw Error(fmt::format("{}slide along {}", begin, axes), where,
                fmt::format("Hold some nodes along {} too, in this [[fixed]] region or another", axes));
  }
  throw Error(begin + turning_text(motions, left), where,
              "Add a [[fixed]] region, or an axis to one, that holds nodes elsewhere against it");
}

std::string scale_warning(const Mesh& mesh, double scale) {
  constexpr double smallest = 1e-3, largest = 10.0;  // [m] plausible lengths of a body
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.nodes) box.extend(x);
  const double size = box.sizes().maxCoeff();
  if (size >= smallest && size <= largest) return {};
  const std::string told = fmt::format("the body is {:.4g} m long: ", size);
  const bool is_large = size > largest;
  const double other = is_large ? 0.001 * scale : 1.0, then = size / scale * other;
  if (then < smallest || then > largest || other == scale)
    return told + fmt::format("check scale under [geometry], the metres per unit of its numbers (now {:.3g})",
                              scale);
  return told + fmt::format(
                    "if its numbers are {}, write scale = {:.3g} under [geometry] (now {:.3g}), which makes "
                    "it {:.4g} m",
                    is_large ? "millimetres" : "metres", other, scale, then);
}

}  // namespace palpate
