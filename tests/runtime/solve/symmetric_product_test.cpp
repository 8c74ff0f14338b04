// Products with symmetric matrices against plain sums in double precision.
#include "runtime/core/solve/symmetric_product.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace palpate {
namespace {

/// A random symmetric matrix; what products must not read is not a number.
struct Random {
  explicit Random(std::ptrdiff_t count)
      : rows(count),
        columns((count + 15) / 16 * 16),
        stride(columns + 16),
        A(at(rows * stride)),
        x(at(3 * stride)) {
    std::mt19937 random(static_cast<unsigned>(count));
    std::uniform_real_distribution<float> share(-1.0F, 1.0F);
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      for (std::ptrdiff_t k = 0; k < stride; ++k) {
        A[at(i * stride + k)] = k >= columns ? std::numeric_limits<float>::quiet_NaN()
                                : k >= rows  ? 0.0F
                                : k < i      ? A[at(k * stride + i)]
                                             : share(random);
      }
    }
    for (int s = 0; s < 3; ++s) {
      for (std::ptrdiff_t k = 0; k < rows; ++k) x[at(s * stride + k)] = share(random);
    }
  }

  static std::size_t at(std::ptrdiff_t i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] SymmetricRows matrix() const { return {A.data(), stride, rows, columns}; }

  void expect_product(const std::vector<float>& y, int s) const {
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      double sum = 0.0;
      for (std::ptrdiff_t k = 0; k < rows; ++k) sum += double{A[at(i * stride + k)]} * x[at(s * stride + k)];
      EXPECT_NEAR(y[at(s * stride + i)], sum, 1e-6 * static_cast<double>(rows)) << i << " of " << rows;
    }
    for (std::ptrdiff_t i = rows; i < columns; ++i)
      EXPECT_EQ(y[at(s * stride + i)], 0.0F) << i << " of " << rows;
  }

  std::ptrdiff_t rows, columns, stride;
  std::vector<float> A, x;
};

class SymmetricProduct : public testing::TestWithParam<std::ptrdiff_t> {};
INSTANTIATE_TEST_SUITE_P(Rows, SymmetricProduct, testing::Values(1, 3, 7, 8, 9, 16, 39, 64, 123, 300));

TEST_P(SymmetricProduct, OfOneVectorIsThePlainSum) {
  const Random random(GetParam());
  std::vector<float> y(random.x.size(), 7.0F);
  multiply(random.matrix(), random.x.data(), y.data());
  random.expect_product(y, 0);
}

TEST_P(SymmetricProduct, OfThreeVectorsIsThePlainSumOfEach) {
  const Random random(GetParam());
  std::vector<float> y(random.x.size(), 7.0F);
  multiply_three(random.matrix(), random.x.data(), y.data(), random.stride);
  for (int s = 0; s < 3; ++s) random.expect_product(y, s);
}

}  // namespace
}  // namespace palpate
