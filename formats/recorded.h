// Data of a recorded session.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Record of one tick. Names with "device" are in the body's frame; names with "handle" or "shown" in the
/// device's own. The reference of the book shows these comments.
struct TickRecord {
  double time = 0.0;                            ///< since the start of the run [s]
  double device_position[3] = {};               ///< position that the device asks of the tool, in the body's
                                                ///< frame [m]
  double device_orientation[4] = {1, 0, 0, 0};  ///< orientation that the device asks of the tool: w, x, y, z
  /// position of the tool: outside of the body, and with a coupling not where the device is [m]
  double tool_position[3] = {};
  double tool_orientation[4] = {1, 0, 0, 0};  ///< orientation of the tool: w, x, y, z
  /// opposite of the force that the hand feels: the force on the body, except where it is limited or handed
  /// over (see `status`) [N]
  double force[3] = {};
  double torque[3] = {};      ///< on the body, about the tool's origin [N m]
  std::int32_t contacts = 0;  ///< closed contact points
  double stiffness[6] = {};   ///< stiffness that the hand feels: xx, yy, zz, xy, yz, zx [N/m]
  std::uint32_t status = 0;   ///< status bits of the tick (StepStatus)
  /// duration of `step` [ns]; 0 with `--fast`, so that two such runs are equal
  std::uint32_t compute_ns = 0;
  std::uint8_t grab = 0;    ///< 1 while the grab button is pressed
  std::int32_t patch = -1;  ///< mesh node that the overlay is centred on; -1: none

  double handle_position[3] = {};               ///< position of the handle, as the device reports it [m]
  double handle_orientation[4] = {1, 0, 0, 0};  ///< orientation of the handle: w, x, y, z
  double handle_velocity[3] = {};               ///< velocity of the handle [m/s]
  std::uint32_t buttons = 0;                    ///< buttons of the device, one bit each
  std::uint32_t sequence = 0;                   ///< number of the device's report
  std::int64_t arrived_ns = 0;                  ///< arrival of that report, since the start of the run [ns]
  /// start of the tick, since the start of the run [ns]; with `--fast` its due time
  std::int64_t begun_ns = 0;
  double shown_force[3] = {};   ///< force that the device was commanded to exert on the hand [N]
  double shown_torque[3] = {};  ///< torque that the device was commanded to exert on the hand [N m]
  double share = 1.0;           ///< fraction of the force that the safety rules let pass, 0 to 1
  std::uint8_t phase = 0;       ///< phase of safety (SafetyPhase)
  std::uint8_t fault = 0;       ///< fault of safety (Fault)
  /// events before the tick: 1 restart, 2 device lost, 4 fault acknowledged, 8 input lost, 16 tool lifted, 32
  /// resumed after a pause
  std::uint8_t event = 0;
  std::int64_t motion_step = 0;  ///< packed dynamics: last step whose result had arrived

  /// estimated error of `force` if the tick was a best effort, else 0 [N]
  float force_error = 0.0F;
  /// contact points that the tool pressed on but that exceeded the capacity
  std::int32_t left_out = 0;
  /// bound of the error of `force` that compressed Green's functions cause; 0 if they are exact [N]
  float greens_error = 0.0F;
  /// body on two levels: by which small strain has more force for the places of the last balance, as a
  /// fraction of it; else 0
  float small_strain = 0.0F;
};

/// Surface of the body at one moment.
struct SurfaceFrame {
  std::int64_t tick = 0;
  double time = 0.0;                  ///< since the start of the run [s]
  std::vector<float> displacement{};  ///< [S x 3] displacement from the nodes to the visible positions [m]
  std::vector<float> von_mises{};     ///< [S] stress [Pa]; NaN where unknown
  std::vector<float> pressure{};      ///< [S] of the contact [Pa]
};

/// Surface whose nodes the frames displace.
struct RecordedSurface {
  std::vector<Vec3> nodes;           ///< [S] positions without loads [m]
  int corners = 3;                   ///< corners of a simplex d: 3 for triangles, 2 for lines in the plane
  std::vector<Index> simplices;      ///< [T x d]
  std::vector<std::uint8_t> held{};  ///< [S] as Model::fixed; empty if unknown
  std::vector<Vec3> finer{};         ///< further nodes that tools press on, numbered behind the others [m]

  [[nodiscard]] std::size_t pressed_nodes() const noexcept { return nodes.size() + finer.size(); }
};

/// Description of a session.
struct SessionInfo {
  std::string model_path;
  std::string content_hash;  ///< content hash of the model
  std::string device;        ///< the hand, as text
  std::int64_t rate = 1000;  ///< ticks per second
  std::string options;       ///< lines "name=value\n"
};

/// Loads of the contacts on the surface at one moment; the model and these determine its picture.
struct ContactLoads {
  std::int64_t tick = 0;
  double time = 0.0;           ///< since the start of the run [s]
  std::vector<Index> node{};   ///< [n] loaded surface nodes, each once, ascending
  std::vector<float> force{};  ///< [n x 3] on the body [N]
  std::vector<float> press{};  ///< [n] normal force of the contact points [N]
  std::vector<float> field{};  ///< [n_q] coarse field of a body on two levels [m]; empty for others
};

/// Time of a picture of the surface.
struct PictureTime {
  std::int64_t tick = 0;
  double time = 0.0;  ///< since the start of the run [s]
};

/// An event in words.
struct RecordedEvent {
  double time = 0.0;  ///< since the start of the run [s]
  std::string text;
};

}  // namespace palpate
