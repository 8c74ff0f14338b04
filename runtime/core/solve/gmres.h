// GMRES in single precision, with products supplied by the caller.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

/// Right-preconditioned GMRES (Saad & Schultz 1986) for A y = b. The caller computes the products, so that
/// several systems can be multiplied while a matrix is read once:
///
///   write b to first(); begin(...);
///   while (!done()) { image() = preconditioned newest(); next() = A image(); expand(); }
///   solve(y);
///
/// Vectors are `stride` long; entries beyond `rows` stay zero. All memory is allocated at construction.
class Gmres {
 public:
  Gmres(std::ptrdiff_t stride, int most_steps);

  [[nodiscard]] float* first() noexcept { return basis_.data(); }  ///< b [rows], before `begin`
  /// Starts with the b in first(), zero beyond `rows`. Ends at a residual of `tolerance`, in the unit of b,
  /// or after `steps` steps.
  void begin(std::ptrdiff_t rows, int steps, float tolerance) noexcept;
  [[nodiscard]] bool done() const noexcept { return done_; }
  [[nodiscard]] const float* newest() const noexcept { return basis_.data() + steps_ * stride_; }
  [[nodiscard]] float* image() noexcept { return images_.data() + steps_ * stride_; }
  [[nodiscard]] float* next() noexcept { return basis_.data() + (steps_ + 1) * stride_; }
  /// Adds `next` to the basis (Arnoldi, modified Gram-Schmidt).
  void expand() noexcept;
  /// Computes the y [rows] of the smallest residual, a sum of images; entries beyond are unchanged.
  void solve(float* y) noexcept;

  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// Coefficient of the image of a step in the y of the last `solve`.
  [[nodiscard]] float share(int step) const noexcept { return share_[static_cast<std::size_t>(step)]; }

 private:
  [[nodiscard]] float& h(int i, int j) noexcept { return H_[i * most_steps_ + j]; }
  void rotate(int column, float below) noexcept;

  std::ptrdiff_t stride_;
  int most_steps_;
  std::ptrdiff_t rows_ = 0;
  int limit_ = 0;  // limit of steps
  int steps_ = 0;
  float tolerance_ = 0.0F;
  bool done_ = true;
  std::vector<float> basis_;          // [(most_steps + 1) x stride]
  std::vector<float> images_;         // [most_steps x stride]
  std::vector<float> H_;              // [most_steps x most_steps] triangular: the rotated Hessenberg matrix
  std::vector<float> cosine_, sine_;  // [most_steps]
  std::vector<float> g_;              // [most_steps + 1] right-hand side, rotated
  std::vector<float> share_;          // [most_steps] coefficient of each image
};

}  // namespace palpate
