// The index of a file, by what the HDF5 library sees in it.
#pragma once

#include <cstddef>
#include <vector>

#include "base/file_io.h"

namespace palpate::hdf5 {

/// The index as it belongs at the beginning of a file that this program has written. Throws Error (where =
/// the file) where it is not readable, or holds too much.
std::vector<std::byte> index_of_own(const FileDescriptor& file);

/// The index of a file that others may have made. The HDF5 library crashes on crafted files and may take all
/// memory, so it looks at the file in a sealed child process with limits. What comes of it is believed as
/// little as the index of a file: for Contents.
std::vector<std::byte> index_of(const FileDescriptor& file);

}  // namespace palpate::hdf5
