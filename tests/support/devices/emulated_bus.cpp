#include "tests/support/devices/emulated_bus.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <thread>

namespace palpate {
namespace {

/// The nodes of sysfs from the hidraw device up to the USB device, and /dev/hidrawN.
std::string nodes(const Firmware& firmware, const std::string& serial, int number) {
  const std::string ids = fmt::format("{:04X}:{:04X}", firmware.vendor, firmware.product);
  const std::string usb = fmt::format("/devices/pci0000:00/0000:00:01.0/usb1/1-{}", number + 1);
  const std::string hid = fmt::format("0003:{}.{:04X}", ids, number + 1);
  std::string descriptor;
  for (const std::uint8_t byte : firmware.descriptor) {
    descriptor += fmt::format("{:02X}", byte);
  }
  return fmt::format(
             "P: {0}/1-{1}:1.0/{2}/hidraw/hidraw{3}\n"
             "N: hidraw{3}\n"
             "E: DEVNAME=/dev/hidraw{3}\n"
             "E: MAJOR=240\n"
             "E: MINOR={3}\n"
             "E: SUBSYSTEM=hidraw\n"
             "A: dev=240:{3}\\n\n"
             "L: device=../../../{2}\n\n",
             usb, number + 1, hid, number) +
         fmt::format(
             "P: {0}/1-{1}:1.0/{2}\n"
             "E: DRIVER=hid-generic\n"
             "E: HID_ID=0003:0000{3:04X}:0000{4:04X}\n"
             "E: HID_NAME={5}\n"
             "E: HID_PHYS=usb-0000:00:01.0-{1}/input0\n"
             "E: HID_UNIQ={6}\n"
             "E: SUBSYSTEM=hid\n"
             "H: report_descriptor={7}\n\n",
             usb, number + 1, hid, firmware.vendor, firmware.product, firmware.name, serial, descriptor) +
         fmt::format(
             "P: {0}/1-{1}:1.0\n"
             "E: DEVTYPE=usb_interface\n"
             "E: DRIVER=usbhid\n"
             "E: SUBSYSTEM=usb\n"
             "A: bInterfaceNumber=00\\n\n"
             "A: bInterfaceClass=03\\n\n\n"
             "P: {0}\n"
             "E: DEVTYPE=usb_device\n"
             "E: DRIVER=usb\n"
             "E: PRODUCT={2:x}/{3:x}/100\n"
             "E: SUBSYSTEM=usb\n"
             "A: idVendor={2:04x}\\n\n"
             "A: idProduct={3:04x}\\n\n"
             "A: bcdDevice=0100\\n\n"
             "A: manufacturer=Emulated\\n\n"
             "A: product={4}\\n\n"
             "A: serial={5}\\n\n",
             usb, number + 1, firmware.vendor, firmware.product, firmware.name, serial);
}

std::string sysfs_hid(const Firmware& firmware, int number) {
  return fmt::format("/sys/devices/pci0000:00/0000:00:01.0/usb1/1-{0}/1-{0}:1.0/0003:{1:04X}:{2:04X}.{0:04X}",
                     number + 1, firmware.vendor, firmware.product);
}

gboolean on_ioctl(UMockdevIoctlBase* /*handler*/, UMockdevIoctlClient* client, gpointer user) {
  Firmware& firmware = *static_cast<Firmware*>(user);
  const gulong request = umockdev_ioctl_client_get_request(client);
  if (_IOC_TYPE(request) != 'H') return FALSE;
  enum { descriptor_size = 1, descriptor = 2, set_feature = 6, get_feature = 7 };  // linux/hidraw.h
  const auto number = _IOC_NR(request);
  const std::size_t room = _IOC_SIZE(request);
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, room, nullptr);
  if (data == nullptr) return FALSE;
  const auto complete = [&](glong result, int error) {
    umockdev_ioctl_client_complete(client, result, error);
    return TRUE;
  };
  switch (number) {
    case descriptor_size: {
      const int size = static_cast<int>(firmware.descriptor.size());
      std::memcpy(data->data, &size, sizeof(size));
      return complete(0, 0);
    }
    case descriptor:
      std::ranges::copy(firmware.descriptor, data->data + sizeof(std::uint32_t));
      return complete(0, 0);
    case set_feature:
      // Output reports come by the terminal, feature reports by another road: these must not overtake those.
      for (int k = 0; k < 5000 && !firmware.is_ready(); ++k) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return firmware.set_feature({data->data, room}) ? complete(static_cast<glong>(room), 0)
                                                      : complete(-1, EPIPE);
    case get_feature: {
      const auto report = firmware.get_feature(data->data[0]);
      if (!report) return complete(-1, EPIPE);
      const std::size_t size = std::min(room, report->size());
      std::copy_n(report->begin(), size, data->data);
      return complete(static_cast<glong>(size), 0);
    }
    default:
      return FALSE;
  }
}

void check(gboolean done, GError* error) {
  if (done == FALSE) throw std::runtime_error(error == nullptr ? "umockdev" : error->message);
}

}  // namespace

