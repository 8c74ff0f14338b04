#include "formats/field_counts.h"

#include <limits>
#include <utility>

#include "base/error.h"

namespace palpate {
namespace {

constexpr std::int64_t unknown = -1;

std::int64_t smallest(Count count) {
  switch (count) {
    case Count::one:
    case Count::elements:
    case Count::materials:
    case Count::stored_nodes:
    case Count::patches:
    case Count::modes:
    case Count::smooth_terms:
    case Count::near_pairs:
    case Count::clusters:
      return 1;
    case Count::nodes:
      return 3;
    default:
      return 0;
  }
}

bool counts_index_numbers(Count count) {
  return count == Count::nodes || count == Count::elements || count == Count::simplices ||
         count == Count::materials || count == Count::stored_nodes;
}

}  // namespace

void refuse(const std::string& where, const std::string& what) {
  throw Error(what, where, "Copy the file again, or precompute it again");
}

Counts::Counts(std::string where) : where_(std::move(where)) {
  values_.fill(unknown);
  values_[static_cast<std::size_t>(Count::one)] = 1;
}

void Counts::set(Count count, std::int64_t value, const char* told_by) {
  const std::int64_t least = count == Count::stored_nodes ? least_stored_ : smallest(count);
  if (value < least)
    refuse(where_, std::string(told_by) + " has " + std::to_string(value) + " entries, at least " +
                       std::to_string(least) + " are needed");
  if (counts_index_numbers(count) && value > std::numeric_limits<Index>::max() / 8)
    refuse(where_,
           std::string(told_by) + " has " + std::to_string(value) + " entries, more than can be numbered");
  values_[static_cast<std::size_t>(count)] = value;
  told_by_[static_cast<std::size_t>(count)] = told_by;
}

std::int64_t Counts::size(const Extent& extent) const {
  return extent.factor * values_[static_cast<std::size_t>(extent.count)] + extent.plus;
}

std::vector<std::int64_t> Counts::sizes(const std::vector<Extent>& shape) const {
  std::vector<std::int64_t> result;
  result.reserve(shape.size());
  for (const Extent& extent : shape) result.push_back(size(extent));
  return result;
}

void Counts::match(const char* path, const std::vector<Extent>& shape,
                   const std::vector<std::int64_t>& dims) {
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Extent& extent = shape[i];
    const auto which = static_cast<std::size_t>(extent.count);
    if (values_[which] == unknown) set(extent.count, (dims[i] - extent.plus) / extent.factor, path);
    if (dims[i] == size(extent)) continue;
    const bool by_another = told_by_[which] != nullptr && told_by_[which] != std::string(path);
    const std::string teller = by_another ? std::string(" by ") + told_by_[which] : "";
    refuse(where_, std::string(path) + " has size " + std::to_string(dims[i]) + ", " +
                       std::to_string(size(extent)) + " is expected" + teller);
  }
}

}  // namespace palpate
