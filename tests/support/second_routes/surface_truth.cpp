#include "tests/support/second_routes/surface_truth.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "tests/support/study.h"

namespace palpate::test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Ends = std::array<Vec3, 2>;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double sight = 0.35;                 // [edge] pieces nearer than this are looked at in a tick
constexpr double margin = 0.06;                // [edge] contact points nearer than this are in the problem
constexpr Eigen::Index most_stiffened = 1100;  // [dofs] with more, normals that turn are followed by passes
constexpr int most_passes = 150;

int count_of(const std::array<Index, 4>& piece) {
  return piece[1] < 0 ? 1 : piece[2] < 0 ? 2 : 3;
}

/// Where core and piece are nearest to each other.
struct Foot {
  std::array<double, 3> weights{};
  Vec3 on_core = Vec3::Zero(), on_surface = Vec3::Zero();
};

Vec3 nearest_on_core(const Ends& core, const Vec3& point) {
  const Vec3 along = core[1] - core[0];
  const double squared = along.squaredNorm();
  if (squared == 0.0) return core[0];
  return core[0] + std::clamp(along.dot(point - core[0]) / squared, 0.0, 1.0) * along;
}

/// Of an infinite line through an edge: its weights may be negative.
Foot foot_on_edge(const Ends& core, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a;
  const double squared = edge.squaredNorm();
  const auto across = [&](const Vec3& v) { return Vec3(v - edge.dot(v) / squared * edge); };
  const Vec3 along = across(core[1] - core[0]);
  const double length = along.squaredNorm();
  const double s = length > 0.0 ? std::clamp(-along.dot(across(core[0] - a)) / length, 0.0, 1.0) : 0.0;
  Foot foot;
  foot.on_core = core[0] + s * (core[1] - core[0]);
  const double t = edge.dot(foot.on_core - a) / squared;
  foot.weights = {1.0 - t, t, 0.0};
  foot.on_surface = a + t * edge;
  return foot;
}

/// Of the plane through a triangle.
Foot foot_on_face(const Vec3& end, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  Foot foot;
  foot.on_core = end;
  foot.weights[1] = (end - a).cross(c - a).dot(normal) / squared;
  foot.weights[2] = (b - a).cross(end - a).dot(normal) / squared;
  foot.weights[0] = 1.0 - foot.weights[1] - foot.weights[2];
  foot.on_surface = foot.weights[0] * a + foot.weights[1] * b + foot.weights[2] * c;
  return foot;
}

Foot foot_of(const Ends& core, const std::array<Index, 4>& piece, const std::array<Vec3, 3>& at) {
  switch (count_of(piece)) {
    case 1:
      return {{1.0, 0.0, 0.0}, nearest_on_core(core, at[0]), at[0]};
    case 2:
      return foot_on_edge(core, at[0], at[1]);
    default:
      return foot_on_face(core[static_cast<std::size_t>(piece[3])], at[0], at[1], at[2]);
  }
}

/// Derivative of the gap by the piece's corners, one after the other.
VectorXd gradient(const Ends& core, const std::array<Index, 4>& piece, const std::array<Vec3, 3>& at) {
  const Foot foot = foot_of(core, piece, at);
  const Vec3 normal = (foot.on_core - foot.on_surface).normalized();
  const int count = count_of(piece);
  VectorXd result(3 * count);
  for (int k = 0; k < count; ++k)
    result.segment<3>(Eigen::Index{3} * k) = -foot.weights[static_cast<std::size_t>(k)] * normal;
  return result;
}

/// Second derivative, by differences.
MatrixXd curvature(const Ends& core, const std::array<Index, 4>& piece, std::array<Vec3, 3> at, double step) {
  const Eigen::Index n = Eigen::Index{3} * count_of(piece);
  MatrixXd result(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    double& x = at[static_cast<std::size_t>(i / 3)][i % 3];
    const double here = x;
    x = here + step;
    const VectorXd more = gradient(core, piece, at);
    x = here - step;
    result.col(i) = (more - gradient(core, piece, at)) / (2.0 * step);
    x = here;
  }
  return 0.5 * (result + result.transpose());
}

Matrix3d axes(const Vec3& normal) {
  Matrix3d result;
  result.col(0) = normal;
  result.col(1) = normal.unitOrthogonal();
  result.col(2) = normal.cross(result.col(1));
  return result;
}

}  // namespace

