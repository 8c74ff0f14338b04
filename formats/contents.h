// Index at the beginning of our files: the objects of their HDF5 part and their places (docs/file-format.md),
// so that reading needs no HDF5 library.
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

/// Size of the index [byte]. HDF5 calls this space the user block and skips it.
inline constexpr std::int64_t index_bytes = 32768;

/// First bytes of an index.
inline constexpr std::string_view index_magic = "\x89PLP\r\n\x1a\n";

/// A type of numbers as stored in a file (little-endian).
struct NumberType {
  std::string_view name;  ///< "float64"
  std::size_t bytes;      ///< of one number
};

inline constexpr std::array<NumberType, 6> number_types = {
    {{"uint8", 1}, {"uint32", 4}, {"int32", 4}, {"int64", 8}, {"float32", 4}, {"float64", 8}}};

/// Object::type of datasets of any other type.
inline constexpr std::string_view other_type = "another type";

/// NumberType of std::uint8_t, std::uint32_t, std::int32_t, std::int64_t, float or double.
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

/// Value of an attribute: a text, or integers.
using FileAttribute = std::variant<std::string, std::vector<std::int64_t>>;

/// A dataset or group.
struct FileObject {
  std::string type{};                 ///< NumberType::name or other_type; empty: a group
  std::vector<std::uint64_t> dims{};  ///< dimensions of a dataset
  std::uint64_t offset = 0;           ///< position of its first byte in the file
  std::uint64_t bytes = 0;            ///< 0 also for a dataset that is not contiguous
  std::map<std::string, FileAttribute> attributes{};
};

using FileObjects = std::map<std::string, FileObject>;  ///< by path

/// Encodes the index of a file of `file_bytes` bytes, `index_bytes` bytes long. Throws Error (`where`) if it
/// does not fit.
std::vector<std::byte> make_index(const FileObjects& objects, std::uint64_t file_bytes,
                                  const std::string& where);

/// A contiguous dataset.
struct Stored {
  std::vector<std::int64_t> dims;
  std::int64_t offset = 0;  ///< position of its first byte
  std::int64_t bytes = 0;
};

/// Groups, datasets and attributes of a file, from its index. The index is not trusted: its checksum is
/// verified, sizes must fit types and dimensions, and datasets must lie inside the file without overlap. All
/// members throw Error (where = the file; fields are named).
class Contents {
 public:
  /// Reads the index of an open file, which stays open while this lives. Throws Error if the file is not one
  /// of ours, is cut off, or has a damaged index.
  static Contents read(FileDescriptor file);
  static Contents read(const std::filesystem::path& path) { return read(open_file(path, OpenMode::read)); }
  /// Contents of a file by an index other than its own.
  static Contents of(FileDescriptor file, std::span<const std::byte> index);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return file_.path(); }
  [[nodiscard]] const FileDescriptor& file() const noexcept { return file_; }

  /// True for a dataset or group of the file itself, not behind a link.
  [[nodiscard]] bool has(const std::string& object) const { return objects_.contains(object); }

  /// Finds a dataset and checks that it has this type and rank and is contiguous.
  [[nodiscard]] Stored locate(const std::string& dataset, const NumberType& type, std::size_t rank) const;

  /// Value of a text attribute; nullopt if it is missing or of another kind.
  [[nodiscard]] std::optional<std::string> text_attribute(const std::string& object,
                                                          const std::string& name) const;
  /// `count` values of an integer attribute; nullopt if it is missing or of another kind.
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
