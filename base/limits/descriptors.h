// Open files of a process that has just been forked.
#pragma once

namespace palpate {

/// Closes the descriptors [first, last]. Safe in a child between fork and exec.
void close_descriptors(int first, int last) noexcept;

}  // namespace palpate
