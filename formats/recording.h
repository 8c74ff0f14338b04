// Recorded sessions: every tick of a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// What is kept of one tick.
struct TickRecord {
  double time = 0.0;                            ///< since the start of the run [s]
  double device_position[3] = {};               ///< where the device wanted the tool [m]
  double device_orientation[4] = {1, 0, 0, 0};  ///< w, x, y, z
  double tool_position[3] = {};               ///< where the tool itself was, which the body keeps outside [m]
  double tool_orientation[4] = {1, 0, 0, 0};  ///< w, x, y, z
  double force[3] = {};       ///< the opposite of what the hand feels [N]: that on the body, but where it is
                              ///< limited or handed over
  double torque[3] = {};      ///< on the body about the tool's origin [N m]
  std::int32_t contacts = 0;  ///< closed contact points
  double stiffness[6] = {};   ///< that the hand feels, xx, yy, zz, xy, yz, zx [N/m]
  std::uint32_t status = 0;   ///< StepStatus bits
  std::uint32_t compute_ns =
      0;  ///< time that `step` took; 0 in a run without waiting, so that two such runs are equal
  std::uint8_t grab = 0;    ///< grab button
  std::int32_t patch = -1;  ///< mesh node that the overlay lies round, -1: none
  double handle_position[3] = {};
  double handle_orientation[4] = {1, 0, 0, 0};
  double handle_velocity[3] = {};
  std::uint32_t buttons = 0;
  std::uint32_t sequence = 0;
  std::int64_t arrived_ns = 0;
  std::int64_t begun_ns = 0;
  double shown_force[3] = {};
  double shown_torque[3] = {};
  double share = 1.0;
  std::uint8_t phase = 0;
  std::uint8_t fault = 0;
  std::uint8_t event = 0;
  std::int64_t motion_step = 0;
};

/// What a session was.
struct SessionInfo {
  std::string model_path;
  std::string content_hash;  ///< of the model
  std::string device;
  std::int64_t rate = 1000;
  std::string options;
};

/// Writes a session to HDF5 (`/ticks/time`, `/ticks/tool_position`, ... one extendible dataset a field),
/// under a temporary name until `finish`. Not for the tick: a recorder thread calls it.
class RecordingWriter {
 public:
  /// `model_path` and `content_hash` of the model and what overlays there were ("r=3,rings=2", empty: none)
  /// are kept as attributes, with the program's version. Throws Error when PATH cannot be made.
  RecordingWriter(std::filesystem::path path, const SessionInfo& info);
  ~RecordingWriter();  ///< without `finish`, removes the temporary file
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  void append(std::span<const TickRecord> ticks);
  void finish();  ///< flushes and renames to PATH

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A recorded session.
struct Recording {
  SessionInfo info;
  std::vector<TickRecord> ticks;
};

/// Reads a recording back. Throws Error when it is not one or is damaged.
Recording read_recording(const std::filesystem::path& path);

}  // namespace palpate
