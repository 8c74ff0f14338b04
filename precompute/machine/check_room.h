// Check of the available memory.
#pragma once

#include <string>

namespace palpate {

/// Throws Error (where = `where`) if `bytes` exceed the memory that this process may take (allotted_memory);
/// `what` is what takes them. To be called before making anything whose size comes from a small file or a
/// short line.
void check_room(double bytes, const std::string& what, const std::string& where, const std::string& hint);

}  // namespace palpate
