#include "runtime/app/session_pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "runtime/app/run_state.h"
#include "runtime/loop/session_check.h"
#include "runtime/loop/settings.h"

namespace palpate {
namespace {

constexpr std::int64_t most_samples = 100'000;

Eigen::Quaterniond quaternion_of(const double (&wxyz)[4]) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

std::int64_t number_of(const TickRecord& tick, std::int64_t rate) {
  return std::llround(tick.time * static_cast<double>(rate));
}

TickNote note_of(const TickRecord& tick, std::int64_t rate) {
  const std::int64_t number = number_of(tick, rate);
  const auto due = std::llround(static_cast<double>(number) * 1e9 / static_cast<double>(rate));
  return {.number = number,
          .lateness_ns = tick.begun_ns - due,
          .compute_ns = tick.compute_ns,
          .force = Vec3(tick.force),
          .shown = Vec3(tick.shown_force).norm(),
          .depth = std::numeric_limits<double>::quiet_NaN(),  // is not recorded
          .contacts = tick.contacts,
          .status = static_cast<StepStatus>(tick.status),
          .force_error = tick.force_error,
          .left_out = tick.left_out,
          .phase = static_cast<SafetyPhase>(tick.phase),
          .fault = static_cast<Fault>(tick.fault)};
}

RecordingFile with_pictures(RecordingFile file) {
  if (file.pictures().empty() || file.surface().nodes.empty()) {
    throw Error("has no pictures of the surface", file.path().string(),
                "record it again without --record-frames 0; palpate-runtime session tells what is in it");
  }
  return file;
}

}  // namespace

SessionPictures::SessionPictures(const std::filesystem::path& path)
    : file_(with_pictures(open_session(path))), pictures_(file_) {}

std::vector<double> SessionPictures::times() const {
  std::vector<double> times;
  for (const PictureTime& picture : file_.pictures()) times.push_back(picture.time);
  return times;
}

/// Returns the tick with this number, or the last one before it; empty if there is none.
std::optional<TickRecord> SessionPictures::tick(std::int64_t number) const {
  const std::int64_t rate = file_.info().rate;
  std::int64_t row = std::min(number, file_.ticks() - 1);  // if no tick is missing
  if (row < 0) return std::nullopt;
  TickRecord found = file_.tick(row);
  if (number_of(found, rate) <= number) return found;
  std::int64_t end = row;  // after the wanted one
  for (row = -1; end - row > 1;) {
    const std::int64_t middle = row + (end - row) / 2;
    found = file_.tick(middle);
    (number_of(found, rate) <= number ? row : end) = middle;
  }
  if (row < 0) return std::nullopt;
  return file_.tick(row);
}

SurfacePicture SessionPictures::picture(std::int64_t frame) const {
  SurfacePicture picture;
  picture.frame = pictures_.frame(frame);
  if (const std::optional<TickRecord> then = tick(picture.frame.tick)) {
    picture.device = {.orientation = quaternion_of(then->device_orientation),
                      .position = Vec3(then->device_position),
                      .grab = then->grab != 0};
    picture.tool = {.orientation = quaternion_of(then->tool_orientation),
                    .position = Vec3(then->tool_position),
                    .grab = then->grab != 0};
    picture.on_body = {.force = Vec3(then->force), .torque = Vec3(then->torque)};
    picture.status = static_cast<StepStatus>(then->status);
    picture.force_error = then->force_error;
    picture.left_out = then->left_out;
    picture.greens_error = then->greens_error;
  }
  return picture;
}

std::string SessionPictures::name() const {
  std::string name = std::filesystem::path(file_.info().model_path).filename().string();
  if (const std::size_t suffix = name.find(".palpate.hdf"); suffix != std::string::npos) name.resize(suffix);
  return name;
}

Tool SessionPictures::tool() const {
  return read_settings(split_settings(file_.info().options)).tool;
}

nlohmann::json SessionPictures::state(const std::vector<double>& times) const {
  using nlohmann::json;
  const RecordedSurface& surface = file_.surface();
  Eigen::AlignedBox3d bounds;
  for (const Vec3& node : surface.nodes) bounds.extend(node);
  const auto point = [](const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); };
  RunState state;
  state.model = {{"name", name()},
                 {"file", file_.info().model_path},
                 {"dimension", surface.corners},
                 {"nodes", nullptr},
                 {"surface_nodes", surface.nodes.size()},
                 {"elements", nullptr},
                 {"dofs", nullptr},
                 {"element", nullptr},
                 {"size", bounds.diagonal().norm()},
                 {"bounds", {point(bounds.min()), point(bounds.max())}},
                 {"moves", false},
                 {"loads", false}};
  state.defaults = {{"radius", 0.0}, {"reach", 0.0}, {"friction", 0.0}, {"depth", 0.0}};
  state.device = file_.info().device;
  state.rate = file_.info().rate;
  state.ticks = file_.ticks();
  state.locked = "this is a recording";
  state.settings = split_settings(file_.info().options);
  json told = to_json(state);
  told.update({{"session", file_.path().filename().string()},
               {"frames", times.size()},
               {"frame", 0},
               {"duration", times.empty() ? 0.0 : times.back()},
               {"times", times}});
  return told;
}

std::vector<TickRun> SessionPictures::ticks() const {
  const std::int64_t rate = file_.info().rate;
  const std::int64_t stride = (file_.ticks() + most_samples - 1) / most_samples;
  std::vector<TickRun> runs;
  for (std::int64_t k = 0; k < file_.ticks(); k += stride) {
    const TickNote note = note_of(file_.tick(k), rate);
    if (runs.empty() || note.number != runs.back().notes.back().number + stride)
      runs.push_back({.notes = {}, .stride = stride});
    runs.back().notes.push_back(note);
  }
  return runs;
}

}  // namespace palpate
