#include "tests/support/files/formats_tamper.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "base/file_io.h"
#include "formats/checksum.h"
#include "formats/writer/hdf5.h"
#include "formats/writer/hdf5_walk.h"

namespace palpate::test {
namespace {

using hdf5::Id;

constexpr double most_entries = 1e6;  // larger datasets only claim their size

Id open(const std::filesystem::path& path, unsigned mode = H5F_ACC_RDWR) {
  const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  Id file(H5Fopen(path.c_str(), mode, access.get()), H5Fclose);
  if (!file.valid()) throw std::runtime_error("cannot tamper with " + path.string());
  return file;
}

/// Changes a file, and then its index.
void edit(const std::filesystem::path& path, const std::function<void(hid_t)>& change) {
  {
    const Id file = open(path);
    change(file.get());
  }
  const FileDescriptor changed = open_file(path, OpenMode::write);
  write_exactly(changed, hdf5::index_of_own(changed), 0);
}

bool has(hid_t file, const std::string& object) {
  for (std::size_t end = object.find('/', 1); end != std::string::npos; end = object.find('/', end + 1))
    if (H5Lexists(file, object.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(file, object.c_str(), H5P_DEFAULT) > 0;
}

void put_text(hid_t object, const std::string& name, const std::string& text) {
  if (H5Aexists(object, name.c_str()) > 0) H5Adelete(object, name.c_str());
  const Id type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), std::max<std::size_t>(text.size(), 1));
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  const Id space(H5Screate(H5S_SCALAR), H5Sclose);
  const Id made(H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                H5Aclose);
  H5Awrite(made.get(), type.get(), text.c_str());
}

std::string attribute_text(hid_t attribute) {
  const Id type(H5Aget_type(attribute), H5Tclose);
  const Id space(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type.get()) == H5T_STRING) {
    std::string text(H5Tget_size(type.get()), '\0');
    H5Aread(attribute, type.get(), text.data());
    return text.c_str();
  }
  std::vector<std::int64_t> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())));
  H5Aread(attribute, H5T_NATIVE_INT64, values.data());
  std::string text;
  for (const std::int64_t value : values) text.append(text.empty() ? "" : " ").append(std::to_string(value));
  return text;
}

/// docs/file-format.md, "Checksums", for arrays of one chunk.
std::string dataset_checksum(hid_t dataset) {
  std::vector<std::byte> bytes;
  const Id type(H5Dget_type(dataset), H5Tclose);
  const Id space(H5Dget_space(dataset), H5Sclose);
  const hssize_t entries = H5Sget_simple_extent_npoints(space.get());
  if (H5Dget_storage_size(dataset) > 0 && static_cast<double>(entries) <= most_entries) {
    bytes.resize(H5Tget_size(type.get()) * static_cast<std::size_t>(entries));
    H5Dread(dataset, type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data());
  }
  return checksum(bytes);
}

herr_t collect(hid_t, const char* name, const H5O_info_t* info, void* data) {
  if (info->type == H5O_TYPE_DATASET)
    static_cast<std::vector<std::string>*>(data)->push_back('/' + std::string(name));
  return 0;
}

std::vector<std::string> datasets_of(hid_t file) {
  std::vector<std::string> names;
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, collect, &names, H5O_INFO_BASIC);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

std::vector<std::string> checked_datasets(const std::filesystem::path& path) {
  const Id file = open(path, H5F_ACC_RDONLY);
  return datasets_of(file.get());
}

