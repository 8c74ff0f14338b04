// HID devices by umockdev: hidapi, udev, sysfs and /dev are those of the system, behind them stands firmware.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/devices/firmware.h"

namespace palpate {

class EmulatedDevice;

/// For programs that are run by umockdev-wrapper. One at a time.
class EmulatedBus {
 public:
  EmulatedBus();
  ~EmulatedBus();
  EmulatedBus(const EmulatedBus&) = delete;
  EmulatedBus& operator=(const EmulatedBus&) = delete;

  /// The program runs under umockdev-wrapper.
  static bool is_there();

  /// Plugs a device in; its path, another one each time. The device says nothing until `talk`: its node is a
  /// pseudo-terminal, which keeps for late readers what a hidraw device forgets.
  std::string plug_in(const std::shared_ptr<Firmware>& firmware, const std::string& serial = "SN1");
  /// From now on input reports come.
  void talk(const std::string& path);
  void unplug(const std::string& path);
  /// Leaves it in sysfs but not in /dev, as containers have it.
  void remove_node(const std::string& path);

 private:
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
  std::map<std::string, std::unique_ptr<EmulatedDevice>> devices_;  // by path
  std::vector<int> kept_;                                           // nodes of what was unplugged
  int plugged_in_ = 0;
};

}  // namespace palpate
