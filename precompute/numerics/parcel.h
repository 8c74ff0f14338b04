// Results sent from the process that has them to others.
#pragma once

#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace palpate {

/// Serialised values, written or read in the same order by the same calls of `carry`: a parcel constructed
/// from bytes reads, another one writes. Both ends have the same processor and program.
class Parcel {
 public:
  Parcel() = default;  ///< writes
  explicit Parcel(std::string_view bytes) : rest_(bytes), gives_(true) {}

  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }  ///< bytes written so far
  [[nodiscard]] bool gives() const noexcept { return gives_; }
  [[nodiscard]] bool empty() const noexcept { return rest_.empty(); }  ///< true if all bytes are read

  template <class T>
  requires std::is_arithmetic_v<T>
  void carry(T& value) { carry_bytes(&value, sizeof value); }

  template <class T>
  requires std::is_arithmetic_v<T>
  void carry(std::vector<T>& values) {
    std::size_t count = values.size();
    carry(count);
    values.resize(count);
    carry_bytes(values.data(), count * sizeof(T));
  }

  /// Carries values whose number both ends know.
  template <class T>
  requires std::is_arithmetic_v<T>
  void carry(std::span<T> values) { carry_bytes(values.data(), values.size_bytes()); }

  /// Carries an Eigen matrix.
  template <class Matrix>
  requires requires(Matrix& m) { m.resize(m.rows(), m.cols()); }
  void carry(Matrix& matrix) {
    auto rows = matrix.rows(), columns = matrix.cols();
    carry(rows);
    carry(columns);
    matrix.resize(rows, columns);
    carry_bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(typename Matrix::Scalar));
  }

 private:
  void carry_bytes(void* data, std::size_t count) {
    if (count == 0) return;
    if (gives_) {
      std::memcpy(data, rest_.data(), count);
      rest_.remove_prefix(count);
    } else {
      bytes_.append(static_cast<const char*>(data), count);
    }
  }

  std::string bytes_;
  std::string_view rest_;
  bool gives_ = false;
};

}  // namespace palpate
