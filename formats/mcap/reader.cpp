#include "formats/mcap/reader.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstring>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>

#include "base/error.h"

namespace palpate::mcap {
namespace {

constexpr std::uint64_t index_head = 6;       // of a message index, before its entries
constexpr std::uint64_t most_text = 1 << 20;  // of a header, metadata, schema or channel [byte]
constexpr std::size_t most_texts = 1000;      // of each of these
constexpr std::uint64_t most_chunk = std::uint64_t{256} << 20;  // [byte]
constexpr std::size_t window = 64;                              // bytes of a record that are read at first
constexpr const char* hint = "Copy the file again, or record the session again";

/// Fields of an untrusted record: missing data read as zero or empty, and `whole` is then false.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : rest_(bytes) {}

  /// Reads the next fields: numbers, texts and maps.
  void read(auto&... values) { (get(values), ...); }
  [[nodiscard]] bool whole() const noexcept { return whole_; }

 private:
  void get(std::integral auto& value) {
    const std::string_view bytes = take(sizeof value);
    value = 0;
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
  }
  void get(std::string& text) { text = taken_text(); }
  void get(TextMap& map) {
    Fields entries(taken_text());
    std::string key, value;
    while (entries.whole_ && !entries.rest_.empty()) {
      entries.read(key, value);
      map.emplace(key, value);
    }
    whole_ = whole_ && entries.whole_;
  }
  std::string_view taken_text() {
    std::uint32_t size = 0;
    get(size);
    return take(size);
  }
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

/// Walk from record to record.
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

  /// Reads the head of the record at `at_`; false if the file ends within it.
  bool next() {
    opcode_ = 0;
    if (size_ - at_ < head_bytes) return false;
    start_ = read_bytes(file_, at_, std::min<std::uint64_t>(size_ - at_, window));
    Fields(start_).read(opcode_, length_);
    if (opcode_ == 0) refuse("is of no kind");
    if (length_ > size_ - at_ - head_bytes) {
      opcode_ = 0;
      return false;
    }
    start_ = start_.substr(head_bytes, length_);
    return true;
  }
  void pass() { at_ += head_bytes + length_; }

  /// Decodes this record; `all` are the earlier ones of its kind.
  template <class T>
  T record(const std::vector<T>& all, const char* what) const {
    if (length_ > most_text || all.size() >= most_texts) refuse("exceeds the limits of this program");
    const std::string bytes = read_bytes(file_, at_ + head_bytes, length_);
    Fields fields(bytes);
    T one;
    T::fields(one, [&](auto&... members) { fields.read(members...); });
    if (!fields.whole()) refuse(what);
    return one;
  }

  /// Handles a record of the data section.
  void take() {
    switch (opcode_) {
      case op_schema:
        return keep(layout_.schemas, "is no schema");
      case op_channel:
        return keep(layout_.channels, "is no channel");
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

  template <class T>
  void keep(std::vector<T>& all, const char* what) {
    T one = record(all, what);
    if (std::is_same_v<T, Schema> && one.id == 0) refuse(what);
    const auto same = std::ranges::find(all, one.id, &T::id);
    if (same == all.end()) return all.push_back(std::move(one));
    if (*same != one) refuse("has the number of another one");
  }

  void take_metadata() {
    Metadata metadata = record(layout_.metadata, "is no metadata");
    metadata.offset = at_;
    metadata.length = head_bytes + length_;
    layout_.metadata.push_back(std::move(metadata));
  }

  void take_chunk() {
    Fields fields(start_);
    ChunkPlace chunk{.offset = at_, .length = head_bytes + length_};
    std::uint64_t expanded = 0;
    std::uint32_t compression = 0;
    fields.read(chunk.first, chunk.last, expanded, chunk.crc, compression);
    if (fields.whole() && compression != 0)
      refuse("is a chunk that is compressed, and those of recordings are not");
    fields.read(chunk.size);
    chunk.records = at_ + head_bytes + chunk_head;
    if (!fields.whole() || chunk.size > length_ - chunk_head || expanded != chunk.size) refuse("is no chunk");
    if (chunk.size > most_chunk) refuse("is a chunk that is too large");
    layout_.chunks.push_back(chunk);
  }

  void take_index() {
    Fields fields(start_);
    MessageIndex index{.offset = at_};
    std::uint32_t bytes = 0;
    fields.read(index.channel, bytes);
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

  /// Checks the file from the end of the data on; true if its end is complete.
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
      std::uint64_t begin = 0, offsets = 0;
      std::uint32_t crc = 0;
      Fields(start_).read(begin, offsets, crc);
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
  Message message;
  Fields(content).read(message.channel, message.sequence, message.time);
  return message;
}

/// Length of a message's record in a chunk with `rest` bytes left; 0 if it is not a message.
std::uint64_t message_length(std::string_view head, std::uint64_t rest) {
  std::uint8_t opcode = 0;
  std::uint64_t length = 0;
  Fields(head).read(opcode, length);
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

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

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

}  // namespace palpate::mcap
