// GMRES in single precision, a product at a time.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

/// Right-preconditioned GMRES (Saad & Schultz 1986) of A y = b whose products the caller makes, so that
/// several systems can share the reading of a matrix:
///
///   write b to first(); begin(...);
///   while (!done()) { image() = preconditioned newest(); next() = A image(); expand(); }
///   solve(y);
///
/// Vectors are `stride` long; what is beyond `rows` of them is kept zero. All memory is taken at
/// construction.
class Gmres {
 public:
  Gmres(std::ptrdiff_t stride, int most_steps);

  [[nodiscard]] float* first() noexcept { return basis_.data(); }  ///< b [rows], before `begin`
  /// Starts on the b that stands in first(), zero beyond `rows`. Ends at a residual of `tolerance`, in b's
  /// unit, or after `steps` steps.
  void begin(std::ptrdiff_t rows, int steps, float tolerance) noexcept;
  [[nodiscard]] bool done() const noexcept { return done_; }
  [[nodiscard]] const float* newest() const noexcept { return basis_.data() + steps_ * stride_; }
  [[nodiscard]] float* image() noexcept { return images_.data() + steps_ * stride_; }
  [[nodiscard]] float* next() noexcept { return basis_.data() + (steps_ + 1) * stride_; }
  /// Takes `next` into the basis (Arnoldi, modified Gram & Schmidt).
  void expand() noexcept;
  /// The y [rows] of the smallest residual, a sum of images; what is beyond stays as it is.
  void solve(float* y) noexcept;

  [[nodiscard]] int steps() const noexcept { return steps_; }
  /// What the y of the last `solve` has of the image of a step.
  [[nodiscard]] float share(int step) const noexcept { return share_[static_cast<std::size_t>(step)]; }

 private:
  [[nodiscard]] float& h(int i, int j) noexcept { return H_[i * most_steps_ + j]; }
  void rotate(int column, float below) noexcept;

  std::ptrdiff_t stride_;
  int most_steps_;
  std::ptrdiff_t rows_ = 0;
  int limit_ = 0;  // of steps
  int steps_ = 0;
  float tolerance_ = 0.0F;
  bool done_ = true;
  std::vector<float> basis_;   // [(most_steps + 1) x stride]
  std::vector<float> images_;  // [most_steps x stride]
  std::vector<float> H_;       // [most_steps x most_steps] triangular: what rotations leave of Hessenberg's
  std::vector<float> cosine_, sine_;  // [most_steps]
  std::vector<float> g_;              // [most_steps + 1] right-hand side, rotated
  std::vector<float> share_;          // [most_steps] of each image
};

}  // namespace palpate
