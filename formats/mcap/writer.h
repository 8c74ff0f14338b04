// Writes MCAP files that only grow.
#pragma once

#include <cstddef>

#include "base/file_io.h"
#include "formats/mcap/records.h"

namespace palpate::mcap {

/// Messages on their way into a file.
class Chunk {
 public:
  void append(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time, std::string_view data);
  [[nodiscard]] std::size_t bytes() const noexcept { return records_.size(); }

 private:
  friend class Writer;
  struct Entry {
    std::uint64_t time;
    std::uint64_t offset;
  };
  std::string records_;
  std::map<std::uint16_t, std::vector<Entry>> index_;  // by channel
  std::uint64_t first_ = 0, last_ = 0;                 // [ns]
};

/// Writes a file from its beginning to its end, or goes on behind the last whole chunk of one that has no
/// end.
class Writer {
 public:
  /// Begins a file that is empty; nothing is written before the first chunk or `flush`.
  Writer(FileDescriptor file, std::string_view library);
  /// Goes on. Throws Error.
  Writer(FileDescriptor file, Layout found);

  void add(const Metadata& metadata);
  void add(const Schema& schema);
  void add(const Channel& channel);
  /// Throws Error, as all that follow, when the disk is full; then the file is as it was before.
  void flush();
  /// Writes and empties a chunk, with its index; nothing where it is empty.
  void write(Chunk& chunk);
  /// The end of the data and the index, and all of it to the disk.
  void finish();

 private:
  void append(std::string_view bytes);

  FileDescriptor file_;
  Layout layout_;        // so far
  std::string waiting_;  // bytes that are not in the file yet
};

}  // namespace palpate::mcap
