// What a recording has of a session.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// What is kept of one tick. Names with "device" are in the body's frame; names with "handle" or "shown" in
/// the device's own. The reference of the book shows these comments.
struct TickRecord {
  double time = 0.0;                            ///< since the start of the run [s]
  double device_position[3] = {};               ///< where the device wants the tool, in the body's frame [m]
  double device_orientation[4] = {1, 0, 0, 0};  ///< how the device wants the tool turned: w, x, y, z
  /// where the tool is: outside of the body, and with a coupling not where the device is [m]
  double tool_position[3] = {};
  double tool_orientation[4] = {1, 0, 0, 0};  ///< how the tool is turned: w, x, y, z
  /// the opposite of what the hand feels: the force on the body, except where it is limited or handed over
  /// (see `status`) [N]
  double force[3] = {};
  double torque[3] = {};      ///< on the body, about the tool's origin [N m]
  std::int32_t contacts = 0;  ///< closed contact points
  double stiffness[6] = {};   ///< that the hand feels: xx, yy, zz, xy, yz, zx [N/m]
  std::uint32_t status = 0;   ///< status bits of the tick (StepStatus)
  /// time that `step` took [ns]; 0 with `--fast`, so that two such runs are equal
  std::uint32_t compute_ns = 0;
  std::uint8_t grab = 0;    ///< 1 while the grab button is pressed
  std::int32_t patch = -1;  ///< mesh node that the overlay is centred on; -1: none

  double handle_position[3] = {};               ///< of the handle, as the device reports it [m]
  double handle_orientation[4] = {1, 0, 0, 0};  ///< of the handle: w, x, y, z
  double handle_velocity[3] = {};               ///< of the handle [m/s]
  std::uint32_t buttons = 0;                    ///< of the device, one bit each
  std::uint32_t sequence = 0;                   ///< number of the device's report
  std::int64_t arrived_ns = 0;                  ///< when that report arrived, since the start of the run [ns]
  /// when the tick began, since the start of the run [ns]; with `--fast` when it was due
  std::int64_t begun_ns = 0;
  double shown_force[3] = {};   ///< what the device was commanded to exert on the hand [N]
  double shown_torque[3] = {};  ///< what the device was commanded to exert on the hand [N m]
  double share = 1.0;           ///< of the force that the safety rules let pass, 0 to 1
  std::uint8_t phase = 0;       ///< of safety (SafetyPhase)
  std::uint8_t fault = 0;       ///< of safety (Fault)
  /// what happened before the tick: 1 restart, 2 device lost, 4 fault acknowledged, 8 input lost, 16 tool
  /// lifted, 32 resumed after a pause
  std::uint8_t event = 0;
  std::int64_t motion_step = 0;  ///< packed dynamics: the last step whose answer had arrived

  /// estimate of the error of `force` where the tick was a best effort, else 0 [N]
  float force_error = 0.0F;
  /// contact points that the tool pressed on and that found no room
  std::int32_t left_out = 0;
  /// what `force` may be off by at most as compressed Green's functions are not exact; 0 where they are [N]
  float greens_error = 0.0F;
};

/// The surface of the body at one moment.
struct SurfaceFrame {
  std::int64_t tick = 0;
  double time = 0.0;                  ///< since the start of the run [s]
  std::vector<float> displacement{};  ///< [S x 3] node + displacement is what is seen [m]
  std::vector<float> von_mises{};     ///< [S] stress [Pa]; not a number where it is not known
  std::vector<float> pressure{};      ///< [S] of the contact [Pa]
};

/// The surface that the frames displace.
struct RecordedSurface {
  std::vector<Vec3> nodes;           ///< [S] without loads [m]
  int corners = 3;                   ///< d: of a simplex, 3 of a triangle, in the plane 2 of a line
  std::vector<Index> simplices;      ///< [T x d]
  std::vector<std::uint8_t> held{};  ///< [S] as Model::fixed; empty where it is not known
};

/// What was recorded.
struct SessionInfo {
  std::string model_path;
  std::string content_hash;  ///< of the model
  std::string device;        ///< the hand, as text
  std::int64_t rate = 1000;  ///< ticks per second
  std::string options;       ///< lines "name=value\n"
};

/// What contacts put on the surface at one moment: with the model, all of its picture follows from that.
struct ContactLoads {
  std::int64_t tick = 0;
  double time = 0.0;           ///< since the start of the run [s]
  std::vector<Index> node{};   ///< [n] loaded surface nodes, each once, ascending
  std::vector<float> force{};  ///< [n x 3] on the body [N]
  std::vector<float> press{};  ///< [n] what contact points press with along their normals [N]
};

/// When the surface was looked at.
struct PictureTime {
  std::int64_t tick = 0;
  double time = 0.0;  ///< since the start of the run [s]
};

/// Something that happened, in words.
struct RecordedEvent {
  double time = 0.0;  ///< since the start of the run [s]
  std::string text;
};

}  // namespace palpate
