// Files of ours begin with an index of what their HDF5 holds and where it lies (docs/file-format.md), so that
// no HDF5 library is needed to read them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/file_io.h"

namespace palpate {

/// Bytes at the beginning of a file that are the index's. HDF5 calls them the user block, and skips them.
inline constexpr std::int64_t index_bytes = 32768;

/// The first bytes of an index.
inline constexpr std::string_view index_magic = "\x89PLP\r\n\x1a\n";

/// A type of numbers as they lie in a file (little-endian).
struct NumberType {
  std::string_view name;  ///< "float64"
  std::size_t bytes;      ///< of one number
};

inline constexpr std::array<NumberType, 6> number_types = {
    {{"uint8", 1}, {"uint32", 4}, {"int32", 4}, {"int64", 8}, {"float32", 4}, {"float64", 8}}};

/// Object::type of datasets of anything else.
inline constexpr std::string_view other_type = "another type";

/// For std::uint8_t, std::uint32_t, std::int32_t, std::int64_t, float and double.
template <class T>
constexpr NumberType number_type();
template <>
constexpr NumberType number_type<std::uint8_t>() {
  return number_types[0];
}
template <>
constexpr NumberType number_type<std::uint32_t>() {
  return number_types[1];
}
template <>
constexpr NumberType number_type<std::int32_t>() {
  return number_types[2];
}
template <>
constexpr NumberType number_type<std::int64_t>() {
  return number_types[3];
}
template <>
constexpr NumberType number_type<float>() {
  return number_types[4];
}
template <>
constexpr NumberType number_type<double>() {
  return number_types[5];
}

/// A text, or integers.
using FileAttribute = std::variant<std::string, std::vector<std::int64_t>>;

/// A dataset or group.
struct FileObject {
  std::string type{};                 ///< NumberType::name or other_type; empty: a group
  std::vector<std::uint64_t> dims{};  ///< of a dataset
  std::uint64_t offset = 0;           ///< of its first byte in the file
  std::uint64_t bytes = 0;            ///< 0 also of a dataset that does not lie in one piece
  std::map<std::string, FileAttribute> attributes{};
};

using FileObjects = std::map<std::string, FileObject>;  ///< by path

/// The index of a file of `file_bytes` bytes as it lies there: `index_bytes` bytes. Throws Error (`where`)
/// when that is too little.
std::vector<std::byte> make_index(const FileObjects& objects, std::uint64_t file_bytes,
                                  const std::string& where);

/// A dataset that lies in one piece.
struct Stored {
  std::vector<std::int64_t> dims;
  std::int64_t offset = 0;  ///< of its first byte
  std::int64_t bytes = 0;
};

/// Groups, datasets and attributes of a file, by its index, of which nothing is believed that is not proved:
/// its checksum, that sizes fit types and dimensions, and that datasets lie inside the file and not on each
/// other. All throw Error (where = the file; fields are named).
class Contents {
 public:
  /// Those of an open file, which stays open as long as this lives. Throws Error where it is none of ours,
  /// cut off, or its index is damaged.
  static Contents read(FileDescriptor file);
  static Contents read(const std::filesystem::path& path) { return read(open_file(path, OpenMode::read)); }
  /// Those that the file has by another index than its own.
  static Contents of(FileDescriptor file, std::span<const std::byte> index);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return file_.path(); }
  [[nodiscard]] const FileDescriptor& file() const noexcept { return file_; }

  /// A dataset or group of the file itself, not behind a link.
  [[nodiscard]] bool has(const std::string& object) const { return objects_.contains(object); }

  /// Finds a dataset and proves that it has this type and rank, and lies in one piece.
  [[nodiscard]] Stored locate(const std::string& dataset, const NumberType& type, std::size_t rank) const;

  /// Value of a text attribute; nothing where it is missing or of another kind.
  [[nodiscard]] std::optional<std::string> text_attribute(const std::string& object,
                                                          const std::string& name) const;
  /// `count` values of an integer attribute; nothing where it is missing or of another kind.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> integer_attribute(const std::string& object,
                                                                           const std::string& name,
                                                                           std::size_t count) const;

 private:
  Contents(FileDescriptor file, FileObjects objects) : file_(std::move(file)), objects_(std::move(objects)) {}
  [[nodiscard]] const FileAttribute* attribute(const std::string& object, const std::string& name) const;

  FileDescriptor file_;
  FileObjects objects_;
};

}  // namespace palpate
