#include "runtime/gallery/gallery_scene.h"

#include <algorithm>
#include <cstddef>

#include "base/error.h"
#include "formats/model_file.h"
#include "formats/recording.h"
#include "meshes/surface.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/loop/recorded_pictures.h"
#include "runtime/scene/scene.h"
#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

constexpr std::uint32_t only_scene = 1;

/// Surface of a body in space at rest.
RecordedSurface surface_at_rest(const Model& model) {
  SurfaceNumbering numbering = number_surface(model.surface, model.mesh.nodes.size());
  RecordedSurface surface;
  surface.simplices = std::move(numbering.simplices);
  for (const Index node : numbering.mesh_nodes) {
    const auto at = static_cast<std::size_t>(node);
    surface.nodes.push_back(model.mesh.nodes[at] + model.rest_displacement[at]);
    surface.held.push_back(model.fixed[at]);
  }
  return surface;
}

/// Returns the picture of the tick with the largest force, among ticks that have one.
std::int64_t telling_picture(const RecordingFile& recording) {
  double largest = -1.0, time = 0.0;
  for (std::int64_t row = 0; row < recording.ticks(); ++row) {
    const TickRecord tick = recording.tick(row);
    const double felt = Vec3(tick.force).squaredNorm();
    if (felt <= largest) continue;
    largest = felt;
    time = tick.time;
  }
  const std::vector<PictureTime>& pictures = recording.pictures();
  const auto after = std::ranges::lower_bound(pictures, time, {}, &PictureTime::time);
  return std::min(after - pictures.begin(), std::ssize(pictures) - 1);
}

/// Surface in that picture; at rest if it cannot be computed, since the model may be gone.
RecordedSurface surface_as_pressed(const RecordingFile& file) {
  RecordedSurface surface = file.surface();
  if (file.pictures().empty() || surface.nodes.empty())
    throw Error("has no pictures of the surface", "recording", "record it without --record-frames 0");
  SurfaceFrame frame;
  try {
    frame = RecordedPictures(file).frame(telling_picture(file));
  } catch (const Error&) {
    if (file.stores_pictures()) throw;
    return surface;
  }
  for (std::size_t i = 0; i < surface.nodes.size(); ++i)
    surface.nodes[i] += Eigen::Map<const Eigen::Vector3f>(frame.displacement.data() + 3 * i).cast<double>();
  return surface;
}

}  // namespace

std::string gallery_scene(const std::filesystem::path& file) {
  const std::optional<GalleryKind> kind = gallery_kind(file.filename().string());
  if (kind == GalleryKind::body) {
    const Model model = load_outline(file);
    return encode_scene(model.dimension() == 2 ? make_plane_scene(model, only_scene)
                                               : make_scene(surface_at_rest(model), only_scene));
  }
  if (kind == GalleryKind::recording)
    return encode_scene(make_scene(surface_as_pressed(RecordingFile(file)), only_scene));
  throw Error("has no picture before a body is made of it", file.filename().string(), "open it");
}

}  // namespace palpate
