// Sizes common to several fields of a file, and the checks of one field's values.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include "formats/model_fields.h"

namespace palpate {

/// Throws Error: `what` is wrong with the file `where`.
[[noreturn]] void refuse(const std::string& where, const std::string& what);

/// Counts that a file's fields have in common, each with the field that set it.
class Counts {
 public:
  explicit Counts(std::string where);

  void set(Count count, std::int64_t value, const char* told_by);

  /// Allows a model of scope none, which stores no node.
  void allow_none_stored() noexcept { least_stored_ = 0; }

  /// Required size of a dimension.
  [[nodiscard]] std::int64_t size(const Extent& extent) const;

  /// Required sizes of a field.
  [[nodiscard]] std::vector<std::int64_t> sizes(const std::vector<Extent>& shape) const;

  /// Checks a field's sizes: the first field with a count sets it, the others must agree. Throws Error (both
  /// fields and sizes).
  void match(const char* path, const std::vector<Extent>& shape, const std::vector<std::int64_t>& dims);

  [[nodiscard]] const std::string& where() const noexcept { return where_; }

 private:
  std::string where_;
  std::int64_t least_stored_ = 1;
  std::array<std::int64_t, number_of_counts> values_;
  std::array<const char*, number_of_counts> told_by_ = {};
};

/// Checks that a field has the number of values of its shape, and that each is finite and in range. Throws
/// Error.
template <class T>
void check_values(const Field<T>& field, const std::vector<T>& values, const Counts& counts) {
  std::int64_t expected = 1;
  for (const std::int64_t size : counts.sizes(field.shape)) expected *= size;
  if (static_cast<std::int64_t>(values.size()) != expected)
    refuse(counts.where(), std::string(field.path) + " has " + std::to_string(values.size()) + " values, " +
                               std::to_string(expected) + " are expected");
  const std::int64_t below = counts.size(field.below);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(values[i]) && !(field.infinite && std::isinf(values[i])))
        refuse(counts.where(), std::string(field.path) + " holds a value that is not finite (entry " +
                                   std::to_string(i) + ")");
    } else if (below > 0 && (std::int64_t{values[i]} < 0 || std::int64_t{values[i]} >= below)) {
      refuse(counts.where(), std::string(field.path) + " holds " + std::to_string(values[i]) + " (entry " +
                                 std::to_string(i) + "), only 0 to " + std::to_string(below - 1) +
                                 " are possible");
    }
  }
}

}  // namespace palpate
