// The other side of the wire: what boards and sticks do with reports, for emulated devices. A hand moves the
// handle along a given path; what the device shows it is kept.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/palpate_board.h"
#include "runtime/devices/reports/pid_layout.h"
#include "tests/support/devices/bytes.h"

namespace palpate {

/// Where the handle is, in the device's frame [m], so many seconds after the firmware was made.
using Hand = std::function<Vec3(double)>;

/// A force on the hand, from `time` on [s].
struct ShownForce {
  double time = 0.0;
  Vec3 force = Vec3::Zero();  ///< [N]
};

/// One device. Calls may come from several threads.
class Firmware {
 public:
  Firmware(std::uint16_t vendor, std::uint16_t product, std::string name, Bytes descriptor);
  virtual ~Firmware() = default;

  const std::uint16_t vendor;
  const std::uint16_t product;
  const std::string name;
  const Bytes descriptor;
  const HidReportDescriptor reports;

  /// The input report that is due, if one is.
  std::optional<Bytes> input();
  /// An output report as write(2) gives it to hidraw: report id first, 0 where reports have none.
  void output(std::span<const std::uint8_t> report);
  /// How many bytes the output report with this id has, with the id; 0: there is none.
  [[nodiscard]] std::size_t output_bytes(std::uint8_t id) const;
  /// Feature reports, id first. False: stalled.
  bool set_feature(std::span<const std::uint8_t> report);
  std::optional<Bytes> get_feature(std::uint8_t id);
  /// It has had the output reports that must come before a feature report.
  [[nodiscard]] bool is_ready() const;

  /// All that it has shown, and all that it was told.
  [[nodiscard]] std::vector<ShownForce> forces() const;
  [[nodiscard]] std::vector<Bytes> outputs() const;
  [[nodiscard]] std::size_t output_count() const;
  [[nodiscard]] double time() const;  ///< [s]

 protected:
  void show(const Vec3& force);  ///< for `do_...`
  void show(const Vec3& force, double time);
  [[nodiscard]] double now() const;

  mutable std::mutex mutex_;  ///< held where `do_...` is called

 private:
  virtual std::optional<Bytes> do_input() = 0;
  virtual void do_output(std::span<const std::uint8_t> /*report*/) {}
  virtual bool do_set_feature(std::span<const std::uint8_t> /*report*/) { return false; }
  virtual std::optional<Bytes> do_get_feature(std::uint8_t /*id*/) { return std::nullopt; }
  [[nodiscard]] virtual bool do_is_ready() const { return true; }

  std::int64_t made_;
  std::vector<ShownForce> forces_;
  std::vector<Bytes> outputs_;
};

/// Answers each report, unnumbered 14 bytes; without one for half a second it shows nothing. Currents to
/// forces by virtual work over whole counts of the encoders.
class WoodenHapticsFirmware : public Firmware {
 public:
  WoodenHapticsFirmware(const ArmConstants& arm, Hand hand);

  double watchdog = 0.5;  ///< [s]

  void press_button(bool down);
  void press_calibrate();  ///< until it is answered
  /// It was switched on elsewhere than in its calibration pose: its counters are off by this.
  void misplace(const std::array<std::int16_t, 6>& error) { error_ = error; }

 private:
  std::optional<Bytes> do_input() override;
  void do_output(std::span<const std::uint8_t> report) override;
  [[nodiscard]] std::array<std::int16_t, 6> counters() const;  ///< as they are if it was calibrated
  [[nodiscard]] Vec3 force_of(const Vec3& currents) const;

  ArmConstants arm_;
  Hand hand_;
  std::array<std::int16_t, 6> error_{};  // of the counters that it says
  int answers_ = 0;                      // that it owes
  double told_ = 0.0;                    // when [s]
  bool current_flows_ = false;
  std::atomic<bool> button_ = false;
  std::atomic<bool> calibrate_ = false;
};

/// A report each millisecond, three axes. Without a force for as long as its watchdog waits it shows none.
class BoardFirmware : public Firmware {
 public:
  BoardFirmware(const BoardFeature& feature, Hand hand, std::uint32_t first_sequence = 0);

  /// The numbers of the input reports that forces answered.
  [[nodiscard]] std::vector<std::uint32_t> answered() const;
  [[nodiscard]] std::uint32_t sequence() const;  ///< of the next report

 private:
  std::optional<Bytes> do_input() override;
  void do_output(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> do_get_feature(std::uint8_t id) override;

  BoardFeature feature_;
  Hand hand_;
  std::uint32_t first_;
  std::uint32_t sequence_;
  double told_ = 0.0;  // when [s]
  bool shows_ = false;
  std::vector<std::uint32_t> answered_;
};

/// A SideWinder Force Feedback 2: two axes, effects by PID, which play on until they are stopped.
class JoystickFirmware : public Firmware {
 public:
  JoystickFirmware(const PidConstants& constants, Hand hand);

  bool full = false;       ///< no room for effects
  int slow = 0;            ///< so many Block Loads are pending before each effect is there
  bool has_loaded = true;  ///< false: Block Load stalls
  bool on_change = false;  ///< it reports only what has changed
  [[nodiscard]] std::size_t playing() const;

 private:
  struct Effect {
    double direction = 0.0;  // [degrees]
    double part = 0.0;       // of the largest magnitude
    bool plays = false;
  };

  std::optional<Bytes> do_input() override;
  void do_output(std::span<const std::uint8_t> report) override;
  bool do_set_feature(std::span<const std::uint8_t> report) override;
  std::optional<Bytes> do_get_feature(std::uint8_t id) override;

  [[nodiscard]] bool do_is_ready() const override { return enabled_; }

  PidConstants constants_;
  Hand hand_;
  PidLayout layout_;
  std::map<std::int64_t, Effect> effects_;
  bool enabled_ = false;
  int pending_ = 0;
  std::int64_t sent_ = 0;  // input reports, or those that were not worth it
  Bytes said_;             // last
};

/// A SpaceMouse Wireless: a report each 8 ms while the cap is held, and one when it is let go.
class SpaceMouseFirmware : public Firmware {
 public:
  /// `cap`: its six counts at a time [s].
  explicit SpaceMouseFirmware(std::function<std::array<std::int16_t, 6>(double)> cap);

 private:
  std::optional<Bytes> do_input() override;

  std::function<std::array<std::int16_t, 6>(double)> cap_;
  std::int64_t sent_ = 0;
  bool held_ = false;
};

/// Seven numbers of 16 bits each way, of a vendor's usages.
[[nodiscard]] Bytes woodenhaptics_descriptor();

}  // namespace palpate
