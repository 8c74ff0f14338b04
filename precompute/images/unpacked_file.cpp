#include "precompute/images/unpacked_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "base/error.h"
#include "precompute/machine/check_room.h"

namespace palpate {
namespace {

/// Memory per voxel besides its bytes in the file when the child sends its labels: the labels, their copy
/// along the axes of space, its packed bytes, and the received part [byte].
constexpr double bytes_per_label = 20.0;
constexpr std::size_t chunk_bytes = 1 << 20;

}  // namespace

void check_voxels(const std::string& product, double voxels, double voxel_bytes, const std::string& where) {
  if (!(voxels <= static_cast<double>(most_voxels))) {
    throw Error(fmt::format("the image's header asks for {} = {:.3g} voxels; {:.1g} are read at most",
                            product, voxels, static_cast<double>(most_voxels)),
                where, "crop the image or scale it down, or correct the header");
  }
  check_room(voxels * (voxel_bytes + bytes_per_label), fmt::format("an image of {} voxels", product), where,
             "crop the image or scale it down");
}

GzFile open_unpacked(const FileDescriptor& file, std::int64_t from) {
  const int fd = ::fcntl(file.get(), F_DUPFD_CLOEXEC, 0);
  ::lseek(fd, from, SEEK_SET);
  GzFile stream(gzdopen(fd, "rb"), gzclose);
  if (!stream) {
    throw Error("there is no memory to read the file", file.path().string(),
                "close other programs and try again");
  }
  return stream;
}

std::size_t read_unpacked(gzFile_s* stream, std::span<char> into) {
  std::size_t done = 0;
  while (done < into.size()) {
    const int size = gzread(stream, into.data() + done,
                            static_cast<unsigned>(std::min(into.size() - done, std::size_t{1} << 30)));
    if (size <= 0) break;
    done += static_cast<std::size_t>(size);
  }
  return done;
}

Counted count_bytes(gzFile_s* stream, std::int64_t enough) {
  std::vector<char> chunk(chunk_bytes);
  const std::vector<char> zeros(chunk_bytes);
  Counted counted;
  while (counted.bytes < enough) {
    const std::size_t size = read_unpacked(stream, chunk);
    if (size == 0) break;
    counted.bytes += static_cast<std::int64_t>(size);
    counted.blank =
        counted.blank &&
        std::equal(chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(size), zeros.begin());
  }
  return counted;
}

void fail_on_blank(const std::string& where) {
  throw Error("the image is empty: all its voxels are 0", where, "give a segmented image");
}

}  // namespace palpate