SurfaceTruth::SurfaceTruth(const Body& body, const Tool& tool, double friction,
                           const Eigen::Quaterniond& orientation)
    : body_(body),
      tool_(tool),
      orientation_(orientation),
      margin_(margin * body.mean_surface_edge()),
      at_(body.surface_rest_positions().begin(), body.surface_rest_positions().end()),
      solver_(friction > 0.0 ? 3 : 1) {
  solver_.friction = friction;
}

std::array<Vec3, 2> SurfaceTruth::core() const {
  return {place_, place_ + tool_.length * (orientation_ * Vec3::UnitZ())};
}

/// Whether the core is nearest to a place within the piece, and so near that they may touch.
bool SurfaceTruth::touch(const Piece& piece, const Corners& at, Contact& contact) const {
  const Foot foot = foot_of(core(), piece, at);
  const int count = count_of(piece);
  for (int k = 0; count > 1 && k < count; ++k) {
    if (!(foot.weights[static_cast<std::size_t>(k)] > 0.0)) return false;
  }
  const Vec3 across = foot.on_core - foot.on_surface;
  if (count == 3 && (at[1] - at[0]).cross(at[2] - at[0]).dot(across) <= 0.0) return false;
  const double distance = across.norm();
  contact = {.piece = piece,
             .weights = foot.weights,
             .normal = across / distance,
             .foot = foot.on_surface,
             .gap = distance - tool_.radius};
  return true;
}

/// A triangle's vertices, edges and faces, where they may be touched in this tick.
void SurfaceTruth::add_pieces_of(std::size_t triangle, std::map<Piece, bool>& found) const {
  const std::span<const Index> simplices = body_.simplices();
  std::array<Index, 3> nodes{simplices[3 * triangle], simplices[3 * triangle + 1],
                             simplices[3 * triangle + 2]};
  Corners at;
  for (std::size_t k = 0; k < 3; ++k) at[k] = at_[static_cast<std::size_t>(nodes[k])];
  const Vec3 normal = (at[1] - at[0]).cross(at[2] - at[0]);
  const Ends ends = core();
  if (std::max(normal.dot(ends[0] - at[0]), normal.dot(ends[1] - at[0])) <= 0.0) return;
  const double far = sight * body_.mean_surface_edge();
  std::vector<Piece> pieces;
  pieces.reserve(8);
  for (const Index node : nodes) pieces.push_back({node, -1, -1, -1});
  const bool nodes_alone =
      tool_.length == 0.0 && tool_.radius > tuning.detection.smooth_radius * body_.simplex_edges()[triangle];
  if (!nodes_alone) {
    for (std::size_t k = 0; k < 3; ++k)
      pieces.push_back(
          {std::min(nodes[k], nodes[(k + 1) % 3]), std::max(nodes[k], nodes[(k + 1) % 3]), -1, -1});
    for (Index end = 0; end < (tool_.length > 0.0 ? 2 : 1); ++end)
      pieces.push_back({nodes[0], nodes[1], nodes[2], end});
  }
  bool is_near = false;
  for (const Piece& piece : pieces) {
    Corners corners;
    for (std::size_t k = 0; k < 3; ++k) {
      if (piece[k] >= 0) corners[k] = at_[static_cast<std::size_t>(piece[k])];
    }
    Contact contact;
    const bool near = touch(piece, corners, contact) && contact.gap < far;
    if (nodes_alone && near) found[piece] = true;
    is_near = is_near || near;
  }
  for (const Piece& piece : pieces) {
    if (!nodes_alone && is_near) found[piece] = true;
  }
}

void SurfaceTruth::find_pieces() {
  const Ends ends = core();
  const double reach = tool_.radius + body_.longest_surface_edge() + sight * body_.mean_surface_edge();
  std::vector<char> is_near(at_.size());
  for (std::size_t k = 0; k < at_.size(); ++k)
    is_near[k] = (nearest_on_core(ends, at_[k]) - at_[k]).squaredNorm() < reach * reach ? 1 : 0;
  std::map<Piece, bool> found;
  const std::span<const Index> simplices = body_.simplices();
  for (std::size_t k = 0; 3 * k < simplices.size(); ++k) {
    const auto near = [&](std::size_t n) {
      return is_near[static_cast<std::size_t>(simplices[3 * k + n])] != 0;
    };
    if (near(0) || near(1) || near(2)) add_pieces_of(k, found);
  }
  for (const auto& [piece, contact] : last_) found[piece] = true;
  pieces_.clear();
  for (const auto& [piece, yes] : found) {
    bool moves = false;
    for (std::size_t k = 0; k < 3; ++k)
      moves =
          moves || (piece[k] >= 0 && body_.surface_stored_nodes()[static_cast<std::size_t>(piece[k])] >= 0);
    if (moves) pieces_.push_back(piece);
  }
}

