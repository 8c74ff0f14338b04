#include "tests/support/devices/fake_hidapi.h"

#include <hidapi.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <cwchar>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <random>
#include <stdexcept>
#include <thread>

#include "runtime/safety/monotonic_clock.h"

namespace {

using namespace palpate;

struct Attached {
  std::shared_ptr<Firmware> firmware;
  std::string serial;
};

struct World {
  std::mutex mutex;
  std::filesystem::path folder;
  std::map<std::string, Attached> attached;  // by path
  int plugged_in = 0;
  std::function<FakeFault(std::int64_t)> on_read, on_write;
  std::int64_t reads = 0, writes = 0;
  std::mt19937 random{5};
  bool frozen = false;
  Bytes frozen_report;
  std::atomic<std::int64_t> calls_after_error = 0, open_devices = 0;
};

World* world = nullptr;

void sleep_ms(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

FakeFault next_fault(const std::function<FakeFault(std::int64_t)>& script, std::int64_t& count) {
  return script ? script(count++) : FakeFault::none;
}

void stall(FakeFault fault) {
  if (fault == FakeFault::stall_5ms) sleep_ms(5);
  if (fault == FakeFault::stall_50ms) sleep_ms(50);
}

wchar_t* wide(const std::string& text) {
  auto* result = static_cast<wchar_t*>(calloc(text.size() + 1, sizeof(wchar_t)));
  std::copy(text.begin(), text.end(), result);
  return result;
}

}  // namespace

struct hid_device_ {
  std::string path;
  std::shared_ptr<Firmware> firmware;
  std::deque<Bytes> queue;  // at most 64, as hidraw's
  bool read_failed = false, write_failed = false;

