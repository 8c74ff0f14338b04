// Palpate in your own loop, in C++17: owners and exceptions on top of palpate.h, which documents the meaning.
// Header only. Link libpalpate as for C.
#ifndef PALPATE_HPP
#define PALPATE_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate.h"

namespace palpate {

/// Failure of a function: reason (`what`) and remedy (`hint`).
class Error : public std::runtime_error {
 public:
  /// Parses the text of palpate_create: lines "error: ..." and "hint: ..."; `code` is one of palpate_code.
  explicit Error(std::string_view told, int code = palpate_last_code())
      : std::runtime_error(part(told, "error: ")), hint_(part(told, "hint: ")), code_(code) {}
  [[nodiscard]] const std::string& hint() const noexcept { return hint_; }
  [[nodiscard]] int code() const noexcept { return code_; }

 private:
  static std::string part(std::string_view told, std::string_view name) {
    const std::size_t begin = told.find(name);
    if (begin == std::string_view::npos) return {};
    told.remove_prefix(begin + name.size());
    return std::string(told.substr(0, told.find('\n')));
  }

  std::string hint_;
  int code_;
};

/// Calls a function of palpate.h that writes its reason into a text of this size. Throws Error if it fails.
template <class Call>
void check(Call&& call) {
  std::string error(4096, '\0');
  if (const int code = call(error.data(), error.size()); code != PALPATE_OK) throw Error(error.c_str(), code);
}

/// Returns a file name for C. Throws Error if it has a zero byte, at which C would cut it.
inline const char* c_name(const std::string& file) {
  if (file.find('\0') == std::string::npos) return file.c_str();
  throw Error("error: a file's name has a zero byte\nhint: Leave it out\n", PALPATE_ERROR_ARGUMENT);
}

/// Returns the names of the status bits of a tick.
inline std::vector<std::string> status_names(std::uint32_t status) {
  std::vector<std::string> names;
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
    const char* name = (status & bit) != 0 ? palpate_status_name(bit) : nullptr;
    if (name != nullptr) names.emplace_back(name);
  }
  return names;
}

/// Returns a tool with palpate.h's defaults: a point, or a sphere of `radius` [m].
inline palpate_tool make_tool(double radius = 0.0) {
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = radius;
  return tool;
}

/// Returns a pose at a position [m], without rotation.
inline palpate_pose make_pose(double x, double y, double z, bool grab = false) {
  palpate_pose pose = PALPATE_POSE_INIT;
  pose.position[0] = x;
  pose.position[1] = y;
  pose.position[2] = z;
  pose.grab = grab ? 1 : 0;
  return pose;
}

inline palpate_options make_options() {
  return PALPATE_OPTIONS_INIT;
}

/// Latest stress and pressure at the surface nodes.
struct SurfaceStress {
  std::int64_t tick = -1;        ///< tick that they belong to, from 0; -1: none yet
  std::vector<float> von_mises;  ///< [nodes] [Pa]; NaN where unknown
  std::vector<float> pressure;   ///< [nodes] [Pa]
};

/// Body with the tools that touch it. Threads as in palpate.h: one steps, others may draw.
class Session {
 public:
  /// Loads a baked file. Throws Error.
  Session(const std::string& file, const std::vector<palpate_tool>& tools, int max_contacts = 32,
          const palpate_options& options = make_options())
      : tools_(tools.size()) {
    std::string error(4096, '\0');
    session_.reset(palpate_create_with_options(c_name(file), tools.data(), static_cast<int>(tools.size()),
                                               max_contacts, &options, error.data(), error.size()));
    if (session_ == nullptr) throw Error(error.c_str());
  }
  Session(const std::string& file, const palpate_tool& tool, int max_contacts = 32,
          const palpate_options& options = make_options())
      : Session(file, std::vector<palpate_tool>{tool}, max_contacts, options) {}

  [[nodiscard]] std::size_t tools() const noexcept { return tools_; }

  /// Performs one tick of a session with one tool and returns status bits. With more tools nothing happens
  /// and it returns PALPATE_POSE_NOT_FINITE. Real-time safe.
  std::uint32_t step(const palpate_pose& pose) noexcept { return step(&pose, 1); }
  /// Performs one tick with a pose for each tool and returns status bits. With another number of poses
  /// nothing happens and it returns PALPATE_POSE_NOT_FINITE. Real-time safe.
  std::uint32_t step(const std::vector<palpate_pose>& poses) noexcept {
    return step(poses.data(), poses.size());
  }

  /// Returns the forces and pose of a tool since the last tick; all zero if there is no such tool. Real-time
  /// safe.
  [[nodiscard]] palpate_result felt(int tool = 0) const noexcept {
    palpate_result result = PALPATE_RESULT_INIT;
    palpate_get(session_.get(), tool, &result);
    return result;
  }

