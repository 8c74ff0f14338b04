// The first bytes of an HDF5 file.
#pragma once

#include <string>

#include "base/file_io.h"

namespace palpate {

/// What a file should be, for the messages about one that is not.
struct ExpectedFile {
  std::string what;   ///< "a recording"
  std::string give;   ///< the hint where it is something else
  std::string again;  ///< the hint where it is cut off
};

/// Looks at HDF5's superblock before HDF5 does: says what is not a file of ours, and what is cut off. Version
/// 3 has checksums in all of its metadata; files of older versions, which other programs write, are not
/// handed to the library. Throws Error.
void check_superblock(const FileDescriptor& file, const ExpectedFile& expected);

}  // namespace palpate
