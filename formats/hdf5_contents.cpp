#include "formats/hdf5_contents.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include "base/child_process.h"
#include "base/error.h"

#if __has_include(<H5FDdevelop.h>)
#include <H5FDdevelop.h>  // from HDF5 1.14 on
#endif

namespace palpate::hdf5 {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are taken from the file as they are");

constexpr const char* altered_hint = "Copy the file again, or precompute it again";
constexpr std::size_t longest_text = 4096;
constexpr hssize_t most_integers = 16;       // of an attribute
constexpr std::size_t most_dims = 4;         // that are reported
constexpr std::size_t most_things = 10'000;  // groups, datasets and attributes of a file
constexpr int deepest = 8;
constexpr std::chrono::seconds longest_look{5};  // of the processor: whole files take milliseconds
constexpr std::int64_t most_memory = std::int64_t{512} << 20;

// ---- a driver of the library for descriptors: the child may open nothing ----

/// What the library knows of an open file: it hands out the address of the first member.
struct Opened {
  H5FD_t base{};
  int fd = -1;
  haddr_t end = 0;        // of what is used
  haddr_t file_size = 0;  // [byte]
};

Opened& opened(H5FD_t* file) {
  return *reinterpret_cast<Opened*>(file);
}

const Opened& opened(const H5FD_t* file) {
  return *reinterpret_cast<const Opened*>(file);
}

/// `name` is the descriptor's number: the library hands on nothing else.
H5FD_t* open_number(const char* name, unsigned /*flags*/, hid_t /*access*/, haddr_t /*most*/) {
  auto file = std::make_unique<Opened>();
  file->fd = std::stoi(name);
  const off_t size = ::lseek(file->fd, 0, SEEK_END);
  if (size < 0) return nullptr;
  file->file_size = static_cast<haddr_t>(size);
  return &file.release()->base;
}

herr_t close_opened(H5FD_t* file) {
  delete &opened(file);
  return 0;
}

herr_t say_abilities(const H5FD_t* /*file*/, unsigned long* flags) {
  if (flags != nullptr) *flags = H5FD_FEAT_ACCUMULATE_METADATA_READ | H5FD_FEAT_DATA_SIEVE;
  return 0;
}

haddr_t end_of_use(const H5FD_t* file, H5FD_mem_t /*type*/) {
  return opened(file).end;
}

herr_t set_end_of_use(H5FD_t* file, H5FD_mem_t /*type*/, haddr_t end) {
  opened(file).end = end;
  return 0;
}

haddr_t end_of_file(const H5FD_t* file, H5FD_mem_t /*type*/) {
  return opened(file).file_size;
}

/// What lies behind the end is read as zeros, as the library's own drivers do.
herr_t read_bytes(H5FD_t* file, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t at, std::size_t size,
                  void* into) {
  auto* bytes = static_cast<char*>(into);
  while (size > 0) {
    const ssize_t done = ::pread(opened(file).fd, bytes, size, static_cast<off_t>(at));
    if (done < 0) return -1;
    if (done == 0) break;
    bytes += done;
    at += static_cast<haddr_t>(done);
    size -= static_cast<std::size_t>(done);
  }
  std::memset(bytes, 0, size);
  return 0;
}

/// The library wants one.
herr_t write_nothing(H5FD_t* /*file*/, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t /*at*/,
                     std::size_t /*size*/, const void* /*bytes*/) {
  return -1;
}

/// Stays registered: as a file closes, the library gives the driver up before it calls its `close`.
hid_t driver() {
  static const H5FD_class_t functions = [] {
    H5FD_class_t f{};
#ifdef H5FD_CLASS_VERSION
    f.version = H5FD_CLASS_VERSION;
    f.value = 512;  // the library's own are below
#endif
    f.name = "descriptor";
    f.maxaddr = static_cast<haddr_t>(std::numeric_limits<off_t>::max());
    f.fc_degree = H5F_CLOSE_STRONG;
    f.open = open_number;
    f.close = close_opened;
    f.query = say_abilities;
    f.get_eoa = end_of_use;
    f.set_eoa = set_end_of_use;
    f.get_eof = end_of_file;
    f.read = read_bytes;
    f.write = write_nothing;
    for (H5FD_mem_t& kind : f.fl_map) kind = H5FD_MEM_SUPER;  // no kinds of memory apart
    return f;
  }();
  static const hid_t registered = H5FDregister(&functions);
  return registered;
}

/// Opens a file for the library to read. Not valid where the library refuses it.
Id open_descriptor(const FileDescriptor& file) {
  const Id access = access_properties();
  H5Pset_driver(access.get(), driver(), nullptr);
  return {H5Fopen(std::to_string(file.get()).c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose};
}

// ---- what the child finds ----

/// What the library sees in a file.
class Walk {
 public:
  explicit Walk(const FileDescriptor& bytes) : where_(bytes.path().string()) {
    const Id file = open_descriptor(bytes);
    if (!file.valid()) refuse(reason());
    const Id root(H5Oopen(file.get(), "/", H5P_DEFAULT), H5Oclose);
    if (!root.valid()) refuse(reason());
    describe(root, "/", 0);
  }

  [[nodiscard]] Contents::Objects take() { return std::move(objects_); }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw Error("is not a readable HDF5 file: " + why, where_, altered_hint);
  }

  void count(std::size_t things) {
    things_ += things;
    if (things_ > most_things)
      refuse("it holds more than " + std::to_string(most_things) + " datasets and attributes");
  }

  void describe(const Id& object, const std::string& path, int depth) {
    count(1);
    Contents::Object& described = objects_[path];
    described.attributes = attributes_of(object);
    const H5I_type_t kind = H5Iget_type(object.get());
    if (kind == H5I_DATASET) describe_dataset(object, described);
    if (kind != H5I_GROUP || depth == deepest) return;
    for (const std::string& name : members_of(object)) {
      const std::string member = (path == "/" ? path : path + "/") + name;
      const Id opened(H5Oopen(object.get(), name.c_str(), H5P_DEFAULT), H5Oclose);
      if (opened.valid()) {
        describe(opened, member, depth + 1);
      } else {
        objects_[member].is_dataset = true;  // that is not readable
      }
    }
  }

  /// Names that the library lists, no more than there may be.
  struct Names {
    std::vector<std::string> names{};
    void add(const char* name) { names.emplace_back(name); }
    [[nodiscard]] bool full() const { return names.size() > most_things; }
  };

  std::vector<std::string> members_of(const Id& group) {
    Names found;
    const auto add = [](hid_t, const char* name, const H5L_info_t* link, void* names) -> herr_t {
      if (link->type == H5L_TYPE_HARD) static_cast<Names*>(names)->add(name);
      return static_cast<Names*>(names)->full() ? 1 : 0;
    };
    if (H5Literate(group.get(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add, &found) < 0) refuse(reason());
    count(found.names.size());
    return found.names;
  }

  std::map<std::string, Contents::Attribute> attributes_of(const Id& object) {
    Names found;
    const auto add = [](hid_t, const char* name, const H5A_info_t*, void* names) -> herr_t {
      static_cast<Names*>(names)->add(name);
      return static_cast<Names*>(names)->full() ? 1 : 0;
    };
    if (H5Aiterate2(object.get(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add, &found) < 0) refuse(reason());
    count(found.names.size());
    std::map<std::string, Contents::Attribute> attributes;
    for (const std::string& name : found.names) {
      const Id opened(H5Aopen(object.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      if (auto value = value_of(opened)) attributes.emplace(name, std::move(*value));
    }
    return attributes;
  }

  static std::optional<Contents::Attribute> value_of(const Id& attribute) {
    const Id type(H5Aget_type(attribute.get()), H5Tclose);
    const Id space(H5Aget_space(attribute.get()), H5Sclose);
    const hssize_t entries = H5Sget_simple_extent_npoints(space.get());
    const H5T_class_t kind = H5Tget_class(type.get());
    if (kind == H5T_STRING && H5Tis_variable_str(type.get()) == 0 && entries == 1 &&
        H5Tget_size(type.get()) <= longest_text) {
      std::string text(H5Tget_size(type.get()), '\0');
      if (H5Aread(attribute.get(), type.get(), text.data()) < 0) return {};
      return text.substr(0, text.find('\0'));
    }
    if (kind == H5T_INTEGER && entries > 0 && entries <= most_integers &&
        H5Tget_size(type.get()) <= sizeof(std::int64_t)) {
      std::vector<std::int64_t> values(static_cast<std::size_t>(entries));
      if (H5Aread(attribute.get(), H5T_NATIVE_INT64, values.data()) < 0) return {};
      return values;
    }
    return {};
  }

  static std::string type_name(hid_t type) {
    const std::array known = {element_type<std::uint8_t>(), element_type<std::uint32_t>(),
                              element_type<std::int32_t>(), element_type<std::int64_t>(),
                              element_type<float>(),        element_type<double>()};
    for (const ElementType& candidate : known)
      if (H5Tequal(type, candidate.id) > 0) return candidate.name;
    return "another type";
  }

  void describe_dataset(const Id& dataset, Contents::Object& described) {
    described.is_dataset = true;
    const Id type(H5Dget_type(dataset.get()), H5Tclose);
    const Id space(H5Dget_space(dataset.get()), H5Sclose);
    const Id creation(H5Dget_create_plist(dataset.get()), H5Pclose);
    if (!type.valid() || !space.valid() || !creation.valid()) return;
    described.type = type_name(type.get());

    std::array<hsize_t, H5S_MAX_RANK> sizes = {};
    const int rank = H5Sget_simple_extent_type(space.get()) == H5S_SIMPLE
                         ? H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr)
                         : H5Sget_simple_extent_ndims(space.get());
    if (rank < 0) return;
    described.rank = rank;
    described.dims.assign(sizes.begin(), sizes.begin() + std::min<std::ptrdiff_t>(rank, most_dims));

    const H5D_layout_t layout = H5Pget_layout(creation.get());
    const haddr_t offset = layout == H5D_CONTIGUOUS ? H5Dget_offset(dataset.get()) : HADDR_UNDEF;
    described.offset = offset == HADDR_UNDEF ? std::numeric_limits<std::uint64_t>::max() : offset;
    described.is_in_one_piece = layout == H5D_CONTIGUOUS && H5Pget_external_count(creation.get()) == 0;
    described.is_readable = true;
  }

  std::string where_;
  Contents::Objects objects_;
  std::size_t things_ = 0;
};

// ---- the way from the child ----

void pack(Bytes& bytes, std::uint64_t number) {
  append_bytes(bytes, std::span<const std::uint64_t>(&number, 1));
}

void pack(Bytes& bytes, const std::string& text) {
  append_array(bytes, std::span<const char>(text));
}

void pack(Bytes& bytes, const Contents::Object& object) {
  pack(bytes, object.attributes.size());
  for (const auto& [name, value] : object.attributes) {
    pack(bytes, name);
    pack(bytes, value.index());
    if (const auto* text = std::get_if<std::string>(&value)) {
      pack(bytes, *text);
    } else {
      append_array(bytes, std::span(std::get<std::vector<std::int64_t>>(value)));
    }
  }
  pack(bytes, std::uint64_t{object.is_dataset});
  pack(bytes, std::uint64_t{object.is_readable});
  pack(bytes, std::uint64_t{object.is_in_one_piece});
  pack(bytes, object.type);
  pack(bytes, static_cast<std::uint64_t>(object.rank));
  append_array(bytes, std::span(object.dims));
  pack(bytes, object.offset);
}

/// Believes nothing: a child in which the library went wrong may have sent anything. Throws Error.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> bytes) : rest_(bytes) {}

  Contents::Objects objects() {
    Contents::Objects objects;
    for (std::uint64_t left = number(); left > 0; --left) {
      std::string path = text();
      objects.emplace(std::move(path), object());
    }
    return objects;
  }

 private:
  std::uint64_t number() {
    std::uint64_t value = 0;
    if (rest_.size() < sizeof value) fail_on_answer();
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_ = rest_.subspan(sizeof value);
    return value;
  }
  std::string text() {
    const std::vector<char> text = take_array<char>(rest_);
    return {text.begin(), text.end()};
  }
  Contents::Object object() {
    Contents::Object object;
    for (std::uint64_t left = number(); left > 0; --left) {
      std::string name = text();
      Contents::Attribute value;
      if (number() == 0) {
        value = text();
      } else {
        value = take_array<std::int64_t>(rest_);
      }
      object.attributes.emplace(std::move(name), std::move(value));
    }
    object.is_dataset = number() != 0;
    object.is_readable = number() != 0;
    object.is_in_one_piece = number() != 0;
    object.type = text();
    object.rank = static_cast<std::int64_t>(number());
    object.dims = take_array<std::uint64_t>(rest_);
    object.offset = number();
    return object;
  }

  std::span<const std::byte> rest_;
};

/// The child's work.
ChildResult look_at(const FileDescriptor& file) {
  const Quiet quiet;
  H5PLset_loading_state(0);  // no code from elsewhere, whatever filter a file asks for
  ChildResult result;
  const Contents::Objects objects = Walk(file).take();
  pack(result.bytes, objects.size());
  for (const auto& [path, object] : objects) {
    pack(result.bytes, path);
    pack(result.bytes, object);
  }
  return result;
}

std::string text_of(std::span<const std::int64_t> dims) {
  std::string text;
  for (const std::int64_t dim : dims) text.append(text.empty() ? "" : " x ").append(std::to_string(dim));
  return text.empty() ? "a scalar" : text;
}

}  // namespace

Contents Contents::read(FileDescriptor file) {
  const ChildTask task = {.name = "the file's HDF5 structure is damaged: the HDF5 library",
                          .where = file.path().string(),
                          .limits = child_limits(longest_look, most_memory),
                          .hint = altered_hint,
                          .files = {file.get()},
                          .stop_at_signals = false};
  const ChildResult result = run_in_child(task, [&] { return look_at(file); });
  Objects objects = Unpacker(result.bytes).objects();
  return {std::move(file), std::move(objects)};
}

const Contents::Object& Contents::dataset(const std::string& path) const {
  const auto found = objects_.find(path);
  if (found == objects_.end()) throw Error(path + " is missing", this->path().string(), altered_hint);
  if (!found->second.is_readable)
    throw Error(path + " is not a readable dataset", this->path().string(), altered_hint);
  return found->second;
}

/// Its dimensions, and the bytes of all its numbers.
Stored Contents::shape(const std::string& path, const ElementType& type, std::size_t rank) const {
  const auto refuse = [&](const std::string& what) {
    throw Error(path + " " + what, this->path().string(), altered_hint);
  };
  const Object& found = dataset(path);
  if (found.type != type.name) refuse("holds " + found.type + ", " + type.name + " is expected");
  if (found.rank != static_cast<std::int64_t>(rank))
    refuse("has " + std::to_string(found.rank) + " dimensions, " + std::to_string(rank) + " are expected");
  if (found.dims.size() != rank) refuse("has no shape");

  Stored stored;
  stored.bytes = static_cast<std::int64_t>(type.bytes);
  for (const std::uint64_t dim : found.dims) {
    stored.dims.push_back(static_cast<std::int64_t>(dim));
    if (dim > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) ||
        __builtin_mul_overflow(stored.bytes, stored.dims.back(), &stored.bytes))
      refuse("has impossible sizes: " + text_of(stored.dims));
  }
  return stored;
}

/// With its offset, where all of its bytes are in the file.
Stored Contents::inside(const std::string& path, Stored stored, const Object& found) const {
  if (stored.bytes == 0) return stored;
  const auto file_bytes = static_cast<std::uint64_t>(file_size(file_));
  if (found.offset > file_bytes || static_cast<std::uint64_t>(stored.bytes) > file_bytes - found.offset)
    throw Error(path + " (" + text_of(stored.dims) + ") needs " + std::to_string(stored.bytes) +
                    " bytes, more than the file holds (" + std::to_string(file_bytes) +
                    "): the file is truncated",
                this->path().string(), altered_hint);
  stored.offset = static_cast<std::int64_t>(found.offset);
  return stored;
}

Stored Contents::locate(const std::string& path, const ElementType& type, std::size_t rank) const {
  const Object& found = dataset(path);
  Stored stored = shape(path, type, rank);
  if (!found.is_in_one_piece)
    throw Error(path + " is not stored in one piece", this->path().string(), altered_hint);
  return inside(path, std::move(stored), found);
}

void Contents::read_rows(const std::string& path, const ElementType& type, std::int64_t first,
                         std::int64_t rows, void* data) const {
  const Stored stored = locate(path, type, dataset(path).dims.size());
  if (rows == 0) return;
  if (stored.dims.empty() || first < 0 || rows < 0 || first > stored.dims[0] || rows > stored.dims[0] - first)
    throw Error(path + " has not so many rows", this->path().string(), altered_hint);
  auto row_bytes = static_cast<std::int64_t>(type.bytes);
  for (std::size_t k = 1; k < stored.dims.size(); ++k) row_bytes *= stored.dims[k];
  auto* into = static_cast<std::byte*>(data);
  read_exactly(file_, {into, static_cast<std::size_t>(rows * row_bytes)}, stored.offset + first * row_bytes);
}

const Contents::Attribute* Contents::attribute(const std::string& object, const std::string& name) const {
  const auto holder = objects_.find(object);
  if (holder == objects_.end()) return nullptr;
  const auto found = holder->second.attributes.find(name);
  return found == holder->second.attributes.end() ? nullptr : &found->second;
}

std::optional<std::string> Contents::text_attribute(const std::string& object,
                                                    const std::string& name) const {
  const Attribute* found = attribute(object, name);
  const auto* text = found != nullptr ? std::get_if<std::string>(found) : nullptr;
  return text != nullptr ? std::optional(*text) : std::nullopt;
}

std::optional<std::vector<std::int64_t>> Contents::integer_attribute(const std::string& object,
                                                                     const std::string& name,
                                                                     std::size_t count) const {
  const Attribute* found = attribute(object, name);
  const auto* values = found != nullptr ? std::get_if<std::vector<std::int64_t>>(found) : nullptr;
  return values != nullptr && values->size() == count ? std::optional(*values) : std::nullopt;
}

}  // namespace palpate::hdf5
