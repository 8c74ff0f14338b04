// The emulated bus by the kernel's own uhid: real hidraw devices, for a virtual machine.
#include <fcntl.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <thread>

#include "tests/support/devices/emulated_bus.h"

namespace palpate {
namespace {

constexpr const char* driver = "/dev/uhid";
constexpr std::uint16_t usb = 0x03;  // BUS_USB of linux/input.h

std::set<std::string> hidraw_devices() {
  std::set<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/hidraw", none)) {
    names.insert(entry.path().filename());
  }
  return names;
}

void send(int device, const uhid_event& event) {
  if (write(device, &event, sizeof(event)) < 0) throw std::runtime_error("uhid does not take an event");
}

}  // namespace

struct EmulatedBus::Testbed {};

class EmulatedDevice {
 public:
  EmulatedDevice(std::shared_ptr<Firmware> firmware, const std::string& serial)
      : firmware_(std::move(firmware)), device_(open(driver, O_RDWR | O_CLOEXEC)) {
    if (device_ < 0) throw std::runtime_error(driver);
    uhid_event event{};
    event.type = UHID_CREATE2;
    auto& create = event.u.create2;
    std::ranges::copy(firmware_->name, create.name);
    std::ranges::copy(serial, create.uniq);
    create.rd_size = static_cast<std::uint16_t>(firmware_->descriptor.size());
    create.bus = usb;
    create.vendor = firmware_->vendor;
    create.product = firmware_->product;
    std::ranges::copy(firmware_->descriptor, create.rd_data);
    send(device_, event);
    thread_ = std::thread([this] { run(); });
  }

  ~EmulatedDevice() {
    stop_ = true;
    thread_.join();
    close(device_);  // which unplugs it
  }

  EmulatedDevice(const EmulatedDevice&) = delete;
  EmulatedDevice& operator=(const EmulatedDevice&) = delete;

  void talk() { talks_ = true; }

 private:
  void run() {
    while (!stop_) {
      while (talks_) {
        const auto report = firmware_->input();
        if (!report) break;
        uhid_event event{};
        event.type = UHID_INPUT2;
        event.u.input2.size = static_cast<std::uint16_t>(report->size());
        std::ranges::copy(*report, event.u.input2.data);
        send(device_, event);
      }
      pollfd waiting{device_, POLLIN, 0};
      const timespec at_most{0, 200'000};
      if (ppoll(&waiting, 1, &at_most, nullptr) > 0 && (waiting.revents & POLLIN) != 0) hear();
    }
  }

  void hear() {
    uhid_event event{};
    if (read(device_, &event, sizeof(event)) <= 0) return;
    uhid_event answer{};
    if (event.type == UHID_OUTPUT) {
      firmware_->output({event.u.output.data, event.u.output.size});
    } else if (event.type == UHID_SET_REPORT) {
      const auto& request = event.u.set_report;
      answer.type = UHID_SET_REPORT_REPLY;
      answer.u.set_report_reply.id = request.id;
      answer.u.set_report_reply.err = firmware_->set_feature({request.data, request.size}) ? 0 : EPIPE;
      send(device_, answer);
    } else if (event.type == UHID_GET_REPORT) {
      const auto report = firmware_->get_feature(event.u.get_report.rnum);
      auto& reply = answer.u.get_report_reply;
      answer.type = UHID_GET_REPORT_REPLY;
      reply.id = event.u.get_report.id;
      reply.err = report ? 0 : EPIPE;
      if (report) {
        reply.size = static_cast<std::uint16_t>(report->size());
        std::ranges::copy(*report, reply.data);
      }
      send(device_, answer);
    }
  }

  std::shared_ptr<Firmware> firmware_;
  int device_;
  std::atomic<bool> stop_ = false, talks_ = false;
  std::thread thread_;
};

EmulatedBus::EmulatedBus() = default;

EmulatedBus::~EmulatedBus() {
  while (!devices_.empty()) {
    unplug(std::string(devices_.begin()->first));
  }
}

bool EmulatedBus::is_there() {
  return access(driver, R_OK | W_OK) == 0;
}

std::string EmulatedBus::plug_in(const std::shared_ptr<Firmware>& firmware, const std::string& serial) {
  const std::set<std::string> before = hidraw_devices();
  auto device = std::make_unique<EmulatedDevice>(firmware, serial);
  for (int k = 0; k < 1000; ++k) {
    for (const std::string& name : hidraw_devices()) {
      std::string path = "/dev/" + name;
      if (before.contains(name) || access(path.c_str(), F_OK) != 0) continue;
      devices_[path] = std::move(device);
      return path;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw std::runtime_error("no hidraw device for " + firmware->name);
}

void EmulatedBus::talk(const std::string& path) {
  devices_.at(path)->talk();
}

void EmulatedBus::unplug(const std::string& path) {
  devices_.erase(path);
  for (int k = 0; k < 1000 && hidraw_devices().contains(path.substr(5)); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

void EmulatedBus::remove_node(const std::string& path) {
  if (::unlink(path.c_str()) != 0) throw std::runtime_error(path);
}

}  // namespace palpate
