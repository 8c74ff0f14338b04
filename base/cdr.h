// CDR as ROS 2 has it: numbers one after another, little-endian, each aligned to its own size from the end of
// the first four bytes on.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

static_assert(std::endian::native == std::endian::little, "numbers are written as memory has them");

inline constexpr std::string_view cdr_head{"\0\1\0\0", 4};  ///< of a message: little-endian

/// Appends a message to text.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& text) : text_(text) {
    text_ += cdr_head;
    origin_ = text_.size();
  }

  template <class T>
  void number(T value) {
    align(sizeof value);
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void numbers(std::span<const T> values) {  ///< with their count
    number(static_cast<std::uint32_t>(values.size()));
    if (values.empty()) return;
    align(sizeof(T));
    text_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    text_.append(value).push_back('\0');
  }
  void texts(std::span<const std::string> values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const std::string& value : values) text(value);
  }

 private:
  void align(std::size_t size) { text_.append((origin_ - text_.size()) % size, '\0'); }

  std::string& text_;
  std::size_t origin_;
};

/// Reads a message from anywhere. What is not there reads as zero or nothing, and `is_whole` is false then.
/// Never takes more memory than the message has.
class CdrReader {
 public:
  explicit CdrReader(std::string_view message) : rest_(message), whole_(message.starts_with(cdr_head)) {
    take(cdr_head.size());
    size_ = rest_.size();
  }

  template <class T>
  [[nodiscard]] T number() {
    align(sizeof(T));
    T value{};
    const std::string_view bytes = take(sizeof(T));
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  template <class T>
  [[nodiscard]] std::vector<T> numbers() {  ///< with their count
    const std::size_t count = number<std::uint32_t>();
    if (count == 0) return {};
    align(sizeof(T));
    const std::string_view bytes = take(count * sizeof(T));
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  /// Whether all that was asked for was there, and nothing else is.
  [[nodiscard]] bool is_whole() const noexcept { return whole_ && rest_.empty(); }

 private:
  std::string_view take(std::size_t count) {
    if (count > rest_.size()) {
      whole_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  void align(std::size_t size) { take((rest_.size() - size_) % size); }

  std::string_view rest_;
  std::size_t size_ = 0;  // of what comes after the head
  bool whole_;
};

}  // namespace palpate
