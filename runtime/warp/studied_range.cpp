#include "runtime/warp/studied_range.h"

#include <numbers>

#include "statics/range_of_errors.h"

namespace palpate {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double linear_range = 19.0 * degree, warped_range = 90.0 * degree;  // scripts/studies/warp

}  // namespace

std::optional<double> studied_rotation(const Body& body) noexcept {
  if (body.live() != nullptr) return std::nullopt;
  const bool is_warped = body.contact_model() == ContactModel::warped;
  if (const WarpStudy& study = body.model().warp; study.any())
    return range_within(study.rotation, is_warped ? study.warped.force : study.linear.force,
                        good_bending_error);
  return is_warped ? warped_range : linear_range;
}

}  // namespace palpate
