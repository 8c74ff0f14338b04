// Writer of MCAP files that only grow.
#pragma once

#include <cstddef>

#include "base/file_io.h"
#include "formats/mcap/records.h"

namespace palpate::mcap {

/// Messages collected for the file.
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

/// Writer of a file from its beginning to its end, or of the continuation after the last whole chunk of a
/// file without an end.
class Writer {
 public:
  /// Begins an empty file; nothing is written before the first chunk or `flush`.
  Writer(FileDescriptor file, std::string_view library);
  /// Continues a file. Throws Error.
  Writer(FileDescriptor file, Layout found);

  void add(const Metadata& metadata);
  void add(const Schema& schema);
  void add(const Channel& channel);
  /// Writes everything to the file. Throws Error if the disk is full, as do all below; the file is then as
  /// before.
  void flush();
  /// Writes and empties a chunk, with its index; does nothing if it is empty.
  void write(Chunk& chunk);
  /// Writes the end of the data and the index, and flushes all to the disk.
  void finish();

 private:
  void append(std::string_view bytes);

  FileDescriptor file_;
  Layout layout_;        // so far
  std::string waiting_;  // bytes that are not in the file yet
};

}  // namespace palpate::mcap