  /// Returns the contacts between a tool and the surface; empty if there is no such tool. Allocates.
  [[nodiscard]] std::vector<palpate_contact> contacts(int tool = 0) const {
    std::vector<palpate_contact> found(static_cast<std::size_t>(felt(tool).contacts), PALPATE_CONTACT_INIT);
    int count = 0;
    palpate_get_contacts(session_.get(), tool, found.data(), static_cast<int>(found.size()), &count);
    return found;
  }

  /// Changes a tool from the next tick on; false if the change is not allowed. Real-time safe.
  bool set_tool(int number, const palpate_tool& tool) noexcept {
    return palpate_set_tool(session_.get(), number, &tool) == 0;
  }

  void reset() noexcept { palpate_reset(session_.get()); }

  /// Starts recording each tick of a tool, from the untouched body. Throws Error.
  void record(const std::string& file, double pictures = 60.0, int tool = 0) {
    palpate_record_options options = PALPATE_RECORD_OPTIONS_INIT;
    options.tool = tool;
    options.pictures = pictures;
    check([&, name = c_name(file)](char* error, std::size_t size) {
      return palpate_record(session_.get(), name, &options, error, size);
    });
  }
  /// Ends the recording. Throws Error.
  void end_recording() {
    check([&](char* error, std::size_t size) { return palpate_record_end(session_.get(), error, size); });
  }

  /// Positions of the surface nodes at rest [3 nodes] [m].
  [[nodiscard]] std::vector<double> rest() const {
    std::vector<double> xyz(3 * nodes());
    palpate_surface_rest(session_.get(), xyz.data());
    return xyz;
  }

  /// Nodes of the triangles (in the plane: lines) [corners x simplices].
  [[nodiscard]] std::vector<std::int32_t> simplices() const {
    const palpate_counts all = counts();
    std::vector<std::int32_t> corners(static_cast<std::size_t>(all.corners) *
                                      static_cast<std::size_t>(all.simplices));
    palpate_surface_simplices(session_.get(), corners.data());
    return corners;
  }

  /// Displacement of the surface nodes in the last tick [3 nodes] [m].
  [[nodiscard]] std::vector<double> displacement() {
    std::vector<double> xyz(3 * nodes());
    palpate_surface_displacement(session_.get(), xyz.data());
    return xyz;
  }

  /// Returns stress and pressure as computed every options.stress_ticks.
  [[nodiscard]] SurfaceStress stress() {
    SurfaceStress found{-1, std::vector<float>(nodes()), std::vector<float>(nodes())};
    found.tick = palpate_surface_stress(session_.get(), found.von_mises.data(), found.pressure.data());
    return found;
  }

  [[nodiscard]] palpate_counts counts() const noexcept {
    palpate_counts all = PALPATE_COUNTS_INIT;
    palpate_surface_counts(session_.get(), &all);
    return all;
  }

  /// Returns the session for the functions of palpate.h.
  [[nodiscard]] palpate_session* get() noexcept { return session_.get(); }

 private:
  struct End {
    void operator()(palpate_session* session) const noexcept { palpate_destroy(session); }
  };

  std::uint32_t step(const palpate_pose* poses, std::size_t count) noexcept {
    return palpate_step(session_.get(), count == tools_ ? poses : nullptr);
  }

  [[nodiscard]] std::size_t nodes() const noexcept { return static_cast<std::size_t>(counts().nodes); }

  std::size_t tools_;
  std::unique_ptr<palpate_session, End> session_;
};

/// Recording that is read back.
class Recording {
 public:
  /// Opens a recording. Throws Error.
  explicit Recording(const std::string& file) {
    std::string error(4096, '\0');
    recording_.reset(palpate_recording_open(c_name(file), error.data(), error.size()));
    if (recording_ == nullptr) throw Error(error.c_str());
  }

  [[nodiscard]] palpate_recording_counts counts() const noexcept {
    palpate_recording_counts all = PALPATE_RECORDING_COUNTS_INIT;
    palpate_recording_count(recording_.get(), &all);
    return all;
  }

  /// Returns tick 0, 1, ...; all zero if there is none. Reads the file.
  [[nodiscard]] palpate_recorded_tick tick(std::int64_t number) const noexcept {
    palpate_recorded_tick told = PALPATE_RECORDED_TICK_INIT;
    palpate_recording_tick(recording_.get(), number, &told);
    return told;
  }

  /// Returns the displacement of the surface nodes in picture 0, 1, ... [3 nodes] [m]. Throws Error.
  [[nodiscard]] std::vector<float> picture(std::int64_t number) const {
    std::vector<float> xyz(3 * static_cast<std::size_t>(counts().nodes));
    check([&](char* error, std::size_t size) {
      return palpate_recording_picture(recording_.get(), number, xyz.data(), nullptr, error, size);
    });
    return xyz;
  }

  /// Returns the recording for the functions of palpate.h.
  [[nodiscard]] palpate_recording* get() noexcept { return recording_.get(); }

 private:
  struct Close {
    void operator()(palpate_recording* recording) const noexcept { palpate_recording_close(recording); }
  };

  std::unique_ptr<palpate_recording, Close> recording_;
};

}  // namespace palpate
#endif
