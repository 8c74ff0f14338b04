// Reads MCAP files, whoever made them.
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
  std::uint64_t offset = 0;  ///< of its record from the chunk's first one on
  std::uint64_t end = 0;     ///< of the record after it
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

}  // namespace palpate::mcap
