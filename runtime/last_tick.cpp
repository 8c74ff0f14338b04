#include "runtime/last_tick.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "meshes/vtu_writer.h"

namespace palpate {
namespace {

/// Where the surface is now at a contact.
Vec3 surface_position(const State& state, const ContactPoint& contact) {
  Vec3 position = Vec3::Zero();
  for (std::size_t k = 0; k < contact.nodes.size(); ++k) {
    if (contact.nodes[k] >= 0) position += contact.weights[k] * state.tree.position(contact.nodes[k]);
  }
  return position;
}

/// The gap that the tick left, to first order: the contact's normal row of r = b + W lambda.
double gap_after(const ContactProblem& problem, Index contact) {
  const Index normal = problem.first_row(contact);
  double gap = problem.b[static_cast<std::size_t>(normal)];
  for (Index j = 0; j < problem.rows; ++j)
    gap += problem.w(normal, j) * problem.lambda[static_cast<std::size_t>(j)];
  return gap;
}

}  // namespace

std::string contact_table(const Body& body, const State& state) {
  std::string table = "x,y,z,nx,ny,nz,fx,fy,fz,gap,simplex,held\n";
  const std::span<const ContactPoint> contacts = state.contacts();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactPoint& contact = contacts[k];
    const Vec3 x = surface_position(state, contact);
    const Vec3 n = contact.held ? outward_normal(body, state, contact.simplex) : Vec3(contact.frame.col(0));
    const Vec3 f = Vec3::Zero() - contact.force;
    const double gap = contact.held ? 0.0 : gap_after(state.problem, static_cast<Index>(k));
    table += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", x.x(), x.y(), x.z(), n.x(), n.y(), n.z(),
                         f.x(), f.y(), f.z(), gap, contact.simplex, contact.held ? 1 : 0);
  }
  return table;
}

void write_surface(const std::filesystem::path& file, const Body& body, const State& state) {
  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  std::vector<Vec3> u(body.surface_rest_positions().size());
  ShownMotion motion(body);
  state.motion.show(motion);
  surface_displacement(body, state.near.load(), stored, u, &motion);
  const std::vector<Vec3> nodes = body.surface_in_mesh();
  std::vector<double> total;
  for (std::size_t node = 0; node < u.size(); ++node) {
    const Vec3 seen = body.surface_rest_positions()[node] + u[node] - nodes[node];
    total.insert(total.end(), seen.begin(), seen.end());
  }
  const std::vector<NodalField> fields = {{"displacement", 3, total}};
  write_vtu(file, nodes, body.dimension() == 3 ? ElementType::tri3 : ElementType::line2, body.simplices(),
            fields);
}

}  // namespace palpate
