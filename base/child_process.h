// Work that may crash, in a process of its own.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// Bytes that a child hands to its parent.
using Bytes = std::vector<std::byte>;

/// What a child's work gives back: a status that means what the work wants it to (0 is success) and its
/// result.
struct ChildResult {
  int status = 0;
  Bytes bytes;
};

/// What a child may use. The clock's limit is generous, as a busy machine gives a child a small share of the
/// processor; the processor's limit is what ends a child that calculates for ever.
struct ChildLimits {
  std::chrono::seconds processor{};  ///< of the processor, from 1
  std::chrono::seconds clock{};      ///< from the start to the end
  std::int64_t memory = 0;           ///< [byte] of address space, beyond what the process has at the fork
};

/// Limits of `processor` seconds and `memory` bytes, and twelve times as long by the clock.
ChildLimits child_limits(std::chrono::seconds processor, std::int64_t memory);

/// Limits for reading foreign files of `bytes` altogether and checking what is in them: meant to be far above
/// what whole files take.
ChildLimits reading_limits(std::int64_t bytes);

/// Who runs in a child, and what is said when it fails.
struct ChildTask {
  std::string name;   ///< program or library that runs there
  std::string where;  ///< of the Error: the file
  ChildLimits limits;
  std::string hint = "simplify, repair or remesh the input";  ///< when it crashes or reaches a limit
  std::vector<int> files{};  ///< descriptors, open for reading, that the work needs
  /// A signal such as Ctrl-C ends the wait and the child. Without, signals of a host program are none of
  /// ours.
  bool stop_at_signals = true;
};

/// Runs `work` in a forked child and returns its result. The child is sealed (seal_process) where the kernel
/// can: it reads task.files and answers, and reaches no other file, no network and no other process. Its
/// output to the screen is dropped. An Error that the work throws is thrown here. Throws Error (task.where,
/// task.hint) when the child crashes, exits by itself, throws something else, or reaches a limit. `work` must
/// not rely on other threads.
ChildResult run_in_child(const ChildTask& task, const std::function<ChildResult()>& work);

/// Appends the bytes of `values`.
template <typename T>
void append_bytes(Bytes& bytes, std::span<const T> values) {
  const std::size_t before = bytes.size();
  bytes.resize(before + values.size_bytes());
  std::copy_n(reinterpret_cast<const std::byte*>(values.data()), values.size_bytes(), bytes.data() + before);
}

/// Appends an array with its length, for take_array.
template <typename T>
void append_array(Bytes& bytes, std::span<const T> values) {
  const std::size_t size = values.size();
  append_bytes(bytes, std::span<const std::size_t>(&size, 1));
  append_bytes(bytes, values);
}

/// Throws Error: a child's answer is not what it should be.
[[noreturn]] void fail_on_answer();

/// Takes an array from the front of `bytes`. Throws Error where they do not hold it.
template <typename T>
std::vector<T> take_array(std::span<const std::byte>& bytes) {
  std::size_t size = 0;
  if (bytes.size() < sizeof(size)) fail_on_answer();
  std::memcpy(&size, bytes.data(), sizeof(size));
  bytes = bytes.subspan(sizeof(size));
  if (size > bytes.size() / sizeof(T)) fail_on_answer();
  std::vector<T> values(size);
  std::copy_n(bytes.data(), size * sizeof(T), reinterpret_cast<std::byte*>(values.data()));
  bytes = bytes.subspan(size * sizeof(T));
  return values;
}

}  // namespace palpate
