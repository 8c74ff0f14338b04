#include "runtime/exports/vtu_series.h"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <vector>

#include "base/words.h"
#include "meshes/readers/vtu_writer.h"

namespace palpate {

std::string frame_vtu(const RecordedSurface& surface, const SurfaceFrame& frame) {
  const std::size_t nodes = surface.nodes.size();
  const std::vector<double> displacement(frame.displacement.begin(), frame.displacement.end());
  std::vector<double> von_mises(frame.von_mises.begin(), frame.von_mises.end());
  std::vector<double> pressure(frame.pressure.begin(), frame.pressure.end());
  von_mises.resize(nodes, std::numeric_limits<double>::quiet_NaN());  // recordings before 4.1 have none
  pressure.resize(nodes, std::numeric_limits<double>::quiet_NaN());
  std::vector<Vec3> positions = surface.nodes;
  for (std::size_t node = 0; node < nodes; ++node)
    positions[node] += Eigen::Map<const Vec3>(&displacement[3 * node]);
  const std::array<NodalField, 3> fields = {
      {{"displacement", 3, displacement}, {"von_mises", 1, von_mises}, {"pressure", 1, pressure}}};
  return vtu_text(positions, surface.corners == 3 ? ElementType::tri3 : ElementType::line2, surface.simplices,
                  fields);
}

std::string frame_name(std::size_t number) {
  return fmt::format("{:05}.vtu", number);
}

std::string series_pvd(const std::filesystem::path& folder, std::span<const SurfacePicture> pictures) {
  std::string text = "<?xml version=\"1.0\"?>\n<!-- palpate " PALPATE_VERSION
                     " -->\n<VTKFile type=\"Collection\" "
                     "version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    text += fmt::format("<DataSet timestep=\"{}\" file=\"{}\"/>\n", pictures[k].frame.time,
                        xml_escaped((folder / frame_name(k)).string()));
  }
  return text + "</Collection>\n</VTKFile>\n";
}

}  // namespace palpate
