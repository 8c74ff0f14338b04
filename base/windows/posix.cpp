#include "posix.h"

#include <windows.h>

#include <cstdint>

namespace {

HANDLE handle_of(int file) noexcept {
  return reinterpret_cast<HANDLE>(::_get_osfhandle(file));  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

ssize_t pread(int file, void* into, std::size_t bytes, off_t offset) noexcept {
  OVERLAPPED from = {};
  from.Offset = static_cast<DWORD>(offset);
  from.OffsetHigh = static_cast<DWORD>(static_cast<std::uint64_t>(offset) >> 32U);
  DWORD got = 0;
  if (::ReadFile(handle_of(file), into, at_most(bytes), &got, &from) == 0 &&
      ::GetLastError() != ERROR_HANDLE_EOF) {
    errno = EIO;
    return -1;
  }
  return static_cast<ssize_t>(got);
}

void* mmap(void*, std::size_t bytes, int, int, int file, off_t offset) noexcept {
  const auto at = static_cast<std::uint64_t>(offset);
  HANDLE mapping = ::CreateFileMappingW(handle_of(file), nullptr, PAGE_READONLY, 0, 0, nullptr);
  void* const base = mapping == nullptr
                         ? nullptr
                         : ::MapViewOfFile(mapping, FILE_MAP_READ, static_cast<DWORD>(at >> 32U),
                                           static_cast<DWORD>(at), bytes);
  if (mapping != nullptr) ::CloseHandle(mapping);  // the view keeps it
  if (base != nullptr) return base;
  errno = ENOMEM;
  return MAP_FAILED;
}

int munmap(void* at, std::size_t) noexcept {
  return ::UnmapViewOfFile(at) != 0 ? 0 : -1;
}

long sysconf(int) noexcept {
  SYSTEM_INFO system = {};
  ::GetSystemInfo(&system);
  return static_cast<long>(system.dwAllocationGranularity);
}
