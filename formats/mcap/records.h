// MCAP files, version 0 (mcap.dev/spec), as far as recordings need them: messages in uncompressed chunks.
// Definitions common to readers (reader.h) and writers (writer.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::mcap {

inline constexpr std::string_view magic = "\x89MCAP0\r\n";

enum Opcode : std::uint8_t {
  op_header = 1,
  op_footer = 2,
  op_schema = 3,
  op_channel = 4,
  op_message = 5,
  op_chunk = 6,
  op_message_index = 7,
  op_chunk_index = 8,
  op_attachment_index = 10,
  op_statistics = 11,
  op_metadata = 12,
  op_metadata_index = 13,
  op_summary_offset = 14,
  op_data_end = 15,
};

inline constexpr std::uint64_t head_bytes = 9;     ///< opcode and length
inline constexpr std::uint64_t message_head = 22;  ///< before the data
inline constexpr std::uint64_t chunk_head = 40;    ///< before the records, where they are not compressed
inline constexpr std::uint64_t footer_bytes = 20;  ///< without its head
inline constexpr std::uint64_t index_entry = 16;   ///< of a message index

using TextMap = std::map<std::string, std::string>;

// `fields` passes the members of a record, in the file's order, to the visitor that writes or reads them.

struct Schema {
  std::uint16_t id = 0;
  std::string name{};
  std::string encoding{};
  std::string data{};

  bool operator==(const Schema&) const = default;
  static void fields(auto& of, auto&& visit) { visit(of.id, of.name, of.encoding, of.data); }
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;
  std::string topic{};
  std::string encoding{};
  TextMap metadata{};

  bool operator==(const Channel&) const = default;
  static void fields(auto& of, auto&& visit) { visit(of.id, of.schema, of.topic, of.encoding, of.metadata); }
};

struct Metadata {
  std::string name{};
  TextMap values{};
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t length = 0;  ///< [byte] of the record

  static void fields(auto& of, auto&& visit) { visit(of.name, of.values); }
};

/// Index of a channel's messages in a chunk.
struct MessageIndex {
  std::uint16_t channel = 0;
  std::uint64_t offset = 0;  ///< position of its record in the file
  std::uint64_t count = 0;
};

/// A chunk in a file.
struct ChunkPlace {
  std::uint64_t offset = 0;   ///< position of its record in the file
  std::uint64_t length = 0;   ///< [byte] of the record
  std::uint64_t records = 0;  ///< offset in the file of the records in it
  std::uint64_t size = 0;     ///< [byte] of the records
  std::uint32_t crc = 0;      ///< of the records
  std::uint64_t first = 0;    ///< time of the earliest message [ns]
  std::uint64_t last = 0;     ///< time of the latest message [ns]
  std::vector<MessageIndex> index{};
  std::uint64_t index_length = 0;  ///< [byte] of all records of the index
};

/// Contents of a file except its messages.
struct Layout {
  std::vector<Metadata> metadata;
  std::vector<Schema> schemas;
  std::vector<Channel> channels;
  std::vector<ChunkPlace> chunks;
  std::uint64_t end = 0;  ///< end [byte] of the last whole record before the end of the data
  bool finished = false;  ///< the end of the data, the index and the last magic are there
};

/// CRC-32 of `bytes` appended to bytes whose CRC is `before`.
[[nodiscard]] std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0);

}  // namespace palpate::mcap
