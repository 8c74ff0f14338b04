// A thin layer over the HDF5 C library: identifiers that close themselves, failures as Error, no error
// printing.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace palpate::hdf5 {

/// Owns an HDF5 identifier.
class Id {
 public:
  using Closer = herr_t (*)(hid_t);
  Id() = default;
  Id(hid_t id, Closer closer) noexcept : id_(id), closer_(closer) {}
  Id(Id&& other) noexcept;
  Id& operator=(Id&& other) noexcept;
  ~Id();

  [[nodiscard]] hid_t get() const noexcept { return id_; }
  [[nodiscard]] bool valid() const noexcept { return id_ >= 0; }
  bool close() noexcept;  ///< returns false if the library failed, e.g. while writing buffered data

 private:
  hid_t id_ = H5I_INVALID_HID;
  Closer closer_ = nullptr;
};

/// HDF5 type of a NumberType.
hid_t type_of(std::string_view name);

/// Deepest reason that the library gives for its last failure; the system's message if there is one.
std::string reason();

/// Access properties for our files. Objects of at least `align_from` bytes (0: none) start at multiples of
/// 4096 bytes.
Id access_properties(std::int64_t align_from = 0);

/// Stops the library from printing its error stack while this lives.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

}  // namespace palpate::hdf5
