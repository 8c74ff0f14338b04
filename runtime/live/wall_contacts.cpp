#include "runtime/live/wall_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

namespace palpate {
namespace {

constexpr int most_rounds = 400;  // limit of the solver; no tick waits for it

/// Returns the normal and d - 1 tangents as columns; in the plane the tangent lies in it.
Mat3 frame_of(const Vec3& normal, int d) noexcept {
  Mat3 frame;
  const Vec3 first = d == 2 ? Vec3(-normal.y(), normal.x(), 0.0) : Vec3(normal.unitOrthogonal());
  frame << normal, first, normal.cross(first);
  return frame;
}

}  // namespace

WallContacts::WallContacts(const LiveBody& body, std::vector<Wall> walls, Index most)
    : body_(body),
      walls_(std::move(walls)),
      most_(walls_.empty() ? 1 : most),
      problem_(body.dimension(), most_, body.dimension() * most_),
      active_set_(body.dimension() * most_),
      cone_solver_(most_, body.dimension() * most_) {
  check_walls(walls_);
  cone_solver_.take_time(most_rounds);
  const int d = body.dimension();
  for (Index node = 0; node < std::ssize(body.mesh().nodes); ++node) {
    const auto free =
        body.free_of_dof().subspan(static_cast<std::size_t>(d * node), static_cast<std::size_t>(d));
    if (std::all_of(free.begin(), free.end(), [](Index k) { return k >= 0; })) nodes_.push_back(node);
  }
  has_contact_.resize(nodes_.size() * walls_.size());
}

Index WallContacts::closed() const noexcept {
  return static_cast<Index>(std::count_if(contacts_.begin(), contacts_.end(), [](const Contact& contact) {
    return contact.force != Vec3::Zero();
  }));
}

void WallContacts::begin(const Eigen::VectorXd& x) noexcept {
  from_ = x;
  contacts_.clear();
  std::fill(has_contact_.begin(), has_contact_.end(), false);
}

bool WallContacts::find(const Eigen::VectorXd& x) {
  const int d = body_.dimension();
  std::vector<std::pair<double, std::size_t>> deepest;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (std::size_t w = 0; w < walls_.size(); ++w) {
      const std::size_t pair = k * walls_.size() + w;
      if (has_contact_[pair]) continue;
      const auto at = gap_to(walls_[w], node_part(from_, d, nodes_[k]), node_part(x, d, nodes_[k]));
      if (at && at->gap < 0.0) deepest.emplace_back(at->gap, pair);
    }
  }
  std::sort(deepest.begin(), deepest.end());
  bool found = false;
  for (const auto& [gap, pair] : deepest) {
    if (count() >= most_) break;
    const Index node = nodes_[pair / walls_.size()];
    const Wall& wall = walls_[pair % walls_.size()];
    const auto at = gap_to(wall, node_part(from_, d, node), node_part(x, d, node));
    contacts_.push_back({.node = node, .wall = &wall, .normal = at->normal});
    has_contact_[pair] = true;
    found = true;
  }
  return found;
}

/// J^T [n x rows]: unit forces on the free dofs along the rows of all contacts.
Eigen::MatrixXd WallContacts::directions() const {
  const int d = body_.dimension();
  Index rows = 0;
  for (const Contact& contact : contacts_) rows += contact.wall->friction > 0.0 ? d : 1;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(body_.free_dofs(), rows);
  Eigen::Index row = 0;
  for (const Contact& contact : contacts_) {
    const Mat3 frame = frame_of(contact.normal, d);
    const Index first = body_.free_of_dof()[static_cast<std::size_t>(d * contact.node)];
    for (int k = 0; k < (contact.wall->friction > 0.0 ? d : 1); ++k, ++row)
      J.col(row).segment(first, d) = frame.col(k).head(d);
  }
  return J;
}

/// Fills the problem: W, the relative displacement along the rows without contact forces, and the present
/// forces as a guess.
void WallContacts::gather(const Eigen::MatrixXd& moved_by, const Eigen::MatrixXd& J, double ahead,
                          const Eigen::VectorXd& x) {
  const int d = body_.dimension();
  problem_.clear();
  for (const Contact& contact : contacts_) problem_.add(contact.wall->friction, false);
  const Eigen::MatrixXd W = J.transpose() * moved_by;
  for (Index i = 0; i < problem_.rows; ++i) {
    for (Index j = 0; j < problem_.rows; ++j) problem_.w(i, j) = W(i, j);
    problem_.w(i, i) *= 1.0 + 1e-9;
  }
  for (Index k = 0; k < count(); ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Mat3 frame = frame_of(contact.normal, d);
    const Vec3 from = node_part(from_, d, contact.node), moved = node_part(x, d, contact.node) - from;
    const auto at = gap_to(*contact.wall, from, from + ahead * moved);
    const Index first = problem_.first_row(k);
    for (Index row = 0; row < problem_.rows_of(k); ++row) {
      const double there = row > 0 ? frame.col(row).dot(moved) : at ? at->gap / ahead : 1.0;
      problem_.b[static_cast<std::size_t>(first + row)] = there;
      problem_.lambda[static_cast<std::size_t>(first + row)] = frame.col(row).dot(contact.force);
    }
  }
  for (Index i = 0; i < problem_.rows; ++i) {
    for (Index j = 0; j < problem_.rows; ++j)
      problem_.b[static_cast<std::size_t>(i)] -=
          problem_.w(i, j) * problem_.lambda[static_cast<std::size_t>(j)];
  }
}

bool WallContacts::solve(const TangentSolver& A, double ahead, Eigen::VectorXd& x) {
  bool solved = true;
  while (!contacts_.empty()) {
    solved = solve_found(A, ahead, x);
    if (!find(from_ + ahead * (x - from_))) break;
  }
  return solved;
}

/// Solves as `solve` does, for the known contacts.
bool WallContacts::solve_found(const TangentSolver& A, double ahead, Eigen::VectorXd& x) {
  const int d = body_.dimension();
  const Eigen::MatrixXd J = directions();
  const Eigen::MatrixXd moved_by = A.by_factor(J);
  gather(moved_by, J, ahead, x);
  const std::vector<double> before(problem_.lambda.begin(), problem_.lambda.begin() + problem_.rows);
  const bool solved = problem_.frictionless ? active_set_.solve(problem_) : cone_solver_.solve(problem_);
  Eigen::VectorXd change(problem_.rows);
  for (Index row = 0; row < problem_.rows; ++row)
    change[row] = problem_.lambda[static_cast<std::size_t>(row)] - before[static_cast<std::size_t>(row)];
  const Eigen::VectorXd dx = moved_by * change;
  for (Index free = 0; free < body_.free_dofs(); ++free) x[body_.dof_of_free()[free]] += dx[free];
  for (Index k = 0; k < count(); ++k) {
    Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Mat3 frame = frame_of(contact.normal, d);
    contact.force.setZero();
    for (Index row = 0; row < problem_.rows_of(k); ++row)
      contact.force +=
          problem_.lambda[static_cast<std::size_t>(problem_.first_row(k) + row)] * frame.col(row);
  }
  return solved;
}

void WallContacts::add_forces(Eigen::VectorXd& f) const noexcept {
  const int d = body_.dimension();
  for (const Contact& contact : contacts_)
    f.segment(Eigen::Index{d} * contact.node, d) += contact.force.head(d);
}

}  // namespace palpate
