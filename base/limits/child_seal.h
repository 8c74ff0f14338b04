// A process that can only compute.
#pragma once

#include <span>

namespace palpate {

/// Whether this kernel lets a process be sealed (seccomp filters).
bool can_seal() noexcept;

/// Closes all descriptors from 3 on but `kept`, and takes from the calling thread and from what it starts,
/// for good, all that is not computing, memory, time, or reading and writing of descriptors that are open: no
/// file can be opened or looked up by its name, no connection made, no program or process started, no other
/// process reached. Such a system call fails with EPERM. False where the kernel cannot; descriptors are
/// closed all the same.
bool seal_process(std::span<const int> kept) noexcept;

}  // namespace palpate
