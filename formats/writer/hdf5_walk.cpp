#include "formats/writer/hdf5_walk.h"

#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/child_process.h"
#include "base/error.h"
#include "formats/contents.h"
#include "formats/writer/hdf5.h"

#if __has_include(<H5FDdevelop.h>)
#include <H5FDdevelop.h>  // from HDF5 1.14 on
#endif

namespace palpate::hdf5 {
namespace {

constexpr const char* altered_hint = "Copy the file again, or precompute it again";
constexpr std::size_t longest_text = 4096;
constexpr hssize_t most_integers = 16;       // of an attribute
constexpr std::size_t most_things = 10'000;  // groups, datasets and attributes of a file
constexpr int deepest = 8;
constexpr std::chrono::seconds longest_look{5};  // of the processor: whole files take milliseconds
constexpr std::int64_t most_memory = std::int64_t{512} << 20;

// ---- a driver of the library for descriptors: the child may open nothing ----

/// The library's handle of an open file, which it uses by the address of the first member.
struct Opened {
  H5FD_t base{};
  int fd = -1;
  haddr_t end = 0;        // end of the used bytes
  haddr_t file_size = 0;  // [byte]
};

Opened& opened(H5FD_t* file) {
  return *reinterpret_cast<Opened*>(file);
}

const Opened& opened(const H5FD_t* file) {
  return *reinterpret_cast<const Opened*>(file);
}

/// Opens the descriptor whose number is `name`: the library passes nothing else on.
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

/// Reads bytes; those beyond the end are zeros, as in the library's own drivers.
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

/// Does nothing; the library requires the function.
herr_t write_nothing(H5FD_t* /*file*/, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t /*at*/,
                     std::size_t /*size*/, const void* /*bytes*/) {
  return -1;
}

/// Identifier of the driver. It stays registered: when a file closes, the library releases the driver before
/// calling its `close`.
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

/// Opens a file for the library to read. The result is invalid if the library refuses it.
Id open_descriptor(const FileDescriptor& file) {
  const Id access = access_properties();
  H5Pset_driver(access.get(), driver(), nullptr);
  return {H5Fopen(std::to_string(file.get()).c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose};
}

// ---- objects in the file ----

/// Walk over groups, datasets and attributes, except behind links.
class Walk {
 public:
  explicit Walk(const FileDescriptor& bytes) : where_(bytes.path().string()) {
    const Id file = open_descriptor(bytes);
    if (!file.valid()) refuse(reason());
    const Id root(H5Oopen(file.get(), "/", H5P_DEFAULT), H5Oclose);
    if (!root.valid()) refuse(reason());
    describe(root, "/", 0);
  }

  [[nodiscard]] FileObjects take() { return std::move(objects_); }

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
    FileObject& described = objects_[path];
    described.attributes = attributes_of(object);
    const H5I_type_t kind = H5Iget_type(object.get());
    if (kind == H5I_DATASET) describe_dataset(object, described);
    if (kind != H5I_GROUP || depth == deepest) return;
    for (const std::string& name : members_of(object)) {
      std::string member = path;
      if (path != "/") member += '/';
      member += name;
      const Id opened(H5Oopen(object.get(), name.c_str(), H5P_DEFAULT), H5Oclose);
      if (opened.valid()) {
        describe(opened, member, depth + 1);
      } else {
        objects_[member].type = other_type;  // not readable by us
      }
    }
  }

  /// Names that the library lists, up to a limit.
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

  std::map<std::string, FileAttribute> attributes_of(const Id& object) {
    Names found;
    const auto add = [](hid_t, const char* name, const H5A_info_t*, void* names) -> herr_t {
      static_cast<Names*>(names)->add(name);
      return static_cast<Names*>(names)->full() ? 1 : 0;
    };
    if (H5Aiterate2(object.get(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, add, &found) < 0) refuse(reason());
    count(found.names.size());
    std::map<std::string, FileAttribute> attributes;
    for (const std::string& name : found.names) {
      const Id opened(H5Aopen(object.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      if (auto value = value_of(opened)) attributes.emplace(name, std::move(*value));
    }
    return attributes;
  }

  static std::optional<FileAttribute> value_of(const Id& attribute) {
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

  static std::string_view type_name(hid_t type) {
    for (const NumberType& known : number_types)
      if (H5Tequal(type, type_of(known.name)) > 0) return known.name;
    return other_type;
  }

  static void describe_dataset(const Id& dataset, FileObject& described) {
    described.type = other_type;
    const Id type(H5Dget_type(dataset.get()), H5Tclose);
    const Id space(H5Dget_space(dataset.get()), H5Sclose);
    const Id creation(H5Dget_create_plist(dataset.get()), H5Pclose);
    if (!type.valid() || !space.valid() || !creation.valid()) return;
    std::array<hsize_t, H5S_MAX_RANK> sizes = {};
    const int rank = H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr);
    const hssize_t entries = H5Sget_simple_extent_npoints(space.get());
    if (rank < 0 || entries < 0 || H5Sget_simple_extent_type(space.get()) == H5S_NULL) return;
    described.type = type_name(type.get());
    described.dims.assign(sizes.begin(), sizes.begin() + rank);
    if (H5Pget_layout(creation.get()) != H5D_CONTIGUOUS || H5Pget_external_count(creation.get()) != 0) return;
    described.bytes = static_cast<std::uint64_t>(entries) * H5Tget_size(type.get());
    if (described.bytes > 0) described.offset = H5Dget_offset(dataset.get());
  }

  std::string where_;
  FileObjects objects_;
  std::size_t things_ = 0;
};

std::vector<std::byte> walked_index(const FileDescriptor& file, std::int64_t file_bytes) {
  const Quiet quiet;
  return make_index(Walk(file).take(), static_cast<std::uint64_t>(file_bytes), file.path().string());
}

}  // namespace

std::vector<std::byte> index_of_own(const FileDescriptor& file) {
  return walked_index(file, file_size(file));
}

std::vector<std::byte> index_of(const FileDescriptor& file) {
  const ChildTask task = {.name = "the file's HDF5 structure is damaged: the HDF5 library",
                          .where = file.path().string(),
                          .limits = child_limits(longest_look, most_memory),
                          .hint = altered_hint,
                          .files = {file.get()},
                          .stop_at_signals = false};
  const auto look = [&, file_bytes = file_size(file)] {
    H5PLset_loading_state(0);  // load no filter plugins, whatever a file asks for
    return ChildResult{0, walked_index(file, file_bytes)};
  };
  return run_in_child(task, look).bytes;
}

}  // namespace palpate::hdf5
