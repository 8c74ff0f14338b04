// The rows of the contact problem, and what the body gives way along them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/memory.h"
#include "runtime/core/body/near_field.h"
#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// Row of J: a unit force along it exerts -body[n] on the near node at places[n], and `force` and the
/// `moment` about its origin on the tool.
struct ContactRow {
  std::array<Index, 3> places{-1, -1, -1};                             ///< in the near field; -1 for none
  std::array<Vec3, 3> body{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< zero if there is no node
  Index tool = -1;                                                     ///< -1: the row acts on no tool
  Vec3 force = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  ///< [m]
};

/// J Xi J^T, in the precision of the problem that it is for. In single precision, which is of many contact
/// points, it is kept from tick to tick: what is computed is what rows have that are other than in the tick
/// before. A row is the same when it has the same share of the same surface nodes, wherever they stand in the
/// near field. All memory is taken at construction.
class BodyCompliance {
 public:
  /// Capacity for rows in double and in single precision.
  BodyCompliance(Index max_rows, Index max_single_rows, Index max_near_dofs);

  /// Keeps nothing.
  void forget() noexcept { kept_rows_ = 0; }
  /// Makes problem's W the body's compliance along problem.rows rows. In single precision W has to hold what
  /// the last call left there, except its diagonal, which may have been changed; or, if more is to be
  /// changed, W is left as it is and `body` has it (`apart`). Rows from `first_tilt_row` on are those of
  /// tilts.
  void assemble(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row, bool apart,
                ContactProblem& problem) noexcept;
  /// The body's part as the last call has put it, by the problem's W.
  [[nodiscard]] MatrixRows<double> body(MatrixRows<double> W) noexcept { return W; }
  [[nodiscard]] MatrixRows<float> body(MatrixRows<float> W) noexcept {
    return apart_ ? MatrixRows<float>{kept_.data(), W.stride} : W;
  }

  /// Number of rows computed by the last call.
  [[nodiscard]] Index renewed() const noexcept { return renewed_; }

 private:
  /// A row's load on a node.
  struct NodeLoad {
    Index dof = 0;  // of the near field, the node's first
    std::array<double, 4> force{};
  };
  /// Largest number of entries of a row of J: d at each of three nodes. Entry t of row i is stored at t rows
  /// + i, so that all rows are processed at once.
  static constexpr int most_entries = 9;

  void fill(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
            MatrixRows<double> W) noexcept;
  void fill(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
            MatrixRows<float> W) noexcept;
  template <int D>
  void fill_between_nodes(const NearField& near, std::span<const ContactRow> rows,
                          MatrixRows<double> W) noexcept;
  bool enter(const NearField& near, const ContactRow& row, Index i) noexcept;
  void respond(const NearField& near, Index row) noexcept;
  void project(Index begin, Index end, int entries, float* w) const noexcept;

  // In double precision.
  std::vector<std::size_t> loads_end_;  // [rows + 1] of each row's in loads_, after that of the row before
  std::vector<NodeLoad> loads_;         // [3 x rows] `dof`: a number; then [nodes] with Xi J^T there [m/N]

  // In single precision.
  Index stride_;
  std::vector<Index> dof_;            // [9 x stride] d surface node + axis of each entry; -1: none
  std::vector<Index> place_;          // [9 x stride] dof of the near field; 0: none
  std::vector<float> factor_;         // [9 x stride] 0 if there is no entry
  std::vector<int> entries_;          // [stride] entries of each row
  std::vector<std::uint8_t> is_new_;  // [stride]
  std::vector<float> diagonal_;       // [stride] diagonal of the body's compliance
  std::vector<float> response_;       // [near dofs] column of Xi J^T [m/N]
  LargeVector<float> kept_;           // [rows x stride of W]
  bool apart_ = false;                // it is in kept_
  Index kept_rows_ = 0;
  Index renewed_ = 0;
  std::int64_t revision_ = -1;  // revision of the near field
};

}  // namespace palpate
