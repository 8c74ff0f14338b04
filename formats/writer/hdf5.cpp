#include "formats/writer/hdf5.h"

#include <cstddef>
#include <utility>

namespace palpate::hdf5 {
namespace {

constexpr hsize_t alignment = 4096;  // a page

/// All files are closed explicitly; the library's own exit handler crashes after a failed close (full disk).
[[maybe_unused]] const herr_t no_exit_handler = H5dont_atexit();

}  // namespace

Id::Id(Id&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), closer_(other.closer_) {}

Id& Id::operator=(Id&& other) noexcept {
  close();
  id_ = std::exchange(other.id_, H5I_INVALID_HID);
  closer_ = other.closer_;
  return *this;
}

Id::~Id() {
  close();
}

bool Id::close() noexcept {
  return id_ < 0 || closer_(std::exchange(id_, H5I_INVALID_HID)) >= 0;
}

hid_t type_of(std::string_view name) {
  if (name == "uint8") return H5T_STD_U8LE;
  if (name == "uint32") return H5T_STD_U32LE;
  if (name == "int32") return H5T_STD_I32LE;
  if (name == "int64") return H5T_STD_I64LE;
  return name == "float32" ? H5T_IEEE_F32LE : H5T_IEEE_F64LE;
}

std::string reason() {
  std::string text;
  const auto first = [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
    if (error->desc != nullptr) *static_cast<std::string*>(data) = error->desc;
    return 1;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, first, &text);
  constexpr std::string_view before = "error message = '";
  if (const std::size_t at = text.find(before); at != std::string::npos)
    text = text.substr(at + before.size(), text.find('\'', at + before.size()) - at - before.size());
  return text.empty() ? "no reason given" : text;
}

Id access_properties(std::int64_t align_from) {
  Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_sec2(access.get());
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  // 1.10's format has a checksum in every piece of metadata; the older ones have none.
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  // Finished files never change and half-written ones are locked by their journal; HDF5's own lock fails on
  // some network disks.
  H5Pset_file_locking(access.get(), false, true);
  if (align_from > 0) {
    H5Pset_alignment(access.get(), static_cast<hsize_t>(align_from), alignment);
  } else {
    H5Pset_small_data_block_size(access.get(), 0);  // small rows are adjacent, too
  }
  return access;
}

Quiet::Quiet() {
  H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Quiet::~Quiet() {
  H5Eset_auto2(H5E_DEFAULT, print_, data_);
}

}  // namespace palpate::hdf5
