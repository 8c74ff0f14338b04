// Index of a file as the HDF5 library reads it.
#pragma once

#include <cstddef>
#include <vector>

#include "base/file_io.h"

namespace palpate::hdf5 {

/// Index for the beginning of a file that this program has written. Throws Error (where = the file) if it is
/// not readable, or holds too much.
std::vector<std::byte> index_of_own(const FileDescriptor& file);

/// Index of an untrusted file. The HDF5 library crashes on crafted files and may take all memory, so it reads
/// the file in a sealed child process with limits. The result is as untrusted as an index from a file: pass
/// it to Contents.
std::vector<std::byte> index_of(const FileDescriptor& file);

}  // namespace palpate::hdf5
