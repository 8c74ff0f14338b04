#include "formats/contents.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "formats/checksum.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are taken from the file as they are");

constexpr std::string_view hdf5_magic = "\x89HDF\r\n\x1a\n";
constexpr const char* copy_again = "Copy the file again, or precompute it again";
constexpr const char* give_ours = "Give a NAME.palpate.hdf that palpate-precompute has written";
constexpr std::uint64_t index_version = 1;
constexpr std::size_t checksum_digits = 32;
// Magic, version, length and checksum; the checksum covers all that follows.
constexpr std::size_t head_bytes = 8 + 8 + 8 + checksum_digits;

// ---- the index's bytes ----

void put(std::vector<std::byte>& bytes, std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

void put(std::vector<std::byte>& bytes, std::uint64_t number) {
  put(bytes, std::as_bytes(std::span(&number, 1)));
}

void put(std::vector<std::byte>& bytes, std::string_view text) {
  put(bytes, text.size());
  put(bytes, std::as_bytes(std::span(text)));
}

template <class T>
void put(std::vector<std::byte>& bytes, const std::vector<T>& numbers) {
  put(bytes, numbers.size());
  put(bytes, std::as_bytes(std::span(numbers)));
}

void put(std::vector<std::byte>& bytes, const FileObject& object) {
  put(bytes, std::string_view(object.type));
  put(bytes, object.dims);
  put(bytes, object.offset);
  put(bytes, object.bytes);
  put(bytes, object.attributes.size());
  for (const auto& [name, value] : object.attributes) {
    put(bytes, std::string_view(name));
    put(bytes, value.index());
    if (const auto* text = std::get_if<std::string>(&value)) {
      put(bytes, std::string_view(*text));
    } else {
      put(bytes, std::get<std::vector<std::int64_t>>(value));
    }
  }
}

/// Reader of numbers and texts from the front of untrusted bytes.
class IndexBytes {
 public:
  IndexBytes(std::span<const std::byte> bytes, const std::string& where) : rest_(bytes), where_(where) {}

  [[nodiscard]] bool empty() const noexcept { return rest_.empty(); }

  std::uint64_t number() {
    std::uint64_t value = 0;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  std::string text() {
    const std::span<const std::byte> bytes = take(number());
    std::string text(bytes.size(), '\0');
    std::ranges::transform(bytes, text.begin(), [](std::byte b) { return static_cast<char>(b); });
    return text;
  }
  template <class T>
  std::vector<T> numbers() {
    const std::uint64_t count = number();
    if (count > rest_.size() / sizeof(T)) refuse();
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), take(count * sizeof(T)).data(), count * sizeof(T));
    return values;
  }
  /// Reads a map of ascending names or paths, whose values `value` reads.
  template <class Value>
  auto by_name(Value&& value) {
    std::map<std::string, decltype(value())> values;
    for (std::uint64_t left = number(); left > 0; --left) {
      std::string name = text();
      if (!values.empty() && name <= values.rbegin()->first) refuse();
      values.emplace_hint(values.end(), std::move(name), value());
    }
    return values;
  }
  FileAttribute attribute() {
    switch (number()) {
      case 0:
        return text();
      case 1:
        return numbers<std::int64_t>();
      default:
        refuse();
    }
  }
  FileObject object() {
    FileObject object;
    object.type = text();
    object.dims = numbers<std::uint64_t>();
    object.offset = number();
    object.bytes = number();
    object.attributes = by_name([this] { return attribute(); });
    return object;
  }

  [[noreturn]] void refuse() const { throw Error("its index is damaged", where_, copy_again); }

 private:
  std::span<const std::byte> take(std::uint64_t count) {
    if (count > rest_.size()) refuse();
    const std::span<const std::byte> taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }

  std::span<const std::byte> rest_;
  const std::string& where_;
};

/// True if `bytes` begin with `magic`, as far as both go.
bool begins_with(std::span<const std::byte> bytes, std::string_view magic) {
  return std::memcmp(bytes.data(), magic.data(), std::min(bytes.size(), magic.size())) == 0;
}

