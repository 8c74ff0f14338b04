#include "precompute/warping/warp_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "precompute/warping/bent_body.h"
#include "precompute/warping/loaded_part.h"
#include "statics/range_of_errors.h"

namespace palpate {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double none = std::numeric_limits<double>::infinity();
constexpr double same_direction = 1e-5;  // the force no longer rotates
constexpr int most_turns = 60;
constexpr double same_way = 1e-5;  // relative tolerance of the part's displacement
constexpr int most_tries = 20;
constexpr double near_enough = 1e-3;  // relative tolerance of the final angle
constexpr double first_turn = 1e-3;   // [rad] small enough for the stiffness at rest
constexpr double most_growth = 2.0;   // of the force from level to level
constexpr int most_halvings = 5;      // of a step of the force, if there is no balance

/// Displacement by a law under a force; nullopt if it has no solution.
using Law = std::function<std::optional<SurfaceDisplacement>(const Vec3& force)>;

/// A law under a force that rotates with the loaded part.
class Followed {
 public:
  Followed(const BentBody& body, const Vec3& direction, Law law)
      : body_(body), first_(direction), direction_(direction), law_(std::move(law)) {}

  /// Displacement under the force. Its direction is a fixed point, found by Aitken's relaxation: when far
  /// bent, the body rotates by more than the direction was changed.
  [[nodiscard]] std::optional<SurfaceDisplacement> under(double force) {
    const Vec3 start = direction_;
    Vec3 before = Vec3::Zero();
    double share = 1.0;
    for (int turn = 0; turn < most_turns; ++turn) {
      std::optional<SurfaceDisplacement> u = law_(force * direction_);
      if (!u) break;
      const Vec3 off = body_.turned(*u) * first_ - direction_;
      if (off.norm() < same_direction) return u;
      if (turn > 0) share *= -before.dot(off - before) / (off - before).squaredNorm();
      share = std::clamp(share, 0.05, 1.0);
      direction_ = (direction_ + share * off).normalized();
      before = off;
    }
    direction_ = start;
    return std::nullopt;
  }

  /// Displacement of the part along the first direction [m]; infinite if there is no solution.
  [[nodiscard]] double way(double force) {
    const std::optional<SurfaceDisplacement> u = under(force);
    return u ? first_.dot(body_.moved(*u)) : none;
  }

  /// Force that moves the part by `way` [N], starting from `force`, which moves it by `there`; infinite if
  /// none is found.
  [[nodiscard]] double force_for(double way, double force, double there) {
    double before = 0.0, way_before = 0.0;
    for (int k = 0; k < most_tries && std::isfinite(there); ++k) {
      if (std::abs(there - way) <= same_way * std::abs(way)) return force;
      const double slope = (there - way_before) / (force - before);
      if (!(slope > 0.0)) break;
      const double next = std::clamp(force + (way - there) / slope, 0.5 * force, 2.0 * force);
      before = force;
      way_before = there;
      force = next;
      there = this->way(force);
    }
    return none;
  }

 private:
  const BentBody& body_;
  Vec3 first_, direction_;
  Law law_;
};

/// Computation of the levels, and the study as it grows.
class Bending {
 public:
  Bending(const Model& model, std::vector<Index> nodes, const std::optional<Vec3>& direction)
      : body_(model, nodes),
        direction_(direction ? direction->normalized()
                             : softest_direction(body_.softness(), model.dimension())),
        truth_(body_, direction_, [this](const Vec3& f) { return body_.corotational(f); }),
        linear_(body_, direction_, [this](const Vec3& f) { return std::optional(body_.linear(f)); }),
        warped_(body_, direction_, [this](const Vec3& f) { return body_.warped(f); }) {
    study_.nodes = std::move(nodes);
    study_.direction = direction_;
  }

