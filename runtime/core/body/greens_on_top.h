// Green's functions made of others.
#pragma once

#include <memory>
#include <utility>

#include "runtime/core/body/greens.h"

namespace palpate {

/// Green's functions of the same nodes and storage as others, from which they differ by arithmetic.
class GreensOnTop : public Greens {
 public:
  [[nodiscard]] const Mat3& rotation(Index node) const noexcept override { return below().rotation(node); }
  [[nodiscard]] const ExactTerms* exact_terms() const noexcept override { return below().exact_terms(); }
  [[nodiscard]] bool unfolded() const noexcept override { return below().unfolded(); }
  [[nodiscard]] const HierarchicalMatrix* compressed_form() const noexcept override {
    return below().compressed_form();
  }

 protected:
  explicit GreensOnTop(std::shared_ptr<const Greens> below)
      : Greens(below->dimension(), below->nodes(), below->precision()), below_(std::move(below)) {}
  [[nodiscard]] const Greens& below() const noexcept { return *below_; }
  [[nodiscard]] const std::shared_ptr<const Greens>& shared_below() const noexcept { return below_; }

 private:
  std::shared_ptr<const Greens> below_;
};

}  // namespace palpate
