// Reader of MCAP files of any origin.
#pragma once

#include <cstddef>
#include <filesystem>

#include "base/file_io.h"
#include "formats/mcap/records.h"

namespace palpate::mcap {

struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t time = 0;  ///< [ns]
  std::string_view data{};
  std::uint64_t offset = 0;  ///< of its record, from the chunk's first record
  std::uint64_t end = 0;     ///< of the next record
};

/// Walks over the records of an untrusted file: each length is compared with the file's before memory is
/// allocated, and a truncated record ends the layout. Throws Error if it is no MCAP file or breaks the
/// format's rules.
Layout read_layout(const FileDescriptor& file);

/// Records of a chunk. Throws Error if their CRC does not match.
std::string read_chunk(const FileDescriptor& file, const ChunkPlace& chunk);

/// Message whose record begins at this offset from the first record. Throws Error (where = `file`) if there
/// is none.
Message message_at(const std::filesystem::path& file, std::string_view records, std::uint64_t offset);

/// Messages of a chunk's records, in order. Throws Error (where = `file`) if the records are damaged.
std::vector<Message> messages_of(const std::filesystem::path& file, std::string_view records);

/// A message with only the first bytes of its data, read from the file by itself and without checking the
/// CRC; for chunks of few large messages.
struct MessageStart {
  Message message;         ///< data: none
  std::string first{};     ///< bytes of its data, at most 32
  std::uint64_t size = 0;  ///< of all its data
};
std::vector<MessageStart> message_starts(const FileDescriptor& file, const ChunkPlace& chunk,
                                         std::size_t most = ~std::size_t{0});

}  // namespace palpate::mcap
