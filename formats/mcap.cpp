#include "formats/mcap.h"

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <functional>
#include <span>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace palpate::mcap {
namespace {

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

constexpr std::uint64_t head_bytes = 9;       // opcode and length
constexpr std::uint64_t message_head = 22;    // before the data
constexpr std::uint64_t chunk_head = 40;      // before the records, where they are not compressed
constexpr std::uint64_t footer_bytes = 20;    // without its head
constexpr std::uint64_t index_head = 6;       // of a message index, before its entries
constexpr std::uint64_t index_entry = 16;     // of a message index
constexpr std::uint64_t most_text = 1 << 20;  // of a header, metadata, schema or channel [byte]
constexpr std::size_t most_texts = 1000;      // of each of these
constexpr std::uint64_t most_chunk = std::uint64_t{256} << 20;  // [byte]
constexpr std::size_t window = 64;                              // what is read of a record at first [byte]
constexpr const char* hint = "Copy the file again, or record the session again";

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// ---- what is written ----

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_text(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

void put_map(std::string& bytes, const TextMap& map) {
  std::string entries;
  for (const auto& [key, value] : map) {
    put_text(entries, key);
    put_text(entries, value);
  }
  put_text(bytes, entries);
}

void put_record(std::string& bytes, Opcode opcode, std::string_view content) {
  put<std::uint8_t>(bytes, opcode);
  put<std::uint64_t>(bytes, content.size());
  bytes += content;
}

std::string content_of(const Schema& schema) {
  std::string content;
  put(content, schema.id);
  put_text(content, schema.name);
  put_text(content, schema.encoding);
  put_text(content, schema.data);
  return content;
}

std::string content_of(const Channel& channel) {
  std::string content;
  put(content, channel.id);
  put(content, channel.schema);
  put_text(content, channel.topic);
  put_text(content, channel.encoding);
  put_map(content, channel.metadata);
  return content;
}

std::string content_of(const ChunkPlace& chunk) {
  std::string content, indexes;
  for (const MessageIndex& index : chunk.index) {
    put(indexes, index.channel);
    put(indexes, index.offset);
  }
  put(content, chunk.first);
  put(content, chunk.last);
  put(content, chunk.offset);
  put(content, chunk.length);
  put_text(content, indexes);
  put(content, chunk.index_length);
  put_text(content, "");  // not compressed
  put(content, chunk.size);
  put(content, chunk.size);
  return content;
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
  std::string content, by_channel;
  for (const auto& [channel, count] : counts) {
    put(by_channel, channel);
    put(by_channel, count);
  }
  put(content, all);
  put(content, static_cast<std::uint16_t>(layout.schemas.size()));
  put(content, static_cast<std::uint32_t>(layout.channels.size()));
  put<std::uint32_t>(content, 0);  // attachments
  put(content, static_cast<std::uint32_t>(layout.metadata.size()));
  put(content, static_cast<std::uint32_t>(layout.chunks.size()));
  put(content, first);
  put(content, last);
  put_text(content, by_channel);
  return content;
}

// ---- what is read ----

/// The fields of a record, from anywhere: what is not there reads as zero or nothing, and `whole` is false.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const std::string_view bytes = take(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  TextMap map() {
    TextMap map;
    Fields entries(text());
    while (entries.whole_ && !entries.rest_.empty()) {
      const std::string_view key = entries.text();
      map.emplace(key, entries.text());
    }
    whole_ = whole_ && entries.whole_;
    return map;
  }
  [[nodiscard]] bool whole() const noexcept { return whole_; }

 private:
  std::string_view take(std::size_t count) {
    if (count <= rest_.size()) {
      const std::string_view bytes = rest_.substr(0, count);
      rest_.remove_prefix(count);
      return bytes;
    }
    whole_ = false;
    rest_ = {};
    return {};
  }

  std::string_view rest_;
  bool whole_ = true;
};

[[noreturn]] void refuse(const std::filesystem::path& file, std::uint64_t at, const std::string& what) {
  throw Error("is damaged: the record at byte " + std::to_string(at) + " " + what, file.string(), hint);
}

std::string read_bytes(const FileDescriptor& file, std::uint64_t offset, std::uint64_t count) {
  std::string bytes(count, '\0');
  read_exactly(file, std::as_writable_bytes(std::span(bytes)), static_cast<std::int64_t>(offset));
  return bytes;
}

/// Goes from record to record.
class Walk {
 public:
  explicit Walk(const FileDescriptor& file)
      : file_(file), size_(static_cast<std::uint64_t>(file_size(file))) {}

