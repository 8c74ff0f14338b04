// MCAP files, version 0 (mcap.dev/spec), as far as recordings need them: messages in uncompressed chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_io.h"

namespace palpate::mcap {

inline constexpr std::string_view magic = "\x89MCAP0\r\n";

using TextMap = std::map<std::string, std::string>;

struct Schema {
  std::uint16_t id = 0;
  std::string name{};
  std::string encoding{};
  std::string data{};

  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;
  std::string topic{};
  std::string encoding{};
  TextMap metadata{};

  bool operator==(const Channel&) const = default;
};

struct Metadata {
  std::string name{};
  TextMap values{};
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t length = 0;  ///< [byte] of the record
};

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t time = 0;  ///< [ns]
  std::string_view data{};
  std::uint64_t offset = 0;  ///< of its record from the chunk's first one on
  std::uint64_t end = 0;     ///< of the record after it
};

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

/// The index of a channel's messages in a chunk.
struct MessageIndex {
  std::uint16_t channel = 0;
  std::uint64_t offset = 0;  ///< of its record in the file
  std::uint64_t count = 0;
};

/// A chunk in a file.
struct ChunkPlace {
  std::uint64_t offset = 0;   ///< of its record in the file
  std::uint64_t length = 0;   ///< [byte] of the record
  std::uint64_t records = 0;  ///< offset in the file of the records in it
  std::uint64_t size = 0;     ///< [byte] of these
  std::uint32_t crc = 0;      ///< of these
  std::uint64_t first = 0;    ///< time of the earliest message [ns]
  std::uint64_t last = 0;     ///< and of the latest [ns]
  std::vector<MessageIndex> index{};
  std::uint64_t index_length = 0;  ///< [byte] of all records of the index
};

/// What of a file is found without its messages.
struct Layout {
  std::vector<Metadata> metadata;
  std::vector<Schema> schemas;
  std::vector<Channel> channels;
  std::vector<ChunkPlace> chunks;
  std::uint64_t end = 0;  ///< [byte] of the last whole record before the end of the data
  bool finished = false;  ///< the end of the data, the index and the last magic are there
};

/// Walks over the records of a file that may be anybody's: each length is compared with the file's before
/// memory is taken, and a record that the file's end cuts off ends what there is. Throws Error where it is no
/// MCAP file, or breaks the format's rules.
Layout read_layout(const FileDescriptor& file);

/// The records of a chunk. Throws Error where their CRC is another one.
std::string read_chunk(const FileDescriptor& file, const ChunkPlace& chunk);

/// The message whose record begins so many bytes after that of the first. Throws Error (where = `file`) where
/// there is none.
Message message_at(const std::filesystem::path& file, std::string_view records, std::uint64_t offset);

/// The messages of a chunk's records, in their order. Throws Error (where = `file`) where these are broken.
std::vector<Message> messages_of(const std::filesystem::path& file, std::string_view records);

/// These with the first bytes of their data only, read from the file one by one, without a look at the
/// CRC: of a chunk of few large messages.
struct MessageStart {
  Message message;         ///< data: none
  std::string first{};     ///< bytes of its data, at most 32
  std::uint64_t size = 0;  ///< of all its data
};
std::vector<MessageStart> message_starts(const FileDescriptor& file, const ChunkPlace& chunk,
                                         std::size_t most = ~std::size_t{0});

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
