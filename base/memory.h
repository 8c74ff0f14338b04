// Available memory, and memory on huge pages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace palpate {

/// Memory available without swapping, as the kernel estimates it (MemAvailable) [byte]; 0 if unknown.
std::int64_t available_memory();

/// Zeroed memory that starts on a huge page, on huge pages where the kernel grants them: a tick reads few
/// bytes of each of many rows. Null if there is none.
std::shared_ptr<void> map_memory(std::int64_t bytes);

/// Memory for containers, on huge pages if it is large and the kernel grants them: reading a column of a
/// matrix touches one page per row. Throws std::bad_alloc.
void* allocate_large(std::size_t bytes);
/// Frees memory of allocate_large.
void free_large(void* memory) noexcept;

/// The standard library's allocator over allocate_large.
template <class T>
struct LargeAllocator {
  using value_type = T;  // NOLINT(readability-identifier-naming): the standard library asks for it

  LargeAllocator() = default;
  template <class U>
  explicit(false) LargeAllocator(const LargeAllocator<U>& /*other*/) noexcept {}

  T* allocate(std::size_t count) { return static_cast<T*>(allocate_large(count * sizeof(T))); }
  void deallocate(T* memory, std::size_t /*count*/) noexcept { free_large(memory); }
  friend bool operator==(const LargeAllocator&, const LargeAllocator&) noexcept { return true; }
};

/// Storage of a matrix that a tick traverses.
template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace palpate
