#include "precompute/numerics/precision.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "precompute/numerics/smooth_part.h"
#include "precompute/numerics/touches.h"

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;
using Refined = RefinedSolution::Refined;

constexpr std::size_t softest_places = 4, random_places = 4;
constexpr std::array<std::size_t, 4> touched_nodes = {1, 2, 5, 30};
constexpr Eigen::Index columns_at_once = 24;
constexpr double fine_reference = 1e-8;  // force error of plain solves that is acceptable for the reference
constexpr double safety = 4.0;           // factor of the tick's addition, as in assemble_contact

/// Stored nodes of the surface that are free along every axis, in the order of their mesh nodes.
std::vector<Index> free_surface_nodes(const Model& model) {
  std::vector<bool> on_surface(model.mesh.nodes.size(), false);
  for (const Index node : model.surface) on_surface[static_cast<std::size_t>(node)] = true;
  std::vector<Index> stored(model.stored_nodes.size());
  std::iota(stored.begin(), stored.end(), 0);
  std::erase_if(stored, [&](Index k) {
    const auto node = static_cast<std::size_t>(model.stored_nodes[static_cast<std::size_t>(k)]);
    return !on_surface[node] || model.fixed[node] != 0;
  });
  std::sort(stored.begin(), stored.end(), [&](Index a, Index b) {
    return model.stored_nodes[static_cast<std::size_t>(a)] < model.stored_nodes[static_cast<std::size_t>(b)];
  });
  return stored;
}

const Vec3& position(const Model& model, Index stored) {
  return model.mesh.nodes[static_cast<std::size_t>(model.stored_nodes[static_cast<std::size_t>(stored)])];
}

/// Nodes nearest to `node`, itself first.
std::vector<Index> nearest(const Model& model, const std::vector<Index>& nodes, Index node) {
  std::vector<std::pair<double, Index>> by_distance;
  by_distance.reserve(nodes.size());
  for (const Index other : nodes)
    by_distance.emplace_back((position(model, other) - position(model, node)).squaredNorm(), other);
  const auto count = std::min(nodes.size(), touched_nodes.back());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count),
                    by_distance.end());
  std::vector<Index> result;
  for (std::size_t k = 0; k < count; ++k) result.push_back(by_distance[k].second);
  return result;
}

/// Loss of a unit displacement of one node in the common part of many nodes: K's diagonal times the
/// compliance of the smooth part.
double amplification(const Model& model, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                     const SmoothPart& smooth, Index node) {
  double most = 0.0;
  for (int axis = 0; axis < model.dimension(); ++axis) {
    const std::int64_t dof = std::int64_t{model.dimension()} * node + axis,
                       of_K = stored_dofs[static_cast<std::size_t>(dof)];
    most = std::max(most, K.coeff(of_K, of_K) * smooth(dof, dof));
  }
  return most;
}

/// Nodes of each place.
std::vector<std::vector<Index>> choose_places(const Model& model, const SparseMatrix& K,
                                              std::span<const std::int64_t> stored_dofs,
                                              const SmoothPart& smooth) {
  const std::vector<Index> nodes = free_surface_nodes(model);
  std::vector<std::pair<double, Index>> by_amplification;
  by_amplification.reserve(nodes.size());
  for (const Index node : nodes)
    by_amplification.emplace_back(
        -(smooth.terms == 0 ? 0.0 : amplification(model, K, stored_dofs, smooth, node)), node);
  std::sort(by_amplification.begin(), by_amplification.end());
  std::vector<std::vector<Index>> places;
  std::vector<bool> near(model.stored_nodes.size(), false);
  const auto add = [&](Index node) {
    places.push_back(nearest(model, nodes, node));
    for (const Index other : places.back()) near[static_cast<std::size_t>(other)] = true;
  };
  for (const auto& [minus_amplification, node] : by_amplification)
    if (places.size() < softest_places && !near[static_cast<std::size_t>(node)]) add(node);
  std::mt19937_64 random(23);
  for (std::size_t k = 0; k < std::min(random_places, nodes.size()); ++k) add(nodes[random() % nodes.size()]);
  return places;
}

