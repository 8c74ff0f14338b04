// Running code that may crash in a child process.
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

/// Bytes that a child sends to its parent.
using Bytes = std::vector<std::byte>;

/// Result of a child's work: a status whose meaning the work defines (0 is success), and its bytes.
struct ChildResult {
  int status = 0;
  Bytes bytes;
};

/// Limits of a child. The wall clock limit is generous because a busy machine gives a child little of the
/// processor; the processor limit is the one that ends a child that never stops computing.
struct ChildLimits {
  std::chrono::seconds processor{};  ///< processor time, at least 1 s
  std::chrono::seconds clock{};      ///< wall clock time from start to end
  std::int64_t memory = 0;           ///< [byte] of address space, beyond what the process has at the fork
};

/// Limits of `processor` seconds of processor time, twelve times that of wall clock time, and `memory` bytes.
ChildLimits child_limits(std::chrono::seconds processor, std::int64_t memory);

/// Limits for reading and checking untrusted files of `bytes` in total: meant to be far above what valid
/// files take.
ChildLimits reading_limits(std::int64_t bytes);

/// A child's name, its limits and the texts for its failures.
struct ChildTask {
  std::string name;   ///< program or library that runs there
  std::string where;  ///< `where` of the Error: the file
  ChildLimits limits;
  std::string hint = "simplify, repair or remesh the input";  ///< of the Error after a crash or at a limit
  std::vector<int> files{};  ///< descriptors, open for reading, that the work needs
  /// Signals such as Ctrl-C end the wait and the child. If false, they are left to the host program.
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

/// Throws Error: the child's answer is malformed.
[[noreturn]] void fail_on_answer();

/// Takes an array from the front of `bytes`. Throws Error if they do not hold all of it.
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
