// The C functions of the surface, for the eye.
#include <algorithm>
#include <mutex>

#include "runtime/library/c_error.h"
#include "runtime/library/own_loop.h"
#include "runtime/library/palpate.h"
#include "runtime/library/sized_struct.h"

using namespace palpate;

extern "C" {

int palpate_surface_counts(const palpate_session* session, palpate_counts* counts) noexcept {
  const Inside<OwnLoop> loop = look(session);
  if (!loop) return refused(session);
  const palpate_counts all{.size = sizeof(palpate_counts),
                           .nodes = static_cast<int32_t>(loop->body.surface_rest_positions().size()),
                           .simplices = static_cast<int32_t>(loop->body.surface_friction().size()),
                           .corners = loop->body.dimension()};
  return write_struct(all, counts) ? 0 : -1;
}

int palpate_surface_rest(const palpate_session* session, double* xyz) noexcept {
  const Inside<OwnLoop> loop = look(session);
  if (!loop) return refused(session);
  if (xyz == nullptr) return -1;
  for (const Vec3& position : loop->body.surface_rest_positions()) {
    copy(position, xyz);
    xyz += 3;
  }
  return 0;
}

int palpate_surface_simplices(const palpate_session* session, int32_t* corners) noexcept {
  const Inside<OwnLoop> loop = look(session);
  if (!loop) return refused(session);
  if (corners == nullptr) return -1;
  std::copy(loop->body.simplices().begin(), loop->body.simplices().end(), corners);
  return 0;
}

int palpate_surface_displacement(palpate_session* session, double* xyz) noexcept {
  const Inside<OwnLoop> loop = look(session);
  if (!loop) return refused(session);
  if (xyz == nullptr) return -1;
  const std::lock_guard lock(loop->drawing);
  const Shown& shown = loop->shown.read();
  surface_displacement(loop->body, shown.load, loop->stored_displacement, loop->displacement, &shown.motion);
  for (const Vec3& u : loop->displacement) {
    copy(u, xyz);
    xyz += 3;
  }
  return 0;
}

int64_t palpate_surface_stress(palpate_session* session, float* von_mises, float* pressure) noexcept {
  const Inside<OwnLoop> loop = look(session);
  if (!loop) return -1;
  const std::lock_guard lock(loop->drawing);
  const FoundStress& found = loop->stress.read();
  if (found.tick < 0) return -1;
  const auto nodes = static_cast<std::ptrdiff_t>(loop->displacement.size());
  if (von_mises != nullptr) std::copy_n(found.von_mises.begin(), nodes, von_mises);
  if (pressure != nullptr) std::copy_n(found.pressure.begin(), nodes, pressure);
  return found.tick;
}

}  // extern "C"
