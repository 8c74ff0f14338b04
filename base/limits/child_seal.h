// Sandbox for a process that only computes.
#pragma once

#include <span>

namespace palpate {

/// True if this kernel can seal a process (seccomp filters).
bool can_seal() noexcept;

/// Closes all descriptors from 3 on except `kept`, and permanently restricts the calling thread and all that
/// it starts to computing, memory, time, and reading and writing of open descriptors: no file can be opened
/// or looked up by name, no connection made, no program or process started, no other process reached. Such a
/// system call fails with EPERM. Returns false if the kernel cannot restrict; descriptors are closed all the
/// same.
bool seal_process(std::span<const int> kept) noexcept;

}  // namespace palpate
