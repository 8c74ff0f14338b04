#include <algorithm>
#include <array>
#include <utility>

#include "runtime/core/body/greens_on_top.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

class GreensWithTerms final : public GreensOnTop {
 public:
  GreensWithTerms(std::shared_ptr<const Greens> greens, ExactTerms terms)
      : GreensOnTop(std::move(greens)), terms_(std::move(terms)) {}

  [[nodiscard]] const ExactTerms* exact_terms() const noexcept override { return &terms_; }
  [[nodiscard]] const std::shared_ptr<const Greens>& without_terms() const noexcept { return shared_below(); }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    below().gather(row, columns, blocks);
    const std::int64_t d = dimension();
    double* block = blocks.data();
    for (std::int64_t axis = 0; axis < d; ++axis) {
      const double* by = terms_.left_row(d * row + axis);
      for (const Index column : columns) {
        for (std::int64_t j = 0; j < d; ++j)
          *block++ += dot(by, terms_.right_row(d * column + j), terms_.count);
      }
    }
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    below().displacement(nodes, f, ranges, u);
    const std::int64_t d = dimension();
    std::array<double, most_exact_terms> sum;
    std::fill_n(sum.begin(), terms_.count, 0.0);
    for (std::size_t i = 0; i < f.size(); ++i) {
      const std::int64_t dof = d * nodes[i / static_cast<std::size_t>(d)] + static_cast<std::int64_t>(i) % d;
      add(terms_.left_row(dof), f[i], sum.data(), terms_.count);
    }
    auto ui = u.begin();
    for (const NodeRange& range : ranges) {
      const double* row = terms_.right_row(d * range.first);
      for (std::int64_t dof = d * range.first; dof < d * range.end; ++dof) {
        *ui++ += dot(row, sum.data(), terms_.count);
        row += terms_.count;
      }
    }
  }

 private:
  ExactTerms terms_;
};

}  // namespace

std::shared_ptr<const Greens> with_terms(std::shared_ptr<const Greens> greens, const ExactTerms& terms) {
  ExactTerms all = terms;
  if (const auto* with = dynamic_cast<const GreensWithTerms*>(greens.get())) {
    const ExactTerms& first = *with->exact_terms();
    all.count = first.count + terms.count;
    const auto entries = static_cast<std::size_t>(greens->order() * all.count);
    const std::shared_ptr<double[]> left(new double[entries]), right(new double[entries]);
    for (std::int64_t dof = 0; dof < greens->order(); ++dof) {
      double* to = std::copy_n(first.left_row(dof), first.count, left.get() + dof * all.count);
      std::copy_n(terms.left_row(dof), terms.count, to);
      to = std::copy_n(first.right_row(dof), first.count, right.get() + dof * all.count);
      std::copy_n(terms.right_row(dof), terms.count, to);
    }
    all.left = left;
    all.right = right;
    greens = with->without_terms();
  }
  return std::make_shared<const GreensWithTerms>(std::move(greens), std::move(all));
}

std::shared_ptr<const Greens> with_modes(std::shared_ptr<const Greens> greens, const Modes& modes,
                                         std::span<const double> weights) {
  const auto k = static_cast<std::int64_t>(modes.count());
  const auto entries = static_cast<std::size_t>(greens->order() * k);
  const std::shared_ptr<double[]> left(new double[entries]), right(new double[entries]);
  for (std::int64_t dof = 0; dof < greens->order(); ++dof) {
    const double* row = modes.row(dof);
    std::copy_n(row, k, right.get() + dof * k);
    for (std::int64_t i = 0; i < k; ++i) left[dof * k + i] = weights[i] * row[i];
  }
  return with_terms(std::move(greens), {k, left, right});
}

}  // namespace palpate