  /// Increases the force until the surface has rotated by the requested angle.
  std::optional<WarpStudyResult> run(const WarpOptions& options, const WarpStudyProgress& progress) {
    const double small = first_turn / body_.rotation(body_.linear(direction_));
    double softness = body_.rotation(body_.linear(small * direction_)) / small;  // [rad/N]
    double force = 0.0, turned = 0.0;
    while (turned < (1.0 - near_enough) * options.angle) {
      if (!progress(turned / options.angle)) return std::nullopt;
      const double wanted = std::min(options.angle / options.levels, options.angle - turned);
      double step = std::min(wanted / softness, force > 0.0 ? (most_growth - 1.0) * force : none);
      const Eigen::VectorXd place = body_.place();
      std::optional<SurfaceDisplacement> u;
      for (int k = 0; k < most_halvings && !(u = truth_.under(force + step)); ++k) {
        body_.go_back(place);
        step *= 0.5;
      }
      if (!u)
        return ended(options,
                     "beyond, no balance of the corotational body was found without elements inside out");
      const double now = body_.rotation(*u);
      if (!(now > turned)) return ended(options, "the body does not turn further");
      add_level(force + step, now, *u);
      softness = (now - turned) / step;
      force += step;
      turned = now;
      if (std::ssize(study_.force) >= 4 * options.levels)
        return ended(options, "the body hardly turns further");
    }
    return WarpStudyResult{std::move(study_), ""};
  }

  WarpStudy at(const std::vector<double>& forces) {
    for (const double force : forces) {
      const std::optional<SurfaceDisplacement> u = truth_.under(force);
      if (!u) break;
      add_level(force, body_.rotation(*u), *u);
    }
    return std::move(study_);
  }

 private:
  void add_level(double force, double rotation, const SurfaceDisplacement& u) {
    const Vec3 truth = body_.moved(u);
    study_.force.push_back(force);
    study_.rotation.push_back(rotation);
    add_errors(linear_, force, truth, study_.linear);
    add_errors(warped_, force, truth, study_.warped);
  }

  void add_errors(Followed& law, double force, const Vec3& truth, WarpStudy::Errors& errors) const {
    const std::optional<SurfaceDisplacement> u = law.under(force);
    const Vec3 moved = u ? body_.moved(*u) : Vec3::Zero();
    errors.displacement.push_back(u ? (moved - truth).norm() / truth.norm() : none);
    const double way = direction_.dot(truth);
    const double found = u && way > 0.0 ? law.force_for(way, force, direction_.dot(moved)) : none;
    errors.force.push_back(found / force - 1.0);
  }

  std::optional<WarpStudyResult> ended(const WarpOptions& options, const std::string& why) {
    if (study_.force.empty()) {
      throw Error("[warp]: the body cannot be bent: " + why, options.place,
                  "give another direction or part of the surface, or leave out [warp]");
    }
    const std::string note = fmt::format("ends at {:.0f} degrees: {}", study_.rotation.back() / degree, why);
    return WarpStudyResult{std::move(study_), note};
  }

  BentBody body_;
  Vec3 direction_;
  Followed truth_, linear_, warped_;
  WarpStudy study_;
};

}  // namespace

std::string range_text(const WarpStudy& study) {
  const auto range = [&](const WarpStudy::Errors& errors) {
    return range_within(study.rotation, errors.force, good_bending_error) / degree;
  };
  return fmt::format(
      "forces within 5 % up to {:.0f} degrees by small strain, {:.0f} warped (studied to {:.0f})",
      range(study.linear), range(study.warped), study.rotation.back() / degree);
}

std::optional<WarpStudyResult> study_warp(const Model& model, const WarpOptions& options,
                                          const WarpStudyProgress& progress) {
  return Bending(model, loaded_nodes(model, options.where, options.place), options.direction)
      .run(options, progress);
}

WarpStudy repeat_warp_study(const Model& model) {
  return Bending(model, model.warp.nodes, model.warp.direction).at(model.warp.force);
}

}  // namespace palpate
