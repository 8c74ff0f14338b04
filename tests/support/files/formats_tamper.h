// Changes a baked file behind the writer's back and makes its checksums right again, by the rules of
// docs/file-format.md and not by the code under test: so that a reader's checks are met, and not only its
// checksums. The index follows each change of the HDF5.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate::test {

/// All datasets that carry a checksum, sorted.
std::vector<std::string> checked_datasets(const std::filesystem::path& path);

/// Overwrites bytes of a dataset (at most what fits); false when there is no such dataset with bytes.
bool set_bytes(const std::filesystem::path& path, const std::string& dataset, std::uint64_t at,
               const void* bytes, std::size_t count);

/// Entry `index` of a dataset.
template <class T>
bool set_entry(const std::filesystem::path& path, const std::string& dataset, std::uint64_t index, T value) {
  return set_bytes(path, dataset, index * sizeof(T), &value, sizeof(T));
}

/// Puts a dataset of zeros (or of `bytes`) with this type and shape in the place of another; `chunked` stores
/// it in pieces. More than a million entries are claimed and not stored.
void replace(const std::filesystem::path& path, const std::string& dataset, hid_t type,
             const std::vector<hsize_t>& dims, const void* bytes = nullptr, bool chunked = false);

void remove_object(const std::filesystem::path& path, const std::string& object);
void replace_by_soft_link(const std::filesystem::path& path, const std::string& object,
                          const std::string& target);
void set_text(const std::filesystem::path& path, const std::string& attribute, const std::string& text);
void set_integers(const std::filesystem::path& path, const std::string& attribute,
                  const std::vector<std::int64_t>& values);
void remove_attribute(const std::filesystem::path& path, const std::string& object,
                      const std::string& attribute);

/// Recomputes every checksum and the content hash.
void reseal(const std::filesystem::path& path);

}  // namespace palpate::test
