#include "base/memory.h"

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <string>

namespace palpate {
namespace {

constexpr std::int64_t huge_page = std::int64_t{1} << 21;

}  // namespace

std::int64_t available_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string key;
  std::int64_t kibibytes = 0;
  while (meminfo >> key >> kibibytes) {
    if (key == "MemAvailable:") return kibibytes * 1024;
    meminfo.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return 0;
}

std::shared_ptr<void> map_memory(std::int64_t bytes) {
  const auto size = static_cast<std::size_t>((bytes + 2 * huge_page - 1) / huge_page * huge_page);
  void* base =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (base == MAP_FAILED) return nullptr;
  madvise(base, size, MADV_HUGEPAGE);
  const auto address = reinterpret_cast<std::uintptr_t>(base);
  const std::uintptr_t aligned = (address + huge_page - 1) / huge_page * huge_page;
  const std::shared_ptr<void> mapping(base, [size](void* p) { munmap(p, size); });
  return {mapping, static_cast<std::byte*>(base) + (aligned - address)};
}

void* allocate_large(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(huge_page);
  const bool is_large = bytes >= page;
  void* memory = is_large ? std::aligned_alloc(page, (bytes + page - 1) / page * page) : std::malloc(bytes);
  if (memory == nullptr && bytes > 0) throw std::bad_alloc();
  if (is_large) madvise(memory, bytes, MADV_HUGEPAGE);
  return memory;
}

void free_large(void* memory) noexcept {
  std::free(memory);
}

}  // namespace palpate
