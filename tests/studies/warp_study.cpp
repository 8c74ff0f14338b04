// How far small strain, turned blocks and warping are right: cantilevers bent by a force at their end.
//
//   warp_study
//
// Prints CSV: element, load, law, angle [degrees], errors of force and displacement against the corotational
// body of the same mesh. scripts/studies/warp makes tables and a picture of it.
#include <fmt/format.h>

#include <cstdio>
#include <numbers>

#include "tests/support/bodies/warp_cases.h"

namespace palpate::test {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

void study(ElementType type, BendingLoad load) {
  const Model model = bent_model(type);
  const int d = model.dimension();
  const Body body(warped_model(model), {}, 1, ContactModel::warped);
  const auto first = bend(model.mesh, small_strain(body), load, 1e-6, 1.0, 1).back();
  const double step = 1e-6 * (d == 2 ? 1.5 : 4.0) * degree / first.angle;
  const double most = (load == BendingLoad::follows ? 95.0 : 65.0) * degree;
  const std::vector<Bent> truth = bend(model.mesh, corotational(model), load, step, most);
  const std::vector<std::pair<const char*, BendingLaw>> laws = {
      {"linear", small_strain(body)}, {"turned", turned_blocks(body)}, {"warped", warped(body)}};
  for (const auto& [name, law] : laws) {
    const auto curve = bend(model.mesh, law, load, step, 1.5 * most,
                            static_cast<int>(1.5 * static_cast<double>(truth.size())));
    for (int angle = 5; angle <= (load == BendingLoad::follows ? 90 : 60); angle += 5) {
      const BendingError error = bending_error(truth, curve, angle * degree, d);
      fmt::print("{},{},{},{},{:.5f},{:.5f}\n", traits(type).name,
                 load == BendingLoad::follows ? "follows" : "upright", name, angle, error.force,
                 error.displacement);
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace palpate::test

int main() {
  using namespace palpate;
  fmt::print("element,load,law,angle,force,displacement\n");
  for (const ElementType type : {ElementType::quad4}) {
    test::study(type, test::BendingLoad::follows);
    test::study(type, test::BendingLoad::upright);
  }
}
