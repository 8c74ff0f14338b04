#include "base/memory.h"

#include <malloc.h>
#include <windows.h>

#include <new>

namespace palpate {

std::int64_t available_memory() {
  MEMORYSTATUSEX status = {};
  status.dwLength = sizeof status;
  return ::GlobalMemoryStatusEx(&status) != 0 ? static_cast<std::int64_t>(status.ullAvailPhys) : 0;
}

std::shared_ptr<void> map_memory(std::int64_t bytes) {
  void* const base =
      ::VirtualAlloc(nullptr, static_cast<SIZE_T>(bytes), MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE);
  if (base == nullptr) return nullptr;
  return {base, [](void* p) { ::VirtualFree(p, 0, MEM_RELEASE); }};
}

void* allocate_large(std::size_t bytes) {
  void* const memory = ::_aligned_malloc(bytes, 64);
  if (memory == nullptr && bytes > 0) throw std::bad_alloc();
  return memory;
}

void free_large(void* memory) noexcept {
  ::_aligned_free(memory);
}

}  // namespace palpate
