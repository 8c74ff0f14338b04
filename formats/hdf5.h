// A thin layer over the HDF5 C library for what we write: identifiers that close themselves, failures as
// Error, no error printing.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace palpate::hdf5 {

/// Owns an HDF5 identifier.
class Id {
 public:
  using Closer = herr_t (*)(hid_t);
  Id() = default;
  Id(hid_t id, Closer closer) noexcept : id_(id), closer_(closer) {}
  Id(Id&& other) noexcept;
  Id& operator=(Id&& other) noexcept;
  ~Id();

  [[nodiscard]] hid_t get() const noexcept { return id_; }
  [[nodiscard]] bool valid() const noexcept { return id_ >= 0; }
  bool close() noexcept;  ///< false when the library failed, e.g. while it wrote what it still held

 private:
  hid_t id_ = H5I_INVALID_HID;
  Closer closer_ = nullptr;
};

/// A scalar type as it lies in the file (little-endian).
struct ElementType {
  const char* name;   ///< "float64"
  std::size_t bytes;  ///< of one element
  hid_t id;
};

/// For std::uint8_t, std::uint32_t, std::int32_t, std::int64_t, float and double.
template <class T>
ElementType element_type();

/// An HDF5 file that we write: what is in others' files is read by Contents. Objects carry no times, so equal
/// calls make equal files. All throw Error (where = the file; fields are named).
class File {
 public:
  /// A new file (an old one is emptied). Objects of at least `align_from` bytes (0: none) start at multiples
  /// of 4096 bytes.
  static File create(const std::filesystem::path& path, std::int64_t align_from = 0);
  /// A file that this program has written, or whose Contents have been read without a mistake.
  static File open_to_change(const std::filesystem::path& path, std::int64_t align_from = 0);

  [[nodiscard]] hid_t id() const noexcept { return file_.get(); }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  void make_group(const std::string& group);  ///< with its parents; nothing where it exists
  void make_link(const std::string& link, const std::string& target);  ///< soft link

  /// Contiguous dataset; makes its group. `data` null: only the space is reserved. Returns where its first
  /// byte lies in the file.
  std::int64_t write(const std::string& dataset, const ElementType& type, std::span<const std::int64_t> dims,
                     const void* data);
  /// Rows [first, first + rows) of a dataset that `write` has reserved.
  void write_rows(const std::string& dataset, const ElementType& type, std::int64_t first, std::int64_t rows,
                  const void* data);
  void write_attribute(const std::string& object, const std::string& name, const std::string& text);
  void write_attribute(const std::string& object, const std::string& name,
                       std::span<const std::int64_t> values);

  /// Writes everything out. Throws Error when that fails (full disk); the destructor would not say.
  void close();

 private:
  File(Id file, std::filesystem::path path) : file_(std::move(file)), path_(std::move(path)) {}
  [[nodiscard]] bool has(const std::string& object) const;
  [[nodiscard]] Id open_dataset(const std::string& dataset) const;
  [[noreturn]] void fail(const std::string& doing) const;

  Id file_;
  std::filesystem::path path_;
};

/// The deepest reason that the library gives for its last failure; the system's own words where it has any.
std::string reason();

/// How our files are opened.
Id access_properties(std::int64_t align_from = 0);

/// Object creation properties without times, for kinds such as H5P_DATASET_CREATE.
Id timeless(hid_t kind);

/// Stops the library from printing its error stack while this lives.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

}  // namespace palpate::hdf5