[[noreturn]] void say_truncated(std::uint64_t bytes, std::uint64_t whole, const std::string& where) {
  throw Error(
      "the file is truncated: it has " + std::to_string(bytes) + " of " + std::to_string(whole) + " bytes",
      where, copy_again);
}

/// The bytes under the checksum, after checking it and everything before it.
std::span<const std::byte> checked(std::span<const std::byte> index, const std::string& where) {
  if (index.empty()) throw Error("the file is empty", where, copy_again);
  if (begins_with(index, hdf5_magic) && !begins_with(index, index_magic))
    throw Error("is an HDF5 file, but not a Palpate file with an index", where,
                "If it is a model, palpate-precompute index " + shell_word(where) + " adds the index");
  if (!begins_with(index, index_magic)) throw Error("is not a Palpate file", where, give_ours);
  if (index.size() < static_cast<std::size_t>(index_bytes)) say_truncated(index.size(), index_bytes, where);
  IndexBytes head(index.subspan(index_magic.size()), where);
  if (const std::uint64_t version = head.number(); version != index_version) {
    throw Error("its index has version " + std::to_string(version) + ", this program reads version " +
                    std::to_string(index_version),
                where, "Precompute it again with this program's palpate-precompute");
  }
  const std::uint64_t length = head.number();
  if (length < head_bytes || length > index.size()) head.refuse();
  const std::span<const std::byte> content = index.first(length).subspan(head_bytes);
  const std::string digits = checksum(content);
  if (std::memcmp(index.data() + head_bytes - checksum_digits, digits.data(), checksum_digits) != 0)
    throw Error("its index was altered: its checksum is not " + digits, where, copy_again);
  return content;
}

// ---- contents of the index ----

std::string text_of(std::span<const std::uint64_t> dims) {
  std::string text;
  for (const std::uint64_t dim : dims) text.append(text.empty() ? "" : " x ").append(std::to_string(dim));
  return text.empty() ? "a scalar" : text;
}

/// Size of an array [byte]; nullopt if it overflows.
std::optional<std::uint64_t> bytes_of(const NumberType& type, std::span<const std::uint64_t> dims) {
  auto bytes = static_cast<std::int64_t>(type.bytes);
  for (const std::uint64_t dim : dims) {
    if (dim > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) ||
        __builtin_mul_overflow(bytes, static_cast<std::int64_t>(dim), &bytes))
      return std::nullopt;
  }
  return static_cast<std::uint64_t>(bytes);
}

/// Checks that an object's bytes fit its type and dimensions, and lie in the file behind the index.
void check_object(const std::string& path, const FileObject& object, std::uint64_t file_bytes,
                  const IndexBytes& index, const std::string& where) {
  const auto type = std::ranges::find(number_types, object.type, &NumberType::name);
  const bool is_group = object.type.empty();
  if (type != number_types.end()) {
    const std::optional<std::uint64_t> bytes = bytes_of(*type, object.dims);
    if (!bytes) throw Error(path + " has impossible sizes: " + text_of(object.dims), where, copy_again);
    if (object.bytes != 0 && object.bytes != *bytes) index.refuse();
  } else if (!is_group && object.type != other_type) {
    index.refuse();
  }
  if (is_group && !(object.dims.empty() && object.bytes == 0)) index.refuse();
  if (object.bytes == 0) {
    if (object.offset != 0) index.refuse();
    return;
  }
  if (object.offset > file_bytes || object.bytes > file_bytes - object.offset) {
    throw Error(path + " (" + text_of(object.dims) + ") needs " + std::to_string(object.bytes) +
                    " bytes, more than the file holds (" + std::to_string(file_bytes) +
                    "): the file is truncated",
                where, copy_again);
  }
  if (object.offset < static_cast<std::uint64_t>(index_bytes))
    throw Error(path + " lies on the file's index", where, copy_again);
}

/// Checks that no two objects share bytes.
void check_places(const FileObjects& objects, const std::string& where) {
  std::vector<const FileObjects::value_type*> placed;
  for (const auto& object : objects)
    if (object.second.bytes > 0) placed.push_back(&object);
  std::ranges::sort(placed, {}, [](const auto* object) { return object->second.offset; });
  for (std::size_t k = 1; k < placed.size(); ++k)
    if (placed[k]->second.offset - placed[k - 1]->second.offset < placed[k - 1]->second.bytes)
      throw Error(placed[k]->first + " lies on " + placed[k - 1]->first, where, copy_again);
}

}  // namespace

