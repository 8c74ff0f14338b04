// A step of Newton's method on the contacts that are closed.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "runtime/core/solve/contact_law.h"
#include "runtime/core/solve/gmres.h"
#include "runtime/core/solve/symmetric_product.h"

namespace palpate {

/// Multiplications of a product with W, including its overhead.
[[nodiscard]] double product_work(std::ptrdiff_t rows) noexcept;

/// The contacts that are not open, to first order: three unknowns at one that sticks, two at one that slips
/// and one without friction, by GMRES with each contact's own compliance as preconditioner, in single
/// precision. All memory is taken at construction.
class ReducedContacts {
 public:
  static constexpr int most_changes = 3;

  /// `stride`: capacity in rows, in whole registers.
  ReducedContacts(Index max_contacts, std::ptrdiff_t stride);

  /// Takes those of `contacts` that are not open. W is read until the last call of the next ones.
  void reduce(std::span<const ContactLaw> contacts, const SymmetricRows& W) noexcept;
  [[nodiscard]] bool empty() const noexcept { return active_ == 0; }

  /// Fills `change` [rows] with the change of the forces that undoes the motion r [rows], and adds to r the
  /// motion by it. False, with r as it was, where it is not finite.
  bool step(float* r, float* change) noexcept;
  [[nodiscard]] int products() const noexcept { return products_; }  ///< with W, of the last `step`

  /// Change of the forces when the motion changes by `db`, for up to three changes: `db` and `dlambda`
  /// [changes x rows]; dlambda holds a guess before, which may be zero.
  void derivative(int changes, std::span<const double> db, std::span<double> dlambda) noexcept;

 private:
  /// A contact: matrices by rows.
  struct Reduced {
    Index first = 0;  // row
    int rows = 0;
    std::array<float, 9> image{};    // forces from unknowns
    std::array<float, 9> test{};     // equations from motions
    std::array<float, 9> inverse{};  // unknowns from equations, for the contact alone
    float turning = 0.0F;            // second equation from the second unknown
  };

  [[nodiscard]] std::span<const Reduced> active() const noexcept {
    return std::span(reduced_).first(active_);
  }
  void fill_image(const float* y, float* x) const noexcept;
  void test(const float* motion, float* out) const noexcept;
  void multiply_by_compliance(int systems) noexcept;
  void solve(int systems) noexcept;
  bool fill_guess(std::span<const double> dlambda, int changes) noexcept;
  [[nodiscard]] int most_steps() const noexcept;

  std::ptrdiff_t stride_;  // length of vectors
  SymmetricRows W_{};
  std::vector<Reduced> reduced_;  // [max_contacts] the first active_ are used
  std::size_t active_ = 0;
  std::vector<Gmres> gmres_;    // [most_changes]
  std::vector<float> x_, v_;    // [most_changes x stride] forces, and motions by them
  std::vector<float> y_;        // [most_changes x stride] unknowns
  std::vector<float> step_;     // [stride]
  std::vector<float> motions_;  // [most steps x stride] motions by the images of GMRES, for one system
  int products_ = 0;
};

}  // namespace palpate