  [[nodiscard]] bool gone() const {
    const std::lock_guard lock(world->mutex);
    return !world->attached.contains(path);
  }
};

namespace palpate {

FakeHid::FakeHid() {
  std::string folder = (std::filesystem::temp_directory_path() / "palpate-hid-XXXXXX").string();
  if (world != nullptr || mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no fake HID");
  world = new World;
  world->folder = folder;
}

FakeHid::~FakeHid() {
  std::filesystem::remove_all(world->folder);
  delete world;
  world = nullptr;
}

std::filesystem::path FakeHid::sys() const {
  return world->folder;
}

std::string FakeHid::attach(const std::shared_ptr<Firmware>& firmware, const std::string& serial) {
  const std::lock_guard lock(world->mutex);
  const std::string node = "hidraw" + std::to_string(world->plugged_in++);
  const std::filesystem::path device = world->folder / "class/hidraw" / node / "device";
  std::filesystem::create_directories(device);
  std::ofstream(device / "report_descriptor", std::ios::binary)
      .write(reinterpret_cast<const char*>(firmware->descriptor.data()),
             static_cast<std::streamsize>(firmware->descriptor.size()));
  std::string path = (world->folder / node).string();
  std::ofstream(path, std::ios::binary).flush();
  world->attached[path] = {firmware, serial};
  return path;
}

void FakeHid::detach(const std::string& path) {
  const std::lock_guard lock(world->mutex);
  world->attached.erase(path);
  std::filesystem::remove(path);
}

void FakeHid::on_read(std::function<FakeFault(std::int64_t)> fault) {
  const std::lock_guard lock(world->mutex);
  world->on_read = std::move(fault);
  world->reads = 0;
}

void FakeHid::on_write(std::function<FakeFault(std::int64_t)> fault) {
  const std::lock_guard lock(world->mutex);
  world->on_write = std::move(fault);
  world->writes = 0;
}

void FakeHid::freeze(bool frozen) {
  const std::lock_guard lock(world->mutex);
  world->frozen = frozen;
}

std::int64_t FakeHid::calls_after_error() const {
  return world->calls_after_error;
}

std::int64_t FakeHid::open_devices() const {
  return world->open_devices;
}

}  // namespace palpate

// --- hidapi's functions, as far as palpate calls them ---

hid_device_info* hid_enumerate(unsigned short vendor, unsigned short product) {
  const std::lock_guard lock(world->mutex);
  hid_device_info* first = nullptr;
  for (const auto& [path, attached] : world->attached) {
    const Firmware& firmware = *attached.firmware;
    if ((vendor != 0 && vendor != firmware.vendor) || (product != 0 && product != firmware.product)) continue;
    auto* info = static_cast<hid_device_info*>(calloc(1, sizeof(hid_device_info)));
    info->path = strdup(path.c_str());
    info->vendor_id = firmware.vendor;
    info->product_id = firmware.product;
    info->serial_number = wide(attached.serial);
    info->manufacturer_string = wide("Emulated");
    info->product_string = wide(firmware.name);
    info->usage_page = firmware.reports.usage.page;
    info->usage = firmware.reports.usage.id;
    info->next = first;
    first = info;
  }
  return first;
}

void hid_free_enumeration(hid_device_info* info) {
  while (info != nullptr) {
    hid_device_info* next = info->next;
    free(info->path);
    free(info->serial_number);
    free(info->manufacturer_string);
    free(info->product_string);
    free(info);
    info = next;
  }
}

hid_device* hid_open_path(const char* path) {
  const std::lock_guard lock(world->mutex);
  const auto found = world->attached.find(path);
  if (found == world->attached.end()) return nullptr;
  ++world->open_devices;
  return new hid_device_{path, found->second.firmware, {}};
}

void hid_close(hid_device* device) {
  --world->open_devices;
  delete device;
}

int hid_read_timeout(hid_device* device, unsigned char* data, size_t length, int milliseconds) {
  if (device->read_failed) ++world->calls_after_error;
  const std::int64_t until = monotonic_now() + 1'000'000LL * milliseconds;
  while (true) {
    if (device->gone()) {
      device->read_failed = true;
      return -1;
    }
    while (const auto report = device->firmware->input()) {
      if (device->queue.size() == 64) device->queue.pop_front();
      device->queue.push_back(*report);
    }
    if (!device->queue.empty()) break;
    if (monotonic_now() >= until) return 0;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  Bytes report = device->queue.front();
  device->queue.pop_front();
  FakeFault fault = FakeFault::none;
  {
    const std::lock_guard lock(world->mutex);
    fault = next_fault(world->on_read, world->reads);
    if (world->frozen && !world->frozen_report.empty()) report = world->frozen_report;
    world->frozen_report = report;
    if (fault == FakeFault::garbage) report = random_bytes(world->random, report.size());
  }
  stall(fault);
  if (fault == FakeFault::error) {
    device->read_failed = true;
    return -1;
  }
  if (fault == FakeFault::short_report) report.pop_back();
  const std::size_t size = std::min(length, report.size());
  std::copy_n(report.begin(), size, data);
  return static_cast<int>(size);
}

int hid_write(hid_device* device, const unsigned char* data, size_t length) {
  if (device->write_failed) ++world->calls_after_error;
  FakeFault fault = FakeFault::none;
  {
    const std::lock_guard lock(world->mutex);
    fault = next_fault(world->on_write, world->writes);
  }
  stall(fault);
  if (fault == FakeFault::error || device->gone()) {
    device->write_failed = true;
    return -1;
  }
  device->firmware->output({data, length});
  return static_cast<int>(length);
}

int hid_send_feature_report(hid_device* device, const unsigned char* data, size_t length) {
  return !device->gone() && device->firmware->set_feature({data, length}) ? static_cast<int>(length) : -1;
}

int hid_get_feature_report(hid_device* device, unsigned char* data, size_t length) {
  if (device->gone()) return -1;
  const auto report = device->firmware->get_feature(data[0]);
  if (!report) return -1;
  const std::size_t size = std::min(length, report->size());
  std::copy_n(report->begin(), size, data);
  return static_cast<int>(size);
}
