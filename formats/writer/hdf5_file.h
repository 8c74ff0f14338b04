// HDF5 files that we write.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "formats/contents.h"
#include "formats/writer/hdf5.h"

namespace palpate::hdf5 {

/// An HDF5 file that we write, and that Contents reads. Objects carry no times, so equal calls make equal
/// files. All throw Error (where = the file; fields are named).
class File {
 public:
  /// A new file (an old one is emptied). Objects of at least `align_from` bytes (0: none) start at multiples
  /// of 4096 bytes.
  static File create(const std::filesystem::path& path, std::int64_t align_from = 0);
  /// A file that this program has written, or that a walk has found no mistake in.
  static File open_to_change(const std::filesystem::path& path, std::int64_t align_from = 0);

  [[nodiscard]] hid_t id() const noexcept { return file_.get(); }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  void make_group(const std::string& group);  ///< with its parents; nothing where it exists
  void make_link(const std::string& link, const std::string& target);  ///< soft link

  /// Contiguous dataset; makes its group. `data` null: only the space is reserved. Returns where its first
  /// byte lies in the file.
  std::int64_t write(const std::string& dataset, const NumberType& type, std::span<const std::int64_t> dims,
                     const void* data);
  /// Rows [first, first + rows) of a dataset that `write` has reserved.
  void write_rows(const std::string& dataset, const NumberType& type, std::int64_t first, std::int64_t rows,
                  const void* data);
  void write_attribute(const std::string& object, const std::string& name, const std::string& text);
  void write_attribute(const std::string& object, const std::string& name,
                       std::span<const std::int64_t> values);

  /// Writes everything out, and the index. Throws Error when that fails (full disk); the destructor would not
  /// say.
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
