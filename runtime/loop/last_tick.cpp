#include "runtime/loop/last_tick.h"

#include <fmt/core.h>

#include <span>
#include <vector>

#include "formats/output_kind.h"
#include "meshes/readers/vtu_writer.h"
#include "runtime/background/surface_frames.h"

namespace palpate {

std::string contact_table(const Body& body, const State& state) {
  std::string table(contacts_header);
  const std::span<const ContactPoint> contacts = state.contacts();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactPoint& contact = contacts[k];
    const auto [x, n, f, held] = seen_contact(body, state, contact);
    const bool is_left_out = state.scratch.problem.rows_of(static_cast<Index>(k)) == 0;
    const double gap = held          ? 0.0
                       : is_left_out ? contact.gap
                                     : state.scratch.problem.gap(static_cast<Index>(k));
    const auto add_row = [&, held = held](const Vec3& place, const Vec3& normal, const Vec3& force) {
      table += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", place.x(), place.y(), place.z(),
                           normal.x(), normal.y(), normal.z(), force.x(), force.y(), force.z(), gap,
                           contact.simplex, held ? 1 : 0);
    };
    if (contact.aggregate < 0) {
      add_row(x, n, f);
      continue;
    }
    const Index place = state.surface.near.place_of(body.aggregate_node(contact.aggregate));
    state.surface.near.for_each_member(place, [&](Index node, double, const Eigen::Matrix3d& map) {
      add_row(state.surface.tree.position(node), (map * n).normalized(), map * f);
    });
  }
  return table;
}

std::vector<Vec3> displacement_from_mesh(const Body& body, const State& state) {
  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  std::vector<Vec3> u(body.surface_rest_positions().size());
  MotionSnapshot motion(body);
  state.surface.motion.snapshot(motion);
  surface_displacement(body, state.surface.near.load(), stored, u, &motion);
  const std::vector<Vec3> mesh = body.surface_in_mesh();
  for (std::size_t node = 0; node < u.size(); ++node)
    u[node] = body.surface_rest_positions()[node] + u[node] - mesh[node];
  return u;
}

void write_surface(const std::filesystem::path& file, const Body& body, const State& state) {
  std::vector<double> total;
  for (const Vec3& u : displacement_from_mesh(body, state)) total.insert(total.end(), u.begin(), u.end());
  SurfacePicture picture;
  SurfaceFrames(body, state, {.ticks_per_frame = 1, .in_background = false}, [&](SurfacePicture shown) {
    picture = std::move(shown);
  }).post(state, 0, 0.0);
  const std::vector<double> von_mises(picture.frame.von_mises.begin(), picture.frame.von_mises.end());
  const std::vector<double> pressure(picture.frame.pressure.begin(), picture.frame.pressure.end());
  const std::vector<NodalField> fields = {
      {"displacement", 3, total}, {"von_mises", 1, von_mises}, {"pressure", 1, pressure}};
  write_vtu(file, body.surface_in_mesh(), body.dimension() == 3 ? ElementType::tri3 : ElementType::line2,
            body.simplices(), fields);
}

}  // namespace palpate
