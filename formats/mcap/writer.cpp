#include "formats/mcap/writer.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <concepts>
#include <span>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "formats/mcap/reader.h"

namespace palpate::mcap {
namespace {

template <class T>
requires std::integral<T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

void put(std::string& bytes, const TextMap& map) {
  std::string entries;
  for (const auto& [key, value] : map) {
    put(entries, key);
    put(entries, value);
  }
  put(bytes, entries);
}

/// Appends numbers, texts and maps one after another.
void put_all(std::string& bytes, const auto&... values) {
  (put(bytes, values), ...);
}

std::string content(const auto&... values) {
  std::string bytes;
  put_all(bytes, values...);
  return bytes;
}

template <class Record>
std::string content_of(const Record& record) {
  std::string bytes;
  Record::fields(record, [&](const auto&... values) { put_all(bytes, values...); });
  return bytes;
}

std::string content_of(const ChunkPlace& chunk) {
  std::string indexes;
  for (const MessageIndex& index : chunk.index) put_all(indexes, index.channel, index.offset);
  constexpr std::string_view not_compressed;
  return content(chunk.first, chunk.last, chunk.offset, chunk.length, indexes, chunk.index_length,
                 not_compressed, chunk.size, chunk.size);
}

void put_head(std::string& bytes, Opcode opcode, std::uint64_t length) {
  put(bytes, std::uint8_t{opcode});
  put(bytes, length);
}

void put_record(std::string& bytes, Opcode opcode, std::string_view content) {
  put_head(bytes, opcode, content.size());
  bytes += content;
}

std::string statistics_of(const Layout& layout) {
  std::map<std::uint16_t, std::uint64_t> counts;
  std::uint64_t all = 0, first = 0, last = 0;
  for (const ChunkPlace& chunk : layout.chunks) {
    first = all == 0 ? chunk.first : std::min(first, chunk.first);
    last = std::max(last, chunk.last);
    for (const MessageIndex& index : chunk.index) {
      counts[index.channel] += index.count;
      all += index.count;
    }
  }
  std::string by_channel;
  for (const auto& [channel, count] : counts) put_all(by_channel, channel, count);
  constexpr std::uint32_t attachments = 0;
  return content(all, static_cast<std::uint16_t>(layout.schemas.size()),
                 static_cast<std::uint32_t>(layout.channels.size()), attachments,
                 static_cast<std::uint32_t>(layout.metadata.size()),
                 static_cast<std::uint32_t>(layout.chunks.size()), first, last, by_channel);
}

}  // namespace

void Chunk::append(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time, std::string_view data) {
  first_ = records_.empty() ? time : std::min(first_, time);
  last_ = std::max(last_, time);
  index_[channel].push_back({time, records_.size()});
  put_head(records_, op_message, message_head + data.size());
  put_all(records_, channel, sequence, time, time);  // times of logging and publishing
  records_ += data;
}

Writer::Writer(FileDescriptor file, std::string_view library) : file_(std::move(file)), waiting_(magic) {
  put_record(waiting_, op_header, content(std::string_view("ros2"), library));
}

Writer::Writer(FileDescriptor file, Layout found) : file_(std::move(file)), layout_(std::move(found)) {
  if (layout_.chunks.empty()) return;
  // The last chunk may lack its index.
  const std::string records = read_chunk(file_, layout_.chunks.back());
  Chunk again;
  for (const Message& message : messages_of(file_.path(), records))
    again.append(message.channel, message.sequence, message.time, message.data);
  layout_.end = layout_.chunks.back().offset;
  layout_.chunks.pop_back();
  write(again);
}

void Writer::add(const Metadata& metadata) {
  const std::string bytes = content_of(metadata);
  layout_.metadata.push_back(metadata);
  layout_.metadata.back().offset = layout_.end + waiting_.size();
  layout_.metadata.back().length = head_bytes + bytes.size();
  put_record(waiting_, op_metadata, bytes);
}

void Writer::add(const Schema& schema) {
  layout_.schemas.push_back(schema);
  put_record(waiting_, op_schema, content_of(schema));
}

void Writer::add(const Channel& channel) {
  layout_.channels.push_back(channel);
  put_record(waiting_, op_channel, content_of(channel));
}

void Writer::flush() {
  append(std::exchange(waiting_, {}));
}

void Writer::append(std::string_view bytes) {
  try {
    write_exactly(file_, std::as_bytes(std::span(bytes)), static_cast<std::int64_t>(layout_.end));
  } catch (const Error&) {
    [[maybe_unused]] const int ignored = ::ftruncate(file_.get(), static_cast<off_t>(layout_.end));
    throw;
  }
  layout_.end += bytes.size();
}

void Writer::write(Chunk& chunk) {
  if (chunk.bytes() == 0) return;
  flush();
  ChunkPlace place{.offset = layout_.end,
                   .length = head_bytes + chunk_head + chunk.bytes(),
                   .records = layout_.end + head_bytes + chunk_head,
                   .size = chunk.bytes(),
                   .crc = crc_of(chunk.records_),
                   .first = chunk.first_,
                   .last = chunk.last_};
  std::string bytes;
  bytes.reserve(place.length + 64 * chunk.index_.size());
  put_head(bytes, op_chunk, chunk_head + place.size);
  constexpr std::string_view not_compressed;
  put_all(bytes, place.first, place.last, place.size, place.crc, not_compressed, place.size);
  bytes += chunk.records_;
  for (const auto& [channel, entries] : chunk.index_) {
    place.index.push_back(
        {.channel = channel, .offset = layout_.end + bytes.size(), .count = entries.size()});
    std::string index = content(channel, static_cast<std::uint32_t>(index_entry * entries.size()));
    for (const auto& entry : entries) put_all(index, entry.time, entry.offset);
    put_record(bytes, op_message_index, index);
  }
  place.index_length = bytes.size() - place.length;
  append(bytes);
  layout_.chunks.push_back(std::move(place));
  chunk = {};
}

void Writer::finish() {
  flush();
  put_record(waiting_, op_data_end, content(std::uint32_t{0}));  // no CRC: each chunk has its own
  const std::uint64_t start = layout_.end + waiting_.size();
  std::string summary, offsets;
  const auto group = [&](Opcode opcode, const auto& all, const auto& content_of_one) {
    const std::uint64_t before = summary.size();
    for (const auto& one : all) put_record(summary, opcode, content_of_one(one));
    if (summary.size() == before) return;
    put_record(offsets, op_summary_offset,
               content(std::uint8_t{opcode}, start + before, summary.size() - before));
  };
  const auto same = [](const auto& one) { return content_of(one); };
  group(op_schema, layout_.schemas, same);
  group(op_channel, layout_.channels, same);
  group(op_statistics, std::array{0}, [&](int) { return statistics_of(layout_); });
  group(op_chunk_index, layout_.chunks, same);
  group(op_metadata_index, layout_.metadata,
        [](const Metadata& metadata) { return content(metadata.offset, metadata.length, metadata.name); });
  const std::uint64_t offsets_start = start + summary.size();
  summary += offsets;
  put_head(summary, op_footer, footer_bytes);
  put_all(summary, start, offsets_start);
  put(summary, crc_of(summary));
  waiting_ += summary;
  waiting_ += magic;
  if (::ftruncate(file_.get(), static_cast<off_t>(layout_.end)) != 0)
    throw Error("cannot be cut: " + std::generic_category().message(errno), file_.path().string(),
                "Check the file's rights");
  flush();
  palpate::flush(file_);
}

}  // namespace palpate::mcap
