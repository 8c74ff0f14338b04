#include "runtime/devices/hid/hid_port.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/error.h"
#include "base/printable.h"
#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/safety/monotonic_clock.h"

namespace palpate {
namespace {

constexpr std::size_t longest_input = 64;           // bytes of a full-speed interrupt transfer
constexpr int most_drained = 64;                    // Linux queues as many reports
constexpr std::int64_t longest_write = 20'000'000;  // limit for a working device [ns]

}  // namespace

HidPort::HidPort(HidChoice choice, Guardian* guardian, std::filesystem::path sys)
    : choice_(std::move(choice)),
      guardian_(guardian),
      sys_(std::move(sys)),
      limits_(choice_.profile.limits) {}

HidPort::~HidPort() {
  HidPort::close();
}

AttachedDevice HidPort::find_again() const {
  const AttachedDevice& wanted = choice_.device;
  std::vector<AttachedDevice> found = attached_devices(sys_);
  std::erase_if(found, [&](const AttachedDevice& device) {
    return device.vendor != wanted.vendor || device.product != wanted.product ||
           device.serial != wanted.serial || !choice_.profile.fits(device.id());
  });
  if (found.empty()) throw Error("the device is not attached", wanted.name(), "plug it in");
  const auto same_path = std::ranges::find(found, wanted.path, &AttachedDevice::path);
  if (same_path != found.end()) return *same_path;
  if (found.size() > 1) {
    throw Error(fmt::format("{} devices of this kind are attached, and their serial numbers do not tell them "
                            "apart",
                            found.size()),
                wanted.name(), "leave one of them plugged in");
  }
  return found.front();
}

void HidPort::open() {
  close();
  choice_.device = find_again();
  const AttachedDevice& attached = choice_.device;
  if (attached.access != 0) {
    const AccessProblem problem = access_problem(attached);
    throw Error(problem.what, attached.name(), problem.hint);
  }
  if (!attached.descriptor_problem.empty()) {
    throw Error(attached.descriptor_problem, attached.name(), "plug it in again");
  }
  auto protocol = make_hid_protocol(choice_.profile, attached.reports, attached.name(), sequence_);
  if (protocol->input_bytes() > longest_input) {
    throw Error(fmt::format("its input report has {} bytes", protocol->input_bytes()), attached.name(),
                "reports of at most 64 bytes are understood");
  }
  auto device = std::make_unique<HidDevice>(attached.path);
  try {
    protocol->start(*device);
  } catch (const Error&) {
    for (const OutputReport& report : protocol->zero()) static_cast<void>(device->write(report));
    throw;
  }
  zero_ = protocol->zero();
  if (guardian_ != nullptr) guardian_->guard(attached.path, zero_);
  limits_ = protocol->limits();
  protocol_ = std::move(protocol);
  device_ = std::move(device);
  read_failed_ = false;
  write_failed_ = false;
}

DevicePort::ReadResult HidPort::read(DeviceState& state) noexcept {
  if (!device_ || read_failed_) return ReadResult::lost;
  // Requests exactly the longest report of interest. A hidraw device returns one report per read whatever the
  // requested size, and a shorter or truncated one fails to decode. The pseudo-terminals that emulate devices
  // in tests return all pending bytes; with this size they return one report.
  std::array<std::uint8_t, longest_input> room;
  const std::span<std::uint8_t> buffer(room.data(), protocol_->input_bytes());
  bool heard = false;
  int wait = protocol_->wait();
  for (int k = 0; k < most_drained; ++k) {
    const int size = device_->read(buffer, wait);
    if (size < 0) {
      read_failed_ = true;
      return ReadResult::lost;
    }
    if (size == 0) break;
    if (protocol_->take(buffer.first(static_cast<std::size_t>(size)))) {
      heard = true;
    } else {
      dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    wait = 0;
  }
  const std::int64_t now = monotonic_now();
  const std::int64_t writing_since = writing_since_;
  const bool hangs = writing_since != 0 && now - writing_since > longest_write;
  if (!heard && hangs) return ReadResult::nothing;
  if (!protocol_->tell(heard, now, state)) return ReadResult::nothing;
  state.arrived = now;
  sequence_ = state.sequence;
  return ReadResult::report;
}

bool HidPort::write(const DeviceCommand& command, const DeviceState& state) noexcept {
  if (!device_ || write_failed_) return false;
  OutputReports reports;
  protocol_->encode(command, state, reports);
  writing_since_ = monotonic_now();
  for (std::size_t k = 0; k < reports.size() && !write_failed_; ++k) {
    write_failed_ = !device_->write(reports[k]);
  }
  writing_since_ = 0;
  return !write_failed_;
}

void HidPort::close() noexcept {
  if (!device_) return;
  for (const OutputReport& report : zero_) {
    // Twice, as one may be lost. Failure is ignored: the device is being closed anyway.
    static_cast<void>(device_->write(report));
    static_cast<void>(device_->write(report));
  }
  device_.reset();
  if (guardian_ != nullptr) guardian_->release();
}

std::string HidPort::name() const {
  return printable(choice_.profile.name) + ", " + choice_.device.name();
}

std::string HidPort::refusals() const {
  return dropped_ == 0 ? "" : std::to_string(dropped_) + " reports of a wrong length or of nonsense";
}

}  // namespace palpate