/// Estimated force error of a touch by plain solves: their error in the columns of the place's first node
/// times K's diagonal.
double reference_error(const Model& model, const Factor& factor, const SparseMatrix& K,
                       std::span<const std::int64_t> stored_dofs, const TouchedPlace& place) {
  double worst = 0.0;
  for (int axis = 0; axis < model.dimension(); ++axis) {
    const std::int64_t of_K =
        stored_dofs[static_cast<std::size_t>(place.dofs[static_cast<std::size_t>(axis)])];
    Matrix b = Matrix::Zero(factor.order(), 1);
    b(of_K, 0) = 1.0;
    const RefinedSolution x = solve_refined(factor, K, b);
    const long double difference = (x.plain.cast<long double>() - x.refined).cwiseAbs().maxCoeff();
    worst = std::max(worst, K.coeff(of_K, of_K) * static_cast<double>(difference));
  }
  return worst;
}

/// Computes C of the place's dofs.
void solve_place(const Factor& factor, const SparseMatrix& K, std::span<const std::int64_t> stored_dofs,
                 bool refine, TouchedPlace& place) {
  const auto size = static_cast<Eigen::Index>(place.dofs.size());
  const auto of_K = [&](Eigen::Index i) {
    return stored_dofs[static_cast<std::size_t>(place.dofs[static_cast<std::size_t>(i)])];
  };
  place.reference.resize(size, size);
  place.plain.resize(size, size);
  for (Eigen::Index first = 0; first < size; first += columns_at_once) {
    const Eigen::Index count = std::min(columns_at_once, size - first);
    Matrix b = Matrix::Zero(factor.order(), count);
    for (Eigen::Index j = 0; j < count; ++j) b(of_K(first + j), j) = 1.0;
    const RefinedSolution x = refine ? solve_refined(factor, K, b) : solve_plain(factor, b);
    for (Eigen::Index i = 0; i < size; ++i) {
      place.plain.row(i).segment(first, count) = x.plain.row(of_K(i));
      place.reference.row(i).segment(first, count) = x.refined.row(of_K(i));
    }
  }
  // As in a packed matrix, an entry and its mirror image are one number, from the earlier column.
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j)
      if (place.dofs[static_cast<std::size_t>(j)] < place.dofs[static_cast<std::size_t>(i)])
        place.plain(j, i) = place.plain(i, j);
  }
  place.reference = ((place.reference + place.reference.transpose()) / 2.0L).eval();
}

StoredEntry split(const SmoothPart& smooth, std::int64_t terms, std::int64_t i, std::int64_t j,
                  double entry) {
  const double *a = smooth.row(i), *b = smooth.row(j);
  const double common = std::inner_product(a, a + terms, b, 0.0);
  const double rounded = static_cast<double>(static_cast<float>(entry - common));
  return {rounded + common, rounded};
}

}  // namespace

SmoothPart largest_smooth_part(const Factor& factor, const SparseMatrix& K,
                               std::span<const std::int64_t> stored_dofs) {
  const std::int64_t free =
      std::count_if(stored_dofs.begin(), stored_dofs.end(), [](std::int64_t dof) { return dof >= 0; });
  return smooth_part(factor, K, stored_dofs, std::clamp<std::int64_t>(free / 4, 1, tried_terms.back()));
}

std::vector<TouchedPlace> touched_places(const Model& model, const Factor& factor, const SparseMatrix& K,
                                         std::span<const std::int64_t> stored_dofs,
                                         const SmoothPart& smooth) {
  std::vector<TouchedPlace> places;
  for (const std::vector<Index>& nodes : choose_places(model, K, stored_dofs, smooth)) {
    TouchedPlace& place = places.emplace_back();
    for (const Index node : nodes) {
      place.arms.push_back(position(model, node) - position(model, nodes.front()));
      for (int axis = 0; axis < model.dimension(); ++axis)
        place.dofs.push_back(std::int64_t{model.dimension()} * node + axis);
    }
  }
  bool refine = false;
  for (const TouchedPlace& place : places)
    refine = refine || reference_error(model, factor, K, stored_dofs, place) > fine_reference;
  for (TouchedPlace& place : places) solve_place(factor, K, stored_dofs, refine, place);
  return places;
}