std::vector<std::byte> make_index(const FileObjects& objects, std::uint64_t file_bytes,
                                  const std::string& where) {
  std::vector<std::byte> content;
  put(content, file_bytes);
  put(content, objects.size());
  for (const auto& [path, object] : objects) {
    put(content, std::string_view(path));
    put(content, object);
  }
  const std::size_t length = head_bytes + content.size();
  if (length > static_cast<std::size_t>(index_bytes)) {
    throw Error("its index would take " + std::to_string(length) + " bytes, " + std::to_string(index_bytes) +
                    " are there",
                where, "Leave out what is not needed, or shorten its texts");
  }
  const std::string digits = checksum(std::span<const std::byte>(content));
  std::vector<std::byte> index;
  put(index, std::as_bytes(std::span(index_magic)));
  put(index, index_version);
  put(index, length);
  put(index, std::as_bytes(std::span(digits)));
  put(index, std::span<const std::byte>(content));
  index.resize(static_cast<std::size_t>(index_bytes));
  return index;
}

Contents Contents::read(FileDescriptor file) {
  std::vector<std::byte> index(static_cast<std::size_t>(index_bytes));
  std::size_t got = 0;
  while (const std::size_t more =
             read_some(file, std::span(index).subspan(got), static_cast<std::int64_t>(got)))
    got += more;
  return of(std::move(file), std::span(index).first(got));
}

Contents Contents::of(FileDescriptor file, std::span<const std::byte> index) {
  const std::string where = file.path().string();
  IndexBytes bytes(checked(index, where), where);
  const std::uint64_t whole = bytes.number();
  const auto there = static_cast<std::uint64_t>(file_size(file));
  if (there < whole) say_truncated(there, whole, where);
  FileObjects objects = bytes.by_name([&] { return bytes.object(); });
  if (!bytes.empty()) bytes.refuse();
  for (const auto& [path, object] : objects) check_object(path, object, whole, bytes, where);
  check_places(objects, where);
  return {std::move(file), std::move(objects)};
}

Stored Contents::locate(const std::string& dataset, const NumberType& type, std::size_t rank) const {
  const auto refuse = [&](const std::string& what) {
    throw Error(dataset + " " + what, path().string(), copy_again);
  };
  const auto found = objects_.find(dataset);
  if (found == objects_.end()) refuse("is missing");
  const FileObject& object = found->second;
  if (object.type.empty()) refuse("is a group, and not a dataset");
  if (object.type != type.name)
    refuse("holds " + object.type + ", " + std::string(type.name) + " is expected");
  if (object.dims.size() != rank)
    refuse("has " + std::to_string(object.dims.size()) + " dimensions, " + std::to_string(rank) +
           " are expected");
  if (object.bytes == 0 && bytes_of(type, object.dims) != 0U) refuse("is not stored in one piece");
  return {{object.dims.begin(), object.dims.end()},
          static_cast<std::int64_t>(object.offset),
          static_cast<std::int64_t>(object.bytes)};
}

const FileAttribute* Contents::attribute(const std::string& object, const std::string& name) const {
  const auto holder = objects_.find(object);
  if (holder == objects_.end()) return nullptr;
  const auto found = holder->second.attributes.find(name);
  return found == holder->second.attributes.end() ? nullptr : &found->second;
}

std::optional<std::string> Contents::text_attribute(const std::string& object,
                                                    const std::string& name) const {
  const FileAttribute* found = attribute(object, name);
  const auto* text = found != nullptr ? std::get_if<std::string>(found) : nullptr;
  return text != nullptr ? std::optional(*text) : std::nullopt;
}

std::optional<std::vector<std::int64_t>> Contents::integer_attribute(const std::string& object,
                                                                     const std::string& name,
                                                                     std::size_t count) const {
  const FileAttribute* found = attribute(object, name);
  const auto* values = found != nullptr ? std::get_if<std::vector<std::int64_t>>(found) : nullptr;
  return values != nullptr && values->size() == count ? std::optional(*values) : std::nullopt;
}

}  // namespace palpate
