#include "runtime/depth/studied_range.h"

#include <numbers>

namespace palpate {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double linear_range = 19.0 * degree, deep_range = 90.0 * degree;  // tests/runtime/depth

}  // namespace

std::optional<double> studied_rotation(const Body& body) noexcept {
  if (body.live() != nullptr) return std::nullopt;
  return body.contact_model() == ContactModel::two_level ? deep_range : linear_range;
}

}  // namespace palpate
