// In place of libhidapi: emulated devices in this process, with faults by script. A program that links
// fake_hidapi.cpp and not hidapi runs on it.
//
//     FakeHid hid;
//     auto board = std::make_shared<BoardFirmware>(feature, hand);
//     hid.attach(board);
//     HidPort port(choose_hid_device(attached_devices(hid.sys()), known_profiles(), ""), nullptr, hid.sys());
//     ... open, read and write in real time ...
//     board->forces();  // what the hand felt and when
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "tests/support/devices/firmware.h"

namespace palpate {

enum class FakeFault {
  none,
  short_report,  ///< without its last byte
  garbage,       ///< random bytes of the right number
  error,         ///< -1
  stall_5ms,
  stall_50ms,
};

/// One at a time in a process.
class FakeHid {
 public:
  FakeHid();
  ~FakeHid();
  FakeHid(const FakeHid&) = delete;
  FakeHid& operator=(const FakeHid&) = delete;

  /// A folder that looks like sysfs as far as report descriptors go; devices' nodes are files in it, too.
  [[nodiscard]] std::filesystem::path sys() const;

  /// Plugs a device in; its path, which is another one each time.
  std::string attach(const std::shared_ptr<Firmware>& firmware, const std::string& serial = "SN1");
  /// Unplugs it: what is open fails from now on.
  void detach(const std::string& path);

  /// What happens to the k-th input report that is read, or output report that is written, from now on,
  /// counted from 0 over all devices.
  void on_read(std::function<FakeFault(std::int64_t)> fault);
  void on_write(std::function<FakeFault(std::int64_t)> fault);
  /// From now on each input report says what the last one did.
  void freeze(bool frozen);

  /// Calls of hid_read_timeout and hid_write after one of the same kind has returned -1 for this opening:
  /// there must be none.
  [[nodiscard]] std::int64_t calls_after_error() const;
  [[nodiscard]] std::int64_t open_devices() const;
};

}  // namespace palpate