Index SurfaceTruth::slot_of(Index node) {
  const auto known = slot_.find(node);
  if (known != slot_.end()) return known->second;
  const auto slot = static_cast<Index>(stored_.size());
  slot_[node] = slot;
  const Index stored = body_.surface_stored_nodes()[static_cast<std::size_t>(node)];
  stored_.push_back(stored);
  const Eigen::Index n = Eigen::Index{3} * slot;
  if (C_.rows() < n + 3)
    C_.conservativeResize(std::max<Eigen::Index>(2 * n, 300), std::max<Eigen::Index>(2 * n, 300));
  C_.middleRows<3>(n).leftCols(n + 3).setZero();
  C_.middleCols<3>(n).topRows(n + 3).setZero();
  if (stored < 0) return slot;
  std::vector<Index> columns, slots;
  for (Index k = 0; k <= slot; ++k) {
    if (stored_[static_cast<std::size_t>(k)] < 0) continue;
    columns.push_back(stored_[static_cast<std::size_t>(k)]);
    slots.push_back(k);
  }
  const auto width = static_cast<Eigen::Index>(3 * columns.size());
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> blocks(3, width);
  body_.greens().gather(stored, columns, {blocks.data(), static_cast<std::size_t>(blocks.size())});
  for (Eigen::Index k = 0; k < std::ssize(slots); ++k) {
    const Eigen::Index at = Eigen::Index{3} * slots[static_cast<std::size_t>(k)];
    const Matrix3d block = blocks.middleCols<3>(3 * k);
    C_.block<3, 3>(n, at) = block;
    C_.block<3, 3>(at, n) = block.transpose();
  }
  return slot;
}

void SurfaceTruth::number_near_nodes() {
  near_.clear();
  near_place_.clear();
  for (const Piece& piece : pieces_) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (piece[k] >= 0) near_place_[piece[k]] = 0;
    }
  }
  std::vector<Eigen::Index> dofs;
  for (auto& [node, place] : near_place_) {
    place = static_cast<Index>(near_.size());
    near_.push_back(node);
    const Eigen::Index first = Eigen::Index{3} * slot_of(node);
    dofs.insert(dofs.end(), {first, first + 1, first + 2});
  }
  C_near_ = C_(dofs, dofs);
  before_.resize(std::ssize(dofs));
  u_.resize(std::ssize(dofs));
  for (std::size_t k = 0; k < near_.size(); ++k) {
    const auto node = static_cast<std::size_t>(near_[k]);
    const Vec3& rest = body_.surface_rest_positions()[node];
    before_.segment<3>(static_cast<Eigen::Index>(3 * k)) = previous_[node] - rest;
    u_.segment<3>(static_cast<Eigen::Index>(3 * k)) = at_[node] - rest;
  }
}