  Layout run() {
    if (size_ < magic.size() || read_bytes(file_, 0, magic.size()) != magic)
      throw Error("is not an MCAP file", file_.path().string(), "Give a recording that Palpate has written");
    at_ = magic.size();
    if (!next() || opcode_ != op_header) refuse("is no header");
    if (length_ > most_text) refuse("is too long for a header");
    while (pass(), next() && opcode_ != op_data_end) take();
    layout_.end = at_;
    if (opcode_ == op_data_end && at_ < size_) {
      pass();
      layout_.finished = has_end();
    }
    if (!layout_.finished && ends_with_magic()) refuse("is cut off, and the file goes on behind it");
    return std::move(layout_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const { mcap::refuse(file_.path(), at_, what); }

  /// The record at `at_`; false where the file ends within it.
  bool next() {
    opcode_ = 0;
    if (size_ - at_ < head_bytes) return false;
    start_ = read_bytes(file_, at_, std::min<std::uint64_t>(size_ - at_, window));
    Fields head(start_);
    opcode_ = head.number<std::uint8_t>();
    length_ = head.number<std::uint64_t>();
    if (opcode_ == 0) refuse("is of no kind");
    if (length_ > size_ - at_ - head_bytes) {
      opcode_ = 0;
      return false;
    }
    start_ = start_.substr(head_bytes, length_);
    return true;
  }
  void pass() { at_ += head_bytes + length_; }

  std::string content(std::size_t so_far) const {
    if (length_ > most_text || so_far >= most_texts) refuse("is more than there is room for");
    return read_bytes(file_, at_ + head_bytes, length_);
  }

  /// Takes note of a record of the data.
  void take() {
    switch (opcode_) {
      case op_schema:
        return take_schema();
      case op_channel:
        return take_channel();
      case op_metadata:
        return take_metadata();
      case op_chunk:
        return take_chunk();
      case op_message_index:
        return take_index();
      case op_message:
        refuse("is a message beside all chunks, and recordings have none");
      case op_header:
      case op_footer:
      case op_chunk_index:
      case op_attachment_index:
      case op_statistics:
      case op_metadata_index:
      case op_summary_offset:
        refuse("does not belong before the end of the data");
      default:  // of a later version, or an attachment
        return;
    }
  }

  void take_schema() {
    const std::string bytes = content(layout_.schemas.size());
    Fields fields(bytes);
    Schema schema{.id = fields.number<std::uint16_t>()};
    schema.name = fields.text();
    schema.encoding = fields.text();
    schema.data = fields.text();
    if (!fields.whole() || schema.id == 0) refuse("is no schema");
    keep(layout_.schemas, std::move(schema));
  }

  void take_channel() {
    const std::string bytes = content(layout_.channels.size());
    Fields fields(bytes);
    Channel channel{.id = fields.number<std::uint16_t>(), .schema = fields.number<std::uint16_t>()};
    channel.topic = fields.text();
    channel.encoding = fields.text();
    channel.metadata = fields.map();
    if (!fields.whole()) refuse("is no channel");
    keep(layout_.channels, std::move(channel));
  }

  template <class T>
  void keep(std::vector<T>& all, T&& one) {
    const auto same = std::ranges::find(all, one.id, &T::id);
    if (same == all.end()) return all.push_back(std::forward<T>(one));
    if (*same != one) refuse("has the number of another one");
  }

  void take_metadata() {
    const std::string bytes = content(layout_.metadata.size());
    Fields fields(bytes);
    Metadata metadata{.offset = at_, .length = head_bytes + length_};
    metadata.name = fields.text();
    metadata.values = fields.map();
    if (!fields.whole()) refuse("is no metadata");
    layout_.metadata.push_back(std::move(metadata));
  }

  void take_chunk() {
    Fields fields(start_);
    ChunkPlace chunk{.offset = at_, .length = head_bytes + length_};
    chunk.first = fields.number<std::uint64_t>();
    chunk.last = fields.number<std::uint64_t>();
    const auto expanded = fields.number<std::uint64_t>();
    chunk.crc = fields.number<std::uint32_t>();
    const auto compression = fields.number<std::uint32_t>();
    if (fields.whole() && compression != 0)
      refuse("is a chunk that is compressed, and those of recordings are not");
    chunk.size = fields.number<std::uint64_t>();
    chunk.records = at_ + head_bytes + chunk_head;
    if (!fields.whole() || chunk.size > length_ - chunk_head || expanded != chunk.size) refuse("is no chunk");
    if (chunk.size > most_chunk) refuse("is a chunk that is too large");
    layout_.chunks.push_back(chunk);
  }

  void take_index() {
    Fields fields(start_);
    MessageIndex index{.channel = fields.number<std::uint16_t>(), .offset = at_};
    const auto bytes = fields.number<std::uint32_t>();
    if (!fields.whole() || bytes > length_ - index_head || bytes % index_entry != 0)
      refuse("is no index of messages");
    if (layout_.chunks.empty()) refuse("is an index of messages without a chunk");
    ChunkPlace& chunk = layout_.chunks.back();
    if (chunk.offset + chunk.length + chunk.index_length != at_ || chunk.index.size() >= most_texts)
      refuse("is an index of messages that does not follow its chunk");
    index.count = bytes / index_entry;
    chunk.index.push_back(index);
    chunk.index_length += head_bytes + length_;
  }

  /// From behind the end of the data to the file's end.
  bool has_end() {
    const std::uint64_t summary = at_;
    for (; next(); pass()) {
      if (opcode_ != op_footer) {
        constexpr std::array known = {op_schema,        op_channel,          op_statistics,
                                      op_chunk_index,   op_attachment_index, op_metadata_index,
                                      op_summary_offset};
        if (std::ranges::find(known, opcode_) == known.end() && opcode_ < 0x10)
          refuse("does not belong to an index");
        continue;
      }
      if (length_ != footer_bytes) refuse("is no footer");
      const std::uint64_t end = at_ + head_bytes + footer_bytes;
      if (size_ - end < magic.size()) return false;
      if (size_ - end > magic.size() || !ends_with_magic()) refuse("is not the last one");
      Fields footer(start_);
      const auto begin = footer.number<std::uint64_t>();
      (void)footer.number<std::uint64_t>();
      const auto crc = footer.number<std::uint32_t>();
      if (begin != summary) refuse("says that the index begins elsewhere");
      if (crc != 0 && crc != crc_from(summary, at_ + head_bytes + 16))
        throw Error("is damaged: its index was altered", file_.path().string(), hint);
      return true;
    }
    return false;
  }

  std::uint32_t crc_from(std::uint64_t begin, std::uint64_t end) const {
    std::uint32_t crc = 0;
    for (constexpr std::uint64_t block = 1 << 20; begin < end; begin += block)
      crc = crc_of(read_bytes(file_, begin, std::min(block, end - begin)), crc);
    return crc;
  }

  bool ends_with_magic() const { return read_bytes(file_, size_ - magic.size(), magic.size()) == magic; }

  const FileDescriptor& file_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;
  std::uint8_t opcode_ = 0;
  std::uint64_t length_ = 0;
  std::string start_;  // of its content
  Layout layout_;
};

Message message_head_of(std::string_view content) {
  Fields fields(content);
  Message message{.channel = fields.number<std::uint16_t>()};
  message.sequence = fields.number<std::uint32_t>();
  message.time = fields.number<std::uint64_t>();
  return message;
}

/// The length of a message's record in a chunk, of which `rest` bytes are left; 0 where it is none.
std::uint64_t message_length(std::string_view head, std::uint64_t rest) {
  Fields fields(head);
  const auto opcode = fields.number<std::uint8_t>();
  const auto length = fields.number<std::uint64_t>();
  if (rest < head_bytes + message_head || opcode != op_message || length < message_head ||
      length > rest - head_bytes)
    return 0;
  return length;
}

[[noreturn]] void refuse_message(const std::filesystem::path& file, std::uint64_t at) {
  throw Error("is damaged: byte " + std::to_string(at) + " of a chunk begins no message", file.string(),
              hint);
}

}  // namespace

Layout read_layout(const FileDescriptor& file) {
  return Walk(file).run();
}

std::string read_chunk(const FileDescriptor& file, const ChunkPlace& chunk) {
  std::string records = read_bytes(file, chunk.records, chunk.size);
  if (crc_of(records) != chunk.crc) refuse(file.path(), chunk.offset, "was altered: its checksum is another");
  return records;
}

Message message_at(const std::filesystem::path& file, std::string_view records, std::uint64_t offset) {
  const std::string_view rest = records.substr(std::min<std::uint64_t>(offset, records.size()));
  const std::uint64_t length = message_length(rest, rest.size());
  if (length == 0) refuse_message(file, offset);
  Message message = message_head_of(rest.substr(head_bytes));
  message.data = rest.substr(head_bytes + message_head, length - message_head);
  message.offset = offset;
  message.end = offset + head_bytes + length;
  return message;
}

std::vector<Message> messages_of(const std::filesystem::path& file, std::string_view records) {
  std::vector<Message> messages;
  for (std::uint64_t at = 0; at < records.size(); at = messages.back().end)
    messages.push_back(message_at(file, records, at));
  return messages;
}

std::vector<MessageStart> message_starts(const FileDescriptor& file, const ChunkPlace& chunk,
                                         std::size_t most) {
  std::vector<MessageStart> starts;
  for (std::uint64_t at = 0; at < chunk.size && starts.size() < most;) {
    const std::uint64_t rest = chunk.size - at;
    const std::string bytes = read_bytes(file, chunk.records + at, std::min<std::uint64_t>(rest, window));
    const std::uint64_t length = message_length(bytes, rest);
    if (length == 0) refuse_message(file.path(), at);
    const std::string_view content = std::string_view(bytes).substr(head_bytes, length);
    starts.push_back({.message = message_head_of(content),
                      .first = std::string(content.substr(message_head)),
                      .size = length - message_head});
    starts.back().message.offset = at;
    at += head_bytes + length;
  }
  return starts;
}

void Chunk::append(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time, std::string_view data) {
  first_ = records_.empty() ? time : std::min(first_, time);
  last_ = std::max(last_, time);
  index_[channel].push_back({time, records_.size()});
  put<std::uint8_t>(records_, op_message);
  put<std::uint64_t>(records_, message_head + data.size());
  put(records_, channel);
  put(records_, sequence);
  put(records_, time);  // when it was logged
  put(records_, time);  // when it was published
  records_ += data;
}

Writer::Writer(FileDescriptor file, std::string_view library) : file_(std::move(file)) {
  std::string header;
  put_text(header, "ros2");
  put_text(header, library);
  waiting_ = magic;
  put_record(waiting_, op_header, header);
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
  std::string content;
  put_text(content, metadata.name);
  put_map(content, metadata.values);
  layout_.metadata.push_back(metadata);
  layout_.metadata.back().offset = layout_.end + waiting_.size();
  layout_.metadata.back().length = head_bytes + content.size();
  put_record(waiting_, op_metadata, content);
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
  put<std::uint8_t>(bytes, op_chunk);
  put<std::uint64_t>(bytes, chunk_head + place.size);
  put(bytes, place.first);
  put(bytes, place.last);
  put(bytes, place.size);
  put(bytes, place.crc);
  put_text(bytes, "");  // not compressed
  put(bytes, place.size);
  bytes += chunk.records_;
  for (const auto& [channel, entries] : chunk.index_) {
    place.index.push_back(
        {.channel = channel, .offset = layout_.end + bytes.size(), .count = entries.size()});
    std::string content;
    put(content, channel);
    put(content, static_cast<std::uint32_t>(index_entry * entries.size()));
    for (const auto& entry : entries) {
      put(content, entry.time);
      put(content, entry.offset);
    }
    put_record(bytes, op_message_index, content);
  }
  place.index_length = bytes.size() - place.length;
  append(bytes);
  layout_.chunks.push_back(std::move(place));
  chunk = {};
}

void Writer::finish() {
  flush();
  std::string data_end;
  put<std::uint32_t>(data_end, 0);  // no CRC: each chunk has its own
  put_record(waiting_, op_data_end, data_end);
  const std::uint64_t start = layout_.end + waiting_.size();
  std::string summary, offsets;
  const auto group = [&](Opcode opcode, const auto& all, const auto& content) {
    const std::uint64_t before = summary.size();
    for (const auto& one : all) put_record(summary, opcode, content(one));
    if (summary.size() == before) return;
    std::string offset;
    put<std::uint8_t>(offset, opcode);
    put(offset, start + before);
    put(offset, summary.size() - before);
    put_record(offsets, op_summary_offset, offset);
  };
  const auto same = [](const auto& one) { return content_of(one); };
  group(op_schema, layout_.schemas, same);
  group(op_channel, layout_.channels, same);
  group(op_statistics, std::array{0}, [&](int) { return statistics_of(layout_); });
  group(op_chunk_index, layout_.chunks, same);
  group(op_metadata_index, layout_.metadata, [](const Metadata& metadata) {
    std::string content;
    put(content, metadata.offset);
    put(content, metadata.length);
    put_text(content, metadata.name);
    return content;
  });
  const std::uint64_t offsets_start = start + summary.size();
  summary += offsets;
  put<std::uint8_t>(summary, op_footer);
  put<std::uint64_t>(summary, footer_bytes);
  put(summary, start);
  put(summary, offsets_start);
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
