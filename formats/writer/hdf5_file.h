// HDF5 files that we write.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "formats/contents.h"
#include "formats/writer/hdf5.h"

namespace palpate::hdf5 {

/// An HDF5 file written by us, for Contents to read. Objects carry no times, so equal calls make equal files.
/// All members throw Error (where = the file; fields are named).
class File {
 public:
  /// Creates a file, or empties an old one. Objects of at least `align_from` bytes (0: none) start at
  /// multiples of 4096 bytes.
  static File create(const std::filesystem::path& path, std::int64_t align_from = 0);
  /// Opens a file that this program has written, or that index_of has accepted.
  static File open_to_change(const std::filesystem::path& path, std::int64_t align_from = 0);

  [[nodiscard]] hid_t id() const noexcept { return file_.get(); }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  void make_group(const std::string& group);  ///< with its parents; does nothing if it exists
  void make_link(const std::string& link, const std::string& target);  ///< soft link

  /// Writes a contiguous dataset and creates its group. `data` null: only reserves the space. Returns the
  /// offset of its first byte in the file.
  std::int64_t write(const std::string& dataset, const NumberType& type, std::span<const std::int64_t> dims,
                     const void* data);
  /// Writes rows [first, first + rows) of a dataset that `write` has reserved.
  void write_rows(const std::string& dataset, const NumberType& type, std::int64_t first, std::int64_t rows,
                  const void* data);
  void write_attribute(const std::string& object, const std::string& name, const std::string& text);
  void write_attribute(const std::string& object, const std::string& name,
                       std::span<const std::int64_t> values);

  /// Writes everything out, and the index. Throws Error if that fails (full disk), which the destructor would
  /// hide.
  void close();

 private:
  File(Id file, std::filesystem::path path) : file_(std::move(file)), path_(std::move(path)) {}
  [[nodiscard]] bool has(const std::string& object) const;
  [[nodiscard]] Id open_dataset(const std::string& dataset) const;
  [[noreturn]] void fail(const std::string& doing) const;

  Id file_;
  std::filesystem::path path_;
};

}  // namespace palpate::hdf5
