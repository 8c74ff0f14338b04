// How much memory there is, and memory on huge pages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace palpate {

/// Memory that can be had without swapping, as the kernel estimates it (MemAvailable) [bytes]; 0 when it does
/// not say.
std::int64_t available_memory();

/// Zeroed memory that starts on a huge page, on huge pages where the kernel gives them: a tick touches few
/// bytes on each of many rows. Null when there is none.
std::shared_ptr<void> map_memory(std::int64_t bytes);

/// Memory for containers, on huge pages where it is large and the kernel gives them: who goes through a
/// column of a matrix touches a page for each row. Throws std::bad_alloc.
void* allocate_large(std::size_t bytes);
/// Frees what allocate_large gave.
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

/// A matrix that a tick goes through.
template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace palpate
