#include "formats/writer/add_index.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "base/error.h"
#include "base/file_io.h"
#include "base/write_file.h"
#include "formats/contents.h"
#include "formats/model_file.h"
#include "formats/writer/hdf5_walk.h"

namespace palpate {
namespace {

/// Offset of the file's HDF5 part: 0, 512 or a doubling of that.
std::int64_t begin_of_hdf5(const FileDescriptor& file) {
  const std::int64_t bytes = file_size(file);
  for (std::int64_t at = 0; at < bytes; at = at == 0 ? 512 : 2 * at) {
    std::string start(8, '\0');
    if (read_some(file, std::as_writable_bytes(std::span(start)), at) == start.size() &&
        start == "\x89HDF\r\n\x1a\n")
      return at;
  }
  throw Error("is not an HDF5 file", file.path().string(), "Give a NAME.palpate.hdf");
}

}  // namespace

void add_index(const std::filesystem::path& model) {
  const FileDescriptor from = open_file(model, OpenMode::read);
  const std::int64_t begin = begin_of_hdf5(from), end = file_size(from);
  check_free_space(model, end);
  TemporaryFile made(link_target(model));
  FileDescriptor to(::open(made.path().c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC), model);
  if (to.get() < 0)
    throw Error(std::string("cannot be written: ") + std::strerror(errno), model.string(), "Try again");
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  for (std::int64_t at = begin; at < end; at += std::ssize(buffer)) {
    const auto some = std::span(buffer).first(
        static_cast<std::size_t>(std::min<std::int64_t>(std::ssize(buffer), end - at)));
    read_exactly(from, some, at);
    write_exactly(to, some, at - begin + index_bytes);
  }
  write_exactly(to, hdf5::index_of(to), 0);
  format_version(Contents::read(std::move(to)));
  made.take_its_place();
}

bool is_index_right(const std::filesystem::path& model) {
  const FileDescriptor file = open_file(model, OpenMode::read);
  std::vector<std::byte> index(static_cast<std::size_t>(index_bytes));
  read_exactly(file, index, 0);
  return index == hdf5::index_of(file);
}

}  // namespace palpate
