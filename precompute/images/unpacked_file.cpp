#include "precompute/images/unpacked_file.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <vector>

#include "base/error.h"
#include "base/regular_file.h"

namespace palpate {

void check_voxels(const std::string& product, double voxels, const std::string& where) {
  if (voxels <= static_cast<double>(most_voxels)) return;
  throw Error(fmt::format("the image's header asks for {} = {:.3g} voxels; {:.1g} are read at most", product,
                          voxels, static_cast<double>(most_voxels)),
              where, "crop the image or scale it down, or correct the header");
}

GzFile open_unpacked(const std::filesystem::path& file) {
  const int fd = open_regular_file(file, O_RDONLY);
  GzFile stream(gzdopen(fd, "rb"), gzclose);
  if (!stream) {
    throw Error("there is no memory to read the file", file.string(), "close other programs and try again");
  }
  return stream;
}

std::int64_t count_bytes(gzFile_s* stream, std::int64_t enough) {
  std::vector<char> chunk(1 << 20);
  std::int64_t count = 0;
  while (count < enough) {
    const int size = gzread(stream, chunk.data(), static_cast<unsigned>(chunk.size()));
    if (size <= 0) break;
    count += size;
  }
  return count;
}

}  // namespace palpate