bool set_bytes(const std::filesystem::path& path, const std::string& dataset, std::uint64_t at,
               const void* bytes, std::size_t count) {
  haddr_t offset = HADDR_UNDEF;
  hsize_t size = 0;
  {
    const Id file = open(path, H5F_ACC_RDONLY);
    if (!has(file.get(), dataset)) return false;
    const Id opened(H5Dopen2(file.get(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
    offset = H5Dget_offset(opened.get());
    size = H5Dget_storage_size(opened.get());
  }
  if (offset == HADDR_UNDEF || at >= size) return false;
  const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  const std::size_t fitting = std::min<std::size_t>(count, size - at);
  const ssize_t put = ::pwrite(fd, bytes, fitting, static_cast<off_t>(offset + at));
  ::close(fd);
  return put == static_cast<ssize_t>(fitting);
}

void replace(const std::filesystem::path& path, const std::string& dataset, hid_t type,
             const std::vector<hsize_t>& dims, const void* bytes, bool chunked) {
  edit(path, [&](hid_t file) {
    if (has(file, dataset)) H5Ldelete(file, dataset.c_str(), H5P_DEFAULT);
    const Id space(dims.empty() ? H5Screate(H5S_SCALAR)
                                : H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr),
                   H5Sclose);
    const Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    double entries = 1;
    for (const hsize_t dim : dims) entries *= static_cast<double>(dim);
    H5Pset_alloc_time(creation.get(), entries > most_entries ? H5D_ALLOC_TIME_LATE : H5D_ALLOC_TIME_EARLY);
    if (chunked) H5Pset_chunk(creation.get(), static_cast<int>(dims.size()), dims.data());
    const Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links.get(), 1);
    const Id made(
        H5Dcreate2(file, dataset.c_str(), type, space.get(), links.get(), creation.get(), H5P_DEFAULT),
        H5Dclose);
    if (!made.valid()) throw std::runtime_error("cannot replace " + dataset);
    if (bytes != nullptr) H5Dwrite(made.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes);
    put_text(made.get(), "xxh3", "");
  });
}

void remove_object(const std::filesystem::path& path, const std::string& object) {
  edit(path, [&](hid_t file) {
    if (has(file, object)) H5Ldelete(file, object.c_str(), H5P_DEFAULT);
  });
}

void replace_by_soft_link(const std::filesystem::path& path, const std::string& object,
                          const std::string& target) {
  remove_object(path, object);
  edit(path,
       [&](hid_t file) { H5Lcreate_soft(target.c_str(), file, object.c_str(), H5P_DEFAULT, H5P_DEFAULT); });
}

void set_text(const std::filesystem::path& path, const std::string& attribute, const std::string& text) {
  edit(path, [&](hid_t file) { put_text(file, attribute, text); });
}

void set_integers(const std::filesystem::path& path, const std::string& attribute,
                  const std::vector<std::int64_t>& values) {
  edit(path, [&](hid_t file) {
    if (H5Aexists(file, attribute.c_str()) > 0) H5Adelete(file, attribute.c_str());
    const hsize_t count = values.size();
    const Id space(H5Screate_simple(1, &count, nullptr), H5Sclose);
    const Id made(H5Acreate2(file, attribute.c_str(), H5T_STD_I64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                  H5Aclose);
    H5Awrite(made.get(), H5T_NATIVE_INT64, values.data());
  });
}

void remove_attribute(const std::filesystem::path& path, const std::string& object,
                      const std::string& attribute) {
  edit(path, [&](hid_t file) { H5Adelete_by_name(file, object.c_str(), attribute.c_str(), H5P_DEFAULT); });
}

void reseal(const std::filesystem::path& path) {
  edit(path, [](hid_t file) {
    std::vector<std::string> lines;
    for (const std::string& name : datasets_of(file)) {
      const Id dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
      if (H5Aexists(dataset.get(), "xxh3") <= 0) continue;
      const std::string digits = dataset_checksum(dataset.get());
      put_text(dataset.get(), "xxh3", digits);
      lines.push_back(std::string("dataset ").append(name).append(" ").append(digits).append("\n"));
    }
    const Id root(H5Gopen2(file, "/", H5P_DEFAULT), H5Gclose);
    H5O_info_t info = {};
    H5Oget_info2(root.get(), &info, H5O_INFO_NUM_ATTRS);
    for (hsize_t i = 0; i < info.num_attrs; ++i) {
      const Id attribute(
          H5Aopen_by_idx(root.get(), ".", H5_INDEX_NAME, H5_ITER_INC, i, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
      std::string name(200, '\0');
      name.resize(static_cast<std::size_t>(H5Aget_name(attribute.get(), name.size(), name.data())));
      if (name != "content_hash") {
        lines.push_back(std::string("attribute ")
                            .append(name)
                            .append(" ")
                            .append(attribute_text(attribute.get()))
                            .append("\n"));
      }
    }
    std::sort(lines.begin(), lines.end());
    std::string text;
    for (const std::string& line : lines) text += line;
    put_text(root.get(), "content_hash", checksum(std::string_view(text)));
  });
}

}  // namespace palpate::test