double force_error(std::span<const TouchedPlace> places, int dimension, const StoredEntries& entries,
                   double rounding) {
  double worst = 0.0;
  std::mt19937_64 random(29);
  for (const TouchedPlace& place : places) {
    const std::size_t size = place.dofs.size();
    Matrix C(place.reference.rows(), place.reference.cols());
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) {
        const StoredEntry entry = entries(place, i, j);
        double& c = C(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
        c = entry.value;
        if (i == j)
          c += safety * (rounding * std::abs(entry.rounded) +
                         std::numeric_limits<double>::epsilon() * std::abs(entry.value - entry.rounded));
      }
    }
    for (std::size_t k = 0; k < touched_nodes.size(); ++k) {
      const std::size_t nodes = std::min(touched_nodes[k], place.arms.size());
      if (k > 0 && nodes <= touched_nodes[k - 1]) break;
      const Matrix u = touch_displacements(std::span(place.arms).first(nodes), dimension, random);
      worst = std::max(worst, touch_error(place.reference, C, u, dimension));
    }
  }
  return worst;
}

double force_error(std::span<const TouchedPlace> places, int dimension, const PackedGreens& stored) {
  const double rounding = has_float_entries(stored.precision())
                              ? double{std::numeric_limits<float>::epsilon()}
                              : std::numeric_limits<double>::epsilon();
  const auto entries = [&](const TouchedPlace& place, std::size_t i, std::size_t j) {
    return StoredEntry{stored(place.dofs[i], place.dofs[j]), stored.stored(place.dofs[i], place.dofs[j])};
  };
  return force_error(places, dimension, entries, rounding);
}

PrecisionStudy::PrecisionStudy(const Model& model, const Factor& factor, const SparseMatrix& K,
                               std::span<const std::int64_t> stored_dofs)
    : dimension_(model.dimension()),
      smooth_(largest_smooth_part(factor, K, stored_dofs)),
      places_(touched_places(model, factor, K, stored_dofs, smooth_)) {}

double PrecisionStudy::error(Precision precision, std::int64_t terms) const {
  const double rounding = has_float_entries(precision) ? double{std::numeric_limits<float>::epsilon()}
                                                       : std::numeric_limits<double>::epsilon();
  const auto entries = [&](const TouchedPlace& place, std::size_t i, std::size_t j) -> StoredEntry {
    const double entry = place.plain(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    if (precision == Precision::split_precision)
      return split(smooth_, std::min(terms, smooth_.terms), place.dofs[i], place.dofs[j], entry);
    const double stored =
        precision == Precision::double_precision ? entry : static_cast<double>(static_cast<float>(entry));
    return {stored, stored};
  };
  return force_error(places_, dimension_, entries, rounding);
}

std::shared_ptr<const SmoothPart> PrecisionStudy::smooth(std::int64_t terms) const {
  return std::make_shared<const SmoothPart>(first_terms(smooth_, std::min(terms, smooth_.terms)));
}

PrecisionChoice choose_precision(std::span<const PrecisionStudy> studies, std::optional<Precision> wanted) {
  struct Candidate {
    Precision precision;
    std::int64_t terms;
  };
  std::vector<Candidate> candidates = {{Precision::single_precision, 0}};
  for (const std::int64_t terms : tried_terms) candidates.push_back({Precision::split_precision, terms});
  candidates.push_back({Precision::double_precision, 0});
  if (wanted) std::erase_if(candidates, [&](const Candidate& c) { return c.precision != *wanted; });

  PrecisionChoice choice;
  choice.errors.resize(studies.size());
  for (const Candidate& candidate : candidates) {
    choice.precision = candidate.precision;
    choice.terms = candidate.terms;
    double worst = 0.0;
    for (std::size_t k = 0; k < studies.size(); ++k) {
      choice.errors[k][candidate.precision] = studies[k].error(candidate.precision, candidate.terms);
      worst = std::max(worst, choice.errors[k][candidate.precision]);
    }
    if (worst <= good_force_error) break;
  }
  return choice;
}

std::string errors_text(std::span<const ForceErrors> errors) {
  std::string text;
  for (const Precision precision :
       {Precision::single_precision, Precision::split_precision, Precision::double_precision}) {
    double worst = ForceErrors::not_measured;
    for (const ForceErrors& of_matrix : errors) worst = std::max(worst, of_matrix[precision]);
    if (worst >= 0.0) text += fmt::format("{}{} {:.1e}", text.empty() ? "" : ", ", name_of(precision), worst);
  }
  return text;
}

}  // namespace palpate
