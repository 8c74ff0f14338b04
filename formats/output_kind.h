// Kinds of files that the programs write, and their recognition by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace palpate {

enum class OutputKind : std::uint8_t {
  model,      ///< NAME.palpate.hdf
  recording,  ///< MCAP
  hdf5,       ///< a recording as HDF5, .h5
  frames,     ///< pictures of a recording for ParaView, .xdmf
  report,     ///< of a run, JSON
  contacts,   ///< table of contact points, CSV
  field,      ///< table of displacements, CSV
  grid,       ///< for ParaView, .vtu
  page,       ///< a recording as HTML
  scene,      ///< a recording as glTF, .glb
  series,     ///< a recording as a collection for ParaView, .pvd
  ticks,      ///< table of a recording's ticks, CSV
  faces,      ///< faulty triangles, .off
  surface,    ///< repaired surface, .off
};

/// First lines of our tables.
inline constexpr std::string_view contacts_header = "x,y,z,nx,ny,nz,fx,fy,fz,gap,simplex,held\n";
inline constexpr std::string_view ticks_header =
    "time,device_x,device_y,device_z,device_qw,device_qx,device_qy,device_qz,"
    "tool_x,tool_y,tool_z,tool_qw,tool_qx,tool_qy,tool_qz,"
    "force_x,force_y,force_z,torque_x,torque_y,torque_z,shown_force_x,shown_force_y,shown_force_z,"
    "contacts,grab,status,compute_ns,force_error,left_out\n";

/// Name of a kind in messages: "table of contact points".
[[nodiscard]] std::string_view name_of(OutputKind kind) noexcept;

/// Endings of this kind, ".json", in small letters; the usual one first.
[[nodiscard]] std::span<const std::string_view> endings_of(OutputKind kind) noexcept;

/// True if the programs can write it only to a regular file, not to a pipe.
[[nodiscard]] bool needs_regular_file(OutputKind kind) noexcept;

/// True if a regular file is empty or an output of ours of this kind, so that replacing it destroys no other
/// data. By content. False if it cannot be read.
[[nodiscard]] bool is_ours(const std::filesystem::path& file, OutputKind kind);

/// True if a recording of ours holds ticks, which no other run can reproduce, or is damaged.
[[nodiscard]] bool holds_ticks(const std::filesystem::path& recording);

}  // namespace palpate
