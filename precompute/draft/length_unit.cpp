#include "precompute/draft/length_unit.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 5> named_units = {
    {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"um", 1e-6}, {"in", 0.0254}}};

/// A unit, and the usual lengths of bodies in files that have it [m].
struct Usual {
  std::string_view name;
  double metres, shortest, longest;
};

// Most surfaces are in millimetres, as written by CAD and segmentation; those in metres are smaller than 1.
constexpr std::array<Usual, 3> usual_units = {
    {{"mm", 0.001, 0.02, 2.0}, {"m", 1.0, 0.02, 0.5}, {"cm", 0.01, 0.02, 0.5}}};

}  // namespace

std::optional<LengthUnit> read_unit(std::string_view text) {
  for (const auto& [name, metres] : named_units)
    if (text == name) return LengthUnit{std::string(name), metres};
  double metres = 0.0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), metres);
  if (status != std::errc() || end != text.data() + text.size() || !std::isfinite(metres) || metres <= 0.0)
    return std::nullopt;
  return LengthUnit{fmt::format("1 unit = {} m", metres), metres};
}

UnitGuess guess_unit(double longest_side) {
  for (const Usual& usual : usual_units) {
    const double length = longest_side * usual.metres;
    if (length >= usual.shortest && length <= usual.longest) {
      return {{std::string(usual.name), usual.metres},
              fmt::format("the longest side is {:.3g}, which is {} in {}", longest_side, length_text(length),
                          usual.name)};
    }
  }
  const double metres = std::pow(10.0, -1.0 - std::floor(std::log10(longest_side)));
  return {*read_unit(fmt::format("{}", metres)),
          fmt::format("the longest side is {:.3g}, an organ's size in no usual unit; so it is {}",
                      longest_side, length_text(longest_side * metres))};
}

std::string length_text(double metres) {
  if (metres >= 1.0) return fmt::format("{:.3g} m", metres);
  if (metres >= 0.01) return fmt::format("{:.3g} cm", 100.0 * metres);
  if (metres >= 1e-4) return fmt::format("{:.3g} mm", 1e3 * metres);
  return fmt::format("{:.3g} um", 1e6 * metres);
}

}  // namespace palpate