SurfaceTruth::Corners SurfaceTruth::corners_of(const Piece& piece, const VectorXd& u) const {
  Corners at{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  for (std::size_t k = 0; k < 3; ++k) {
    if (piece[k] < 0) continue;
    at[k] = body_.surface_rest_positions()[static_cast<std::size_t>(piece[k])] +
            u.segment<3>(Eigen::Index{3} * near_place_.at(piece[k]));
  }
  return at;
}

/// Contact points as the surface is now, with the forces that they had.
void SurfaceTruth::find_contacts() {
  contacts_.clear();
  for (const Piece& piece : pieces_) {
    Contact contact;
    if (!touch(piece, corners_of(piece, u_), contact)) continue;
    const auto last = last_.find(piece);
    if (last == last_.end() && contact.gap > margin_) continue;
    if (last != last_.end()) {
      const double along = last->second.force.dot(last->second.normal);
      const Vec3 across = last->second.force - along * last->second.normal;
      contact.force = along * contact.normal + across - across.dot(contact.normal) * contact.normal;
    }
    contacts_.push_back(contact);
  }
}

/// What the nodal forces change by as the nodes move and the normal forces stay, less springs along the
/// normals, which what is shut does not move against: they keep the compliance positive definite where the
/// normals alone keep the nodes from slipping aside.
Sparse SurfaceTruth::geometric_stiffness(double share) const {
  constexpr double spring = 3.0;  // [stiffness of the contact point alone]
  std::vector<Eigen::Triplet<double>> entries;
  for (const Contact& contact : contacts_) {
    const double force = contact.force.dot(contact.normal);
    if (force <= 0.0) continue;
    const Corners at = corners_of(contact.piece, u_);
    const VectorXd G = gradient(core(), contact.piece, at);
    std::vector<Eigen::Index> dofs;
    for (Eigen::Index i = 0; i < G.size(); ++i)
      dofs.push_back(Eigen::Index{3} * near_place_.at(contact.piece[static_cast<std::size_t>(i / 3)]) +
                     i % 3);
    const double give = G.dot(C_near_(dofs, dofs) * G);
    const MatrixXd H =
        share * force * curvature(core(), contact.piece, at, 1e-4 * body_.mean_surface_edge()) -
        spring / give * G * G.transpose();
    for (Eigen::Index i = 0; i < G.size(); ++i) {
      for (Eigen::Index j = 0; j < G.size(); ++j)
        entries.emplace_back(static_cast<int>(dofs[static_cast<std::size_t>(i)]),
                             static_cast<int>(dofs[static_cast<std::size_t>(j)]), H(i, j));
    }
  }
  Sparse A(u_.size(), u_.size());
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

/// The nodes' motion to that of the contact points along their axes.
Eigen::SparseMatrix<double, Eigen::RowMajor> SurfaceTruth::rows() const {
  const int d = solver_.rows();
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Contact& contact = contacts_[k];
    const Matrix3d frame = axes(contact.normal);
    for (std::size_t n = 0; n < static_cast<std::size_t>(count_of(contact.piece)); ++n) {
      const int at = 3 * near_place_.at(contact.piece[n]);
      for (int i = 0; i < d; ++i) {
        for (int axis = 0; axis < 3; ++axis)
          entries.emplace_back(d * static_cast<int>(k) + i, at + axis, contact.weights[n] * frame(axis, i));
      }
    }
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> J(d * std::ssize(contacts_), u_.size());
  J.setFromTriplets(entries.begin(), entries.end());
  return J;
}

/// r = r now + J (u now - u), where u = C (A (u - u now) - J^T p): so u = -C' (J^T p + A u now) with the
/// compliance C' = (1/C - A)^-1 that normals which turn leave.
void SurfaceTruth::state_problem(const Vec3& way) {
  const int d = solver_.rows();
  J_ = rows();
  const MatrixXd JC = J_ * stiffened_;
  solver_.W = JC * J_.transpose();
  solver_.W = (0.5 * (solver_.W + solver_.W.transpose())).eval();
  solver_.b = J_ * u_ + JC * (A_ * u_);
  const VectorXd moved = J_ * (u_ - before_);
  solver_.p.resize(solver_.b.size());
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Contact& contact = contacts_[k];
    const Matrix3d frame = axes(contact.normal);
    const Eigen::Index at = d * static_cast<Eigen::Index>(k);
    solver_.b[at] += contact.gap + (is_linear_ ? way.dot(contact.normal) : 0.0);
    for (int i = 1; i < d; ++i) solver_.b[at + i] += frame.col(i).dot(way) - moved[at + i];
    for (int i = 0; i < d; ++i) solver_.p[at + i] = frame.col(i).dot(contact.force);
  }
}

void SurfaceTruth::take_forces() {
  const int d = solver_.rows();
  last_.clear();
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    Contact& contact = contacts_[k];
    const Eigen::Index at = d * static_cast<Eigen::Index>(k);
    contact.force = axes(contact.normal).leftCols(d) * solver_.p.segment(at, d);
    if (!contact.force.isZero(0.0)) last_[contact.piece] = contact;
  }
}

/// A step of Newton's method; how far it moves a node [m].
double SurfaceTruth::solve_pass(const Vec3& way, double tolerance) {
  state_problem(way);
  residual_ = contacts_.empty() ? 0.0 : solver_.solve(tolerance);
  const VectorXd u = contacts_.empty() ? VectorXd(VectorXd::Zero(u_.size()))
                                       : VectorXd(-(stiffened_ * (J_.transpose() * solver_.p + A_ * u_)));
  const double move = u_.size() > 0 ? (u - u_).lpNorm<Eigen::Infinity>() : 0.0;
  u_ = u;
  take_forces();
  return move;
}

