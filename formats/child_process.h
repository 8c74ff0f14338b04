// Work that may crash, in a process of its own.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Bytes that a child hands to its parent.
using Bytes = std::vector<std::byte>;

/// What a child's work gives back: a status that means what the work wants it to (0 is success) and its
/// result.
struct ChildResult {
  int status = 0;
  Bytes bytes;
};

/// Runs `work` in a forked child and returns its result; the child's output to the screen is dropped. `name`
/// is the program or library that runs there. Throws Error (where = `where`) when the child crashes, exits by
/// itself, throws, or runs longer than `limit`, and kills it when a signal such as Ctrl-C interrupts the
/// wait. `work` must not rely on other threads.
ChildResult run_in_child(const std::string& name, const std::string& where, std::chrono::seconds limit,
                         const std::function<ChildResult()>& work);

/// A mesh as bytes, and back.
Bytes pack(const Mesh& mesh);
Mesh unpack_mesh(const Bytes& bytes);

/// Appends the bytes of `values`.
template <typename T>
void append_bytes(Bytes& bytes, std::span<const T> values) {
  const std::size_t before = bytes.size();
  bytes.resize(before + values.size_bytes());
  std::copy_n(reinterpret_cast<const std::byte*>(values.data()), values.size_bytes(), bytes.data() + before);
}

}  // namespace palpate
