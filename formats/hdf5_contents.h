// What an HDF5 file holds, read so that no file can harm the program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/file_io.h"
#include "formats/hdf5.h"

namespace palpate::hdf5 {

/// Where a dataset lies in the file.
struct Stored {
  std::vector<std::int64_t> dims;
  std::int64_t offset = 0;  ///< of its first byte
  std::int64_t bytes = 0;   ///< in the file
};

/// Groups, datasets and attributes of a file. The HDF5 library crashes on crafted files and may take all
/// memory, so it looks at the file in a child process with limits, which reports where the datasets lie and
/// what the attributes say; this process takes their bytes from there by itself. All throw Error (where = the
/// file; fields are named).
class Contents {
 public:
  /// What an open file holds; `file` stays open as long as this lives. Throws Error when it is no readable
  /// HDF5 file.
  static Contents read(FileDescriptor file);
  static Contents read(const std::filesystem::path& path) { return read(open_file(path, OpenMode::read)); }

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return file_.path(); }
  [[nodiscard]] const FileDescriptor& file() const noexcept { return file_; }

  /// A dataset or group of the file itself, not behind a link.
  [[nodiscard]] bool has(const std::string& object) const { return objects_.contains(object); }

  /// Finds a dataset and proves that it has this type and rank, lies in one piece, and inside the file.
  [[nodiscard]] Stored locate(const std::string& dataset, const ElementType& type, std::size_t rank) const;

  /// Rows [first, first + rows) of a dataset that `locate` finds.
  void read_rows(const std::string& dataset, const ElementType& type, std::int64_t first, std::int64_t rows,
                 void* data) const;

  /// Value of a fixed-length text attribute; nothing where it is missing or of another kind.
  [[nodiscard]] std::optional<std::string> text_attribute(const std::string& object,
                                                          const std::string& name) const;
  /// `count` values of an integer attribute; nothing where it is missing or of another kind.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> integer_attribute(const std::string& object,
                                                                           const std::string& name,
                                                                           std::size_t count) const;

  /// A text, or integers.
  using Attribute = std::variant<std::string, std::vector<std::int64_t>>;

  /// A dataset or group as the child reports it.
  struct Object {
    std::map<std::string, Attribute> attributes{};
    bool is_dataset = false;
    bool is_readable = false;           ///< that dataset
    bool is_in_one_piece = false;       ///< in this file
    std::string type{};                 ///< ElementType::name, or "another type"
    std::int64_t rank = 0;              ///< -1: of no simple shape
    std::vector<std::uint64_t> dims{};  ///< of the first few dimensions
    std::uint64_t offset = 0;           ///< of what lies in one piece and is not empty
  };
  using Objects = std::map<std::string, Object>;  ///< by path

 private:
  Contents(FileDescriptor file, Objects objects) : file_(std::move(file)), objects_(std::move(objects)) {}
  [[nodiscard]] const Object& dataset(const std::string& path) const;
  [[nodiscard]] Stored shape(const std::string& path, const ElementType& type, std::size_t rank) const;
  [[nodiscard]] Stored inside(const std::string& path, Stored stored, const Object& found) const;
  [[nodiscard]] const Attribute* attribute(const std::string& object, const std::string& name) const;

  FileDescriptor file_;
  Objects objects_;
};

}  // namespace palpate::hdf5