struct EmulatedBus::Testbed {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  ~Testbed() { g_object_unref(testbed); }
};

/// A device that is plugged in: a thread runs its firmware at the far end of the pseudo-terminal.
class EmulatedDevice {
 public:
  EmulatedDevice(UMockdevTestbed* testbed, std::shared_ptr<Firmware> firmware, std::string path, int number)
      : testbed_(testbed),
        firmware_(std::move(firmware)),
        path_(std::move(path)),
        number_(number),
        ioctls_(umockdev_ioctl_base_new()) {
    far_end_ = umockdev_testbed_get_dev_fd(testbed_, path_.c_str());
    fcntl(far_end_, F_SETFL, fcntl(far_end_, F_GETFL) | O_NONBLOCK);
    node_ = open(path_.c_str(), O_RDWR | O_CLOEXEC | O_NOCTTY);
    keep_reports_whole();
    g_signal_connect(ioctls_, "handle-ioctl", G_CALLBACK(on_ioctl), firmware_.get());
    GError* error = nullptr;
    check(umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), ioctls_, &error), error);
    thread_ = std::thread([this] { run(); });
  }

  ~EmulatedDevice() {
    stop_ = true;
    thread_.join();
    umockdev_testbed_detach_ioctl(testbed_, path_.c_str(), nullptr);
    g_object_unref(ioctls_);
    // The testbed keeps the number of the far end: it must stay a file, but no longer that one.
    const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    dup2(nothing, far_end_);
    close(nothing);
    const std::string hid = sysfs_hid(*firmware_, number_);
    const std::string usb = hid.substr(0, hid.rfind('/', hid.rfind('/') - 1));
    for (const std::string& node :
         {hid + "/hidraw/hidraw" + std::to_string(number_), hid, hid.substr(0, hid.rfind('/')), usb}) {
      umockdev_testbed_remove_device(testbed_, node.c_str());
    }
  }

  EmulatedDevice(const EmulatedDevice&) = delete;
  EmulatedDevice& operator=(const EmulatedDevice&) = delete;

  void talk() { talks_ = true; }

  /// The near end. As long as it is open the system gives its terminal's number to no other, which umockdev
  /// cannot bear, even when this device is gone.
  [[nodiscard]] int node() const { return node_; }

 private:
  /// A terminal may deliver half a report: it shall wait until it has one (report 1 where they have numbers).
  void keep_reports_whole() const {
    const bool numbered = firmware_->reports.numbered;
    termios settings{};
    if (tcgetattr(node_, &settings) != 0) throw std::runtime_error("tcgetattr");
    settings.c_cc[VMIN] = static_cast<cc_t>(
        firmware_->reports.report_bytes(HidReportType::input, numbered ? 1 : 0) + (numbered ? 1 : 0));
    settings.c_cc[VTIME] = 0;
    if (tcsetattr(node_, TCSANOW, &settings) != 0) throw std::runtime_error("tcsetattr");
  }

  void run() {
    // A device does not wait for a processor of this machine: where the system allows it, this one neither.
    const sched_param priority{.sched_priority = 70};
    static_cast<void>(pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority));
    while (!stop_) {
      if (talks_) {
        while (const auto report = firmware_->input()) {
          if (said_.size() < 4096) said_.insert(said_.end(), report->begin(), report->end());
        }
        // What a full terminal does not take comes later: a report must not lose its end.
        const ssize_t taken = said_.empty() ? 0 : write(far_end_, said_.data(), said_.size());
        if (taken > 0) said_.erase(said_.begin(), said_.begin() + taken);
      }
      pollfd waiting{far_end_, POLLIN, 0};
      const timespec at_most{0, 200'000};
      if (ppoll(&waiting, 1, &at_most, nullptr) > 0 && (waiting.revents & POLLIN) != 0) hear();
    }
  }

  /// A pseudo-terminal glues reports together: each is as long as the descriptor says.
  void hear() {
    std::array<std::uint8_t, 4096> room{};
    const ssize_t size = read(far_end_, room.data(), room.size());
    if (size <= 0) return;
    heard_.insert(heard_.end(), room.begin(), room.begin() + size);
    while (!heard_.empty()) {
      const std::size_t bytes = firmware_->output_bytes(heard_[0]);
      if (bytes == 0) {
        ADD_FAILURE() << "an output report with the id " << int{heard_[0]};
        heard_.clear();
        return;
      }
      if (heard_.size() < bytes) return;
      firmware_->output(std::span(heard_).first(bytes));
      heard_.erase(heard_.begin(), heard_.begin() + static_cast<std::ptrdiff_t>(bytes));
    }
  }

  UMockdevTestbed* testbed_;
  std::shared_ptr<Firmware> firmware_;
  std::string path_;
  int number_;
  UMockdevIoctlBase* ioctls_;
  int far_end_ = -1;
  int node_ = -1;       // the caller closes it
  Bytes said_, heard_;  // not yet taken; not yet whole
  std::atomic<bool> stop_ = false, talks_ = false;
  std::thread thread_;
};

