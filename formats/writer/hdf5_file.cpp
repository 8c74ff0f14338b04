#include "formats/writer/hdf5_file.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/file_io.h"
#include "formats/writer/hdf5_walk.h"

namespace palpate::hdf5 {
namespace {

constexpr std::size_t longest_written_text = 4096;
constexpr std::size_t highest_rank = 4;
constexpr const char* disk_hint = "Check the disk and the folder's permissions";

/// Creation properties without times, for kinds such as H5P_DATASET_CREATE.
Id timeless(hid_t kind) {
  Id properties(H5Pcreate(kind), H5Pclose);
  H5Pset_obj_track_times(properties.get(), false);
  return properties;
}

Id text_type(std::size_t length, H5T_cset_t characters) {
  Id type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), length > 0 ? length : 1);
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  H5Tset_cset(type.get(), characters);
  return type;
}

bool is_ascii(const std::string& text) {
  for (const char c : text)
    if (static_cast<unsigned char>(c) > 127) return false;
  return true;
}

struct Rows {
  Id file, memory;
};

Rows select_rows(const Id& dataset, std::int64_t first, std::int64_t rows) {
  Rows selected;
  selected.file = Id(H5Dget_space(dataset.get()), H5Sclose);
  std::array<hsize_t, highest_rank> sizes = {}, start = {};
  const int rank = H5Sget_simple_extent_dims(selected.file.get(), sizes.data(), nullptr);
  sizes[0] = static_cast<hsize_t>(rows);
  start[0] = static_cast<hsize_t>(first);
  H5Sselect_hyperslab(selected.file.get(), H5S_SELECT_SET, start.data(), nullptr, sizes.data(), nullptr);
  selected.memory = Id(H5Screate_simple(rank, sizes.data(), nullptr), H5Sclose);
  return selected;
}

}  // namespace

void File::fail(const std::string& doing) const {
  throw Error("cannot " + doing + ": " + reason(), path_.string(), disk_hint);
}

File File::create(const std::filesystem::path& path, std::int64_t align_from) {
  const Id access = access_properties(align_from);
  const Id creation = timeless(H5P_FILE_CREATE);
  H5Pset_userblock(creation.get(), static_cast<hsize_t>(index_bytes));
  File file(Id(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose), path);
  if (!file.file_.valid()) {
    // If the file vanishes while HDF5 creates it, HDF5 does not pass on the system's reason.
    if (::access(path.c_str(), F_OK) != 0)
      throw Error("cannot make the file: " + std::system_category().message(errno), path.string(),
                  "Something removed the file or its folder meanwhile");
    file.fail("make the file");
  }
  return file;
}

File File::open_to_change(const std::filesystem::path& path, std::int64_t align_from) {
  const Id access = access_properties(align_from);
  File file(Id(H5Fopen(path.c_str(), H5F_ACC_RDWR, access.get()), H5Fclose), path);
  if (!file.file_.valid()) file.fail("open the file");
  return file;
}

bool File::has(const std::string& object) const {
  for (std::size_t end = object.find('/', 1);; end = object.find('/', end + 1)) {
    const std::string part = object.substr(0, end);
    H5L_info_t link = {};
    if (H5Lexists(id(), part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (H5Lget_info(id(), part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
    if (end == std::string::npos) return true;
  }
}

void File::make_group(const std::string& group) {
  if (group.empty() || has(group)) return;
  make_group(group.substr(0, group.rfind('/')));
  const Id creation = timeless(H5P_GROUP_CREATE);
  const Id made(H5Gcreate2(id(), group.c_str(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), H5Gclose);
  if (!made.valid()) fail("make the group " + group);
}

void File::make_link(const std::string& link, const std::string& target) {
  if (H5Lcreate_soft(target.c_str(), id(), link.c_str(), H5P_DEFAULT, H5P_DEFAULT) < 0)
    fail("make the link " + link);
}

std::int64_t File::write(const std::string& dataset, const NumberType& type,
                         std::span<const std::int64_t> dims, const void* data) {
  make_group(dataset.substr(0, dataset.rfind('/')));
  const std::vector<hsize_t> sizes(dims.begin(), dims.end());
  const Id space(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose);
  const Id creation = timeless(H5P_DATASET_CREATE);
  H5Pset_layout(creation.get(), H5D_CONTIGUOUS);
  H5Pset_alloc_time(creation.get(), H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
  const Id made(H5Dcreate2(id(), dataset.c_str(), type_of(type.name), space.get(), H5P_DEFAULT,
                           creation.get(), H5P_DEFAULT),
                H5Dclose);
  if (!made.valid()) fail("make " + dataset);
  if (data != nullptr && H5Dwrite(made.get(), type_of(type.name), H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
    fail("write " + dataset);
  return static_cast<std::int64_t>(H5Dget_offset(made.get()));
}

void File::write_attribute(const std::string& object, const std::string& name, const std::string& text) {
  if (text.size() > longest_written_text) {
    throw Error(name + " is " + std::to_string(text.size()) + " bytes long, at most " +
                    std::to_string(longest_written_text) + " fit",
                path_.string(), "Use a shorter text");
  }
  const Id holder(H5Oopen(id(), object.c_str(), H5P_DEFAULT), H5Oclose);
  const Id type = text_type(text.size(), is_ascii(text) ? H5T_CSET_ASCII : H5T_CSET_UTF8);
  const Id space(H5Screate(H5S_SCALAR), H5Sclose);
  const Id made(H5Acreate2(holder.get(), name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                H5Aclose);
  if (!made.valid() || H5Awrite(made.get(), type.get(), text.c_str()) < 0)
    fail("write the attribute " + name + " of " + object);
}

void File::write_attribute(const std::string& object, const std::string& name,
                           std::span<const std::int64_t> values) {
  const Id holder(H5Oopen(id(), object.c_str(), H5P_DEFAULT), H5Oclose);
  const hsize_t count = values.size();
  const Id space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Id made(H5Acreate2(holder.get(), name.c_str(), H5T_STD_I64LE, space.get(), H5P_DEFAULT, H5P_DEFAULT),
                H5Aclose);
  if (!made.valid() || H5Awrite(made.get(), H5T_NATIVE_INT64, values.data()) < 0)
    fail("write the attribute " + name + " of " + object);
}

Id File::open_dataset(const std::string& dataset) const {
  Id opened(H5Dopen2(id(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
  if (!opened.valid()) fail("open " + dataset);
  return opened;
}

void File::write_rows(const std::string& dataset, const NumberType& type, std::int64_t first,
                      std::int64_t rows, const void* data) {
  const Id opened = open_dataset(dataset);
  const Rows selected = select_rows(opened, first, rows);
  if (H5Dwrite(opened.get(), type_of(type.name), selected.memory.get(), selected.file.get(), H5P_DEFAULT,
               data) < 0)
    fail("write " + dataset);
}

void File::close() {
  if (!file_.close()) fail("write the file");
  const FileDescriptor written = open_file(path_, OpenMode::write);
  write_exactly(written, index_of_own(written), 0);
}

}  // namespace palpate::hdf5
