// Whether there is memory for what is wanted.
#pragma once

#include <string>

namespace palpate {

/// Throws Error (where = `where`) where `bytes` are more than the memory that this process may take
/// (allotted_memory); `what` is what takes them. For what a small file or a short line makes large: before it
/// is made.
void check_room(double bytes, const std::string& what, const std::string& where, const std::string& hint);

}  // namespace palpate
