#include "precompute/machine/blas_room.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/limits/address_space.h"

namespace palpate {
namespace {

constexpr std::int64_t blas_buffer = 128LL << 20;
constexpr std::int64_t thread_stack = 8LL << 20;
constexpr std::int64_t other_needs = 64LL << 20;  // of the smallest body

std::int64_t needed(int threads) {
  return other_needs + threads * (blas_buffer + thread_stack);
}

/// Reads "512K", without a letter in kibibytes; nullopt if libgomp does not understand it either.
std::optional<std::size_t> stack_size(const char* text) {
  text += std::strspn(text, " \t");
  std::size_t size = 0;
  const char* const all = text + std::strlen(text);
  const auto [end, status] = std::from_chars(text, all, size);
  if (status != std::errc()) return {};
  const char* const letter = end + std::strspn(end, " \t");
  const char* const found = *letter == '\0' ? "k" : std::strchr("bkmgBKMG", *letter);
  if (found == nullptr) return {};
  const int power = static_cast<int>(std::string("bkmg").find(static_cast<char>(std::tolower(*found))));
  return size << 10 * power;
}

/// True if a thread starts with a stack of this size.
bool starts_with(std::size_t bytes) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_t thread{};
  const bool started = pthread_attr_setstacksize(&attributes, bytes) == 0 &&
                       pthread_create(
                           &thread, &attributes, [](void*) -> void* { return nullptr; }, nullptr) == 0;
  if (started) pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  return started;
}

}  // namespace

void check_stack_size() {
  for (const char* name : {"OMP_STACKSIZE", "GOMP_STACKSIZE"}) {
    const char* const text = std::getenv(name);
    const std::optional<std::size_t> size = text != nullptr ? stack_size(text) : std::nullopt;
    if (!size || starts_with(*size)) continue;
    throw Error(fmt::format("{}={} is no stack with which a thread starts", name, text), "environment",
                fmt::format("Unset {}, or give 1M or more", name));
  }
}

int threads_with_room(int wanted) {
  const std::optional<std::int64_t> free = address_room();
  if (!free) return wanted;
  const std::int64_t fit = (*free - other_needs) / (blas_buffer + thread_stack);
  return static_cast<int>(std::clamp<std::int64_t>(fit, 1, wanted));
}

void take_blas_room(int threads) {
  const std::optional<std::int64_t> free = address_room();
  if (!free) return;
  if (*free < needed(threads)) {
    throw Error(
        fmt::format("{} thread{} of linear algebra need{} {:.0f} MB of address space, {:.0f} MB are left "
                    "by its limit",
                    threads, threads == 1 ? "" : "s", threads == 1 ? "s" : "",
                    static_cast<double>(needed(threads)) / 1e6, static_cast<double>(*free) / 1e6),
        "memory", std::string("Raise the limit (ulimit -v)") + (threads > 1 ? ", or use fewer --jobs" : ""));
  }
  // OpenBLAS's own allocator, which keeps freed memory for later; other BLAS libraries have none
  const auto take = reinterpret_cast<void* (*)(int)>(::dlsym(RTLD_DEFAULT, "blas_memory_alloc"));
  const auto give_back = reinterpret_cast<void (*)(void*)>(::dlsym(RTLD_DEFAULT, "blas_memory_free"));
  if (take == nullptr || give_back == nullptr) return;
  std::vector<void*> buffers;
  buffers.reserve(static_cast<std::size_t>(threads));
  for (int k = 0; k < threads; ++k) buffers.push_back(take(0));
  for (void* const buffer : buffers) give_back(buffer);
}

}  // namespace palpate