EmulatedBus::EmulatedBus() : testbed_(std::make_unique<Testbed>()) {}

EmulatedBus::~EmulatedBus() {
  while (!devices_.empty()) {
    unplug(std::string(devices_.begin()->first));
  }
  for (const int node : kept_) {
    close(node);
  }
}

bool EmulatedBus::is_there() {
  const char* preloaded = std::getenv("LD_PRELOAD");
  return preloaded != nullptr && std::string_view(preloaded).find("umockdev") != std::string_view::npos;
}

std::string EmulatedBus::plug_in(const std::shared_ptr<Firmware>& firmware, const std::string& serial) {
  const int number = plugged_in_++;
  GError* error = nullptr;
  check(umockdev_testbed_add_from_string(testbed_->testbed, nodes(*firmware, serial, number).c_str(), &error),
        error);
  std::string path = "/dev/hidraw" + std::to_string(number);
  devices_[path] = std::make_unique<EmulatedDevice>(testbed_->testbed, firmware, path, number);
  return path;
}

void EmulatedBus::talk(const std::string& path) {
  devices_.at(path)->talk();
}

void EmulatedBus::unplug(const std::string& path) {
  kept_.push_back(devices_.at(path)->node());
  devices_.erase(path);
}

void EmulatedBus::remove_node(const std::string& path) {
  char* root = umockdev_testbed_get_root_dir(testbed_->testbed);
  const std::string node = root + path;
  g_free(root);
  if (::unlink(node.c_str()) != 0) throw std::runtime_error(node);
}

}  // namespace palpate