void SurfaceTruth::renew_surface() {
  std::map<Index, Vec3> forces;  // by stored node
  for (const auto& [piece, contact] : last_) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(count_of(piece)); ++k) {
      const Index stored = body_.surface_stored_nodes()[static_cast<std::size_t>(piece[k])];
      if (stored < 0) continue;
      forces.try_emplace(stored, Vec3::Zero()).first->second -= contact.weights[k] * contact.force;
    }
  }
  std::vector<Index> nodes;
  std::vector<double> f;
  for (const auto& [stored, force] : forces) {
    nodes.push_back(stored);
    f.insert(f.end(), force.begin(), force.end());
  }
  std::vector<double> u(static_cast<std::size_t>(body_.greens().order()), 0.0);
  if (!nodes.empty()) body_.greens().displacement(nodes, f, u);
  for (std::size_t k = 0; k < at_.size(); ++k) {
    const Index stored = body_.surface_stored_nodes()[k];
    if (stored < 0) continue;
    const auto first = 3 * static_cast<std::size_t>(stored);
    at_[k] = body_.surface_rest_positions()[k] + Vec3(u[first], u[first + 1], u[first + 2]);
  }
}

/// How deep the deepest node is in the tool; whether it is one that the tick has not looked at.
bool SurfaceTruth::is_out_of_sight() {
  const Ends ends = core();
  bool out = false;
  penetration_ = 0.0;
  for (std::size_t k = 0; k < at_.size(); ++k) {
    const double deep = tool_.radius - (nearest_on_core(ends, at_[k]) - at_[k]).norm();
    penetration_ = std::max(penetration_, deep);
    if (deep > 1e-9 && !near_place_.contains(static_cast<Index>(k))) out = true;
  }
  return out;
}

Wrench SurfaceTruth::wrench(const Vec3& origin) const {
  Wrench sum;
  for (const Contact& contact : contacts_) {
    sum.force += contact.force;
    sum.torque += (contact.foot - origin).cross(contact.force);
  }
  return sum;
}

/// The compliance that the passes go by; `turning`: with what normals that turn change.
void SurfaceTruth::stiffen(bool turning) {
  A_ = Sparse(u_.size(), u_.size());
  stiffened_ = C_near_;
  if (!turning || solver_.friction > 0.0 || u_.size() > most_stiffened) return;
  // Where normals that turn let nodes slip aside by themselves, less of it: Newton's steps then go downhill.
  for (const double share : {1.0, 0.7, 0.4}) {
    A_ = geometric_stiffness(share);
    if (A_.nonZeros() == 0) return;
    const MatrixXd M = MatrixXd::Identity(u_.size(), u_.size()) - C_near_ * A_;
    stiffened_ = M.partialPivLu().solve(C_near_);
    if (MatrixXd(0.5 * (stiffened_ + stiffened_.transpose())).llt().info() == Eigen::Success) return;
  }
  A_.setZero();
  stiffened_ = C_near_;
}

/// What may touch where the tool and the surface are.
void SurfaceTruth::look() {
  find_pieces();
  number_near_nodes();
  find_contacts();
  stiffen(false);
}

void SurfaceTruth::settle(const Vec3& way) {
  const double still = solver_.friction > 0.0 ? 1e-9 : 1e-10;  // [m]
  const double most = 0.3 * body_.mean_surface_edge();
  double last = std::numeric_limits<double>::infinity();
  double share = 1.0;
  bool is_slow = false;
  passes_ = 0;
  do {
    find_contacts();
    if (passes_ == 0 || is_slow) stiffen(is_slow);
    const VectorXd u = u_;
    last_move_ = solve_pass(way, 1e-11);
    // Feet that go to and fro over an edge: a part of the way.
    if (passes_ > 20 && last_move_ > 0.9 * last) share = std::max(0.1, 0.7 * share);
    const double part = std::min(share, most / std::max(last_move_, 1e-30));
    if (part < 1.0) u_ = u + part * (u_ - u);
    // Normals that turn are followed by passes where these close in on them fast enough.
    is_slow = is_slow || (passes_ > 1 && last_move_ > 0.5 * last);
    last = last_move_;
    ++passes_;
  } while (last_move_ > still && passes_ < most_passes);
}

Wrench SurfaceTruth::step(const Vec3& place) {
  if (!placed_) place_ = place;
  placed_ = true;
  const Vec3 way = place - place_;
  previous_ = at_;
  place_ = place;
  for (int times = 0; times < 4; ++times) {
    find_pieces();
    number_near_nodes();
    settle(way);
    renew_surface();
    if (!is_out_of_sight()) break;
  }
  return wrench(place_);
}

double SurfaceTruth::dense_seconds(const Vec3& place, double tolerance) const {
  SurfaceTruth other(*this);
  other.is_linear_ = true;
  other.previous_ = other.at_;
  other.look();
  const double begin = processor_time();
  other.state_problem(place - place_);
  if (!other.contacts_.empty()) other.solver_.solve(tolerance);
  return processor_time() - begin;
}

int SurfaceTruth::closed() const {
  return static_cast<int>(last_.size());
}

}  // namespace palpate::test
