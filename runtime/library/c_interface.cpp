// C functions of palpate.h, on top of the C++ step.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/seen_contact.h"
#include "runtime/core/tick/step.h"
#include "runtime/library/c_error.h"
#include "runtime/library/own_loop.h"
#include "runtime/library/palpate.h"
#include "runtime/library/sized_struct.h"
#include "runtime/loop/loading.h"
#include "runtime/loop/settings.h"
#include "runtime/safety/monotonic_clock.h"

namespace palpate {
namespace {

constexpr bool same(int bit, StepStatus status) {
  return static_cast<std::uint32_t>(bit) == static_cast<std::uint32_t>(status);
}
static_assert(same(PALPATE_NOTHING_IN_REACH, StepStatus::nothing_in_reach));
static_assert(same(PALPATE_CAPACITY_FULL, StepStatus::capacity_full));
static_assert(same(PALPATE_UNSETTLED, StepStatus::unsettled));
static_assert(same(PALPATE_POSE_NOT_FINITE, StepStatus::pose_not_finite));
static_assert(same(PALPATE_RESULT_NOT_FINITE, StepStatus::result_not_finite));
static_assert(same(PALPATE_INSIDE_BODY, StepStatus::inside_body));
static_assert(same(PALPATE_POSE_LIMITED, StepStatus::pose_limited));
static_assert(same(PALPATE_NOT_CONVERGED, StepStatus::not_converged));
static_assert(same(PALPATE_FORCE_LIMITED, StepStatus::force_limited));
static_assert(same(PALPATE_HANDING_OVER, StepStatus::handing_over));
static_assert(same(PALPATE_OLDER_PATCH, StepStatus::older_patch));
static_assert(same(PALPATE_LATE_MOTION, StepStatus::late_motion));
static_assert(same(PALPATE_RIGID_CONTACT, StepStatus::rigid_contact));
static_assert(same(PALPATE_UNBALANCED, StepStatus::unbalanced));
static_assert(status_names.size() == 14, "these");

constexpr int most_contacts = 256;  // the compliance between the nodes near them takes up to 90 MB

constexpr palpate_tool default_tool = PALPATE_TOOL_INIT;
constexpr palpate_pose default_pose = PALPATE_POSE_INIT;
constexpr palpate_overlay default_overlay = PALPATE_OVERLAY_INIT;
constexpr palpate_options default_options = PALPATE_OPTIONS_INIT;
constexpr palpate_record_options default_record_options = PALPATE_RECORD_OPTIONS_INIT;

Tool to_tool(const palpate_tool& tool) {
  Tool result{.radius = tool.radius,
              .length = tool.length,
              .disc_radius = tool.disc_radius,
              .coupling_stiffness = tool.coupling_stiffness,
              .coupling_torsion = tool.coupling_torsion,
              .max_force = tool.max_force,
              .hand_over = tool.hand_over,
              .reach = tool.reach,
              .friction = {}};
  if (!(tool.friction < 0.0)) result.friction = tool.friction;
  return result;
}

ToolPose to_pose(const palpate_pose& pose) noexcept {
  const double* q = pose.orientation;
  return {.orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
          .position = Eigen::Map<const Vec3>(pose.position),
          .grab = pose.grab != 0};
}

palpate_result to_result(const ToolState& state, double small_strain) noexcept {
  palpate_result result{};
  copy(state.wrench.force, result.force);
  copy(state.wrench.torque, result.torque);
  copy(state.pose.position, result.tool_position);
  const Eigen::Quaterniond& q = state.pose.orientation;
  result.tool_orientation[0] = q.w();
  result.tool_orientation[1] = q.x();
  result.tool_orientation[2] = q.y();
  result.tool_orientation[3] = q.z();
  result.contacts = state.contacts;
  for (Eigen::Index row = 0; row < 3; ++row)
    copy(state.local.stiffness.row(row), result.local_stiffness + 3 * row);
  copy(state.local.point, result.local_point);
  result.local_radius = state.local.radius;
  result.force_error = state.force_error;
  result.left_out = state.left_out;
  result.greens_error = state.greens_error;
  result.small_strain = small_strain;
  return result;
}

/// Reads element `k`, called `name`, of an array of structs that the macro `init` initializes.
template <typename Struct>
Struct read_or_throw(const Struct* first, std::size_t k, const Struct& defaults, const std::string& name,
                     const std::string& init, const char* place = "palpate_create") {
  if (const auto read = read_struct(first, k, defaults)) return *read;
  if (!is_size_of<Struct>(first->size)) {
    throw Error("the size of " + name + " is " + std::to_string(first->size) + " bytes", place,
                "begin with " + init + ", which sets it");
  }
  throw Error("libpalpate " PALPATE_VERSION " cannot read " + name +
                  ": a member that it does not know is set, or its size is not that of the first",
              place,
              "begin with " + init + ", and use a libpalpate as new as the palpate.h that you compile with");
}

StateOptions read_tools(const palpate_tool* tools, int tool_count, int max_contacts) {
  if (tools == nullptr || tool_count < 1)
    throw Error("there is no tool", "palpate_create", "give at least one");
  if (max_contacts < 1 || max_contacts > most_contacts) {
    throw Error("room for " + std::to_string(max_contacts) + " contacts was asked for", "palpate_create",
                "ask for 1 to " + std::to_string(most_contacts));
  }
  StateOptions options{.tools = {}, .max_contacts = max_contacts};
  for (int k = 0; k < tool_count; ++k) {
    options.tools.push_back(to_tool(read_or_throw(tools, static_cast<std::size_t>(k), default_tool,
                                                  "tool " + std::to_string(k), "PALPATE_TOOL_INIT")));
  }
  return options;
}

/// Reads overlay options; without an overlay the refinement is 1.
palpate_overlay read_overlay(const palpate_overlay* given) {
  if (given == nullptr) return {.size = sizeof(palpate_overlay), .refinement = 1, .rings = 0, .memory = 0};
  const palpate_overlay overlay =
      read_or_throw(given, 0, default_overlay, "the overlay", "PALPATE_OVERLAY_INIT");
  if (overlay.refinement == PALPATE_OVERLAY_LOCAL) return overlay;
  if (overlay.refinement < least_refinement || overlay.refinement > most_refinement || overlay.rings < 1 ||
      overlay.rings > most_rings) {
    throw Error("an overlay of " + std::to_string(overlay.rings) + " rings, refined " +
                    std::to_string(overlay.refinement) + " times, was asked for",
                "palpate_create_with_options",
                "ask for 1 to " + std::to_string(most_rings) + " rings, refined " +
                    std::to_string(least_refinement) + " to " + std::to_string(most_refinement) + " times");
  }
  return overlay;
}

ContactModel read_contact(const palpate_options& options, const palpate_overlay& overlay) {
  if (options.depth == 0)
    return options.dynamic_contact != 0 ? ContactModel::dynamic : ContactModel::quasi_static;
  if (options.dynamic_contact == 0 && overlay.refinement <= 1) return ContactModel::two_level;
  throw Error("a body that turns and bends far has no inertia and no finer mesh", "options.depth",
              "set it to 0, or leave out dynamic_contact and the overlay");
}

std::int64_t read_stress_ticks(std::int64_t ticks) {
  if (ticks >= 0) return ticks;
  throw Error("stress was asked for each " + std::to_string(ticks) + " ticks", "palpate_create_with_options",
              "ask for 1 or more, or for 0 to have none");
}

/// Ticks per second of a session that is recorded.
std::int64_t whole_rate(double tick) {
  const double rate = std::round(1.0 / tick);
  if (tick_rates.contains(rate) && std::abs(rate * tick - 1.0) < 1e-9) return static_cast<std::int64_t>(rate);
  throw Error("a tick of " + std::to_string(tick) + " s is not 1/rate of a whole rate " +
                  std::string(tick_rates.words),
              "palpate_record", "create the session with another options.tick");
}

/// Settings that a replay of the session needs.
Settings settings_of(const Tool& tool, const StateOptions& options, const palpate_overlay& overlay,
                     ContactModel contact) {
  Settings settings;
  settings.tool = tool;
  settings.reach = std::max(tool.reach, std::numeric_limits<double>::min());  // 0 is not allowed there
  settings.max_contacts = options.max_contacts;
  settings.contact = contact == ContactModel::dynamic ? contact : ContactModel::quasi_static;
  settings.overlay = overlay.refinement > 1 ? OverlayOptions{.kind = OverlayKind::uniform,
                                                             .refinement = overlay.refinement,
                                                             .rings = overlay.rings}
                     : overlay.refinement == PALPATE_OVERLAY_LOCAL
                         ? OverlayOptions{}
                         : OverlayOptions{.kind = OverlayKind::none};
  settings.overlay_memory = overlay.memory;
  settings.depth = contact == ContactModel::two_level ? Depth::yes : Depth::no;
  settings.rate = whole_rate(options.tick);
  return settings;
}

/// Checked output of a recording of `model`, loaded from `loaded`, by the same rules as for the programs.
std::filesystem::path recording_output(const Model& model, const std::filesystem::path& loaded,
                                       const char* wanted) {
  OutputPaths paths;
  paths.add_input(loaded, "the model");
  add_sources(paths, model, loaded);
  return paths.add(wanted, OutputKind::recording, "palpate_record");
}

/// True if a tool may change to `next` between two ticks: same shape, valid values.
bool can_become(const Tool& tool, const Tool& next) noexcept {
  const auto is_bound = [](double value) { return value > 0.0; };  // infinite means unlimited
  const auto is_size = [](double value) { return std::isfinite(value) && value >= 0.0; };
  return tool.radius == next.radius && tool.length == next.length && tool.disc_radius == next.disc_radius &&
         is_bound(next.coupling_stiffness) && is_bound(next.coupling_torsion) && is_bound(next.max_force) &&
         is_bound(next.hand_over) && is_size(next.reach) && is_size(next.friction.value_or(0.0));
}

/// Returns the session of the thread that uses the functions of the loop. Throws Error if there is none.
OwnLoop& expect(const Inside<OwnLoop>& loop, const palpate_session* session, const char* place, int& code) {
  if (loop) return *loop;
  if (session == nullptr) throw Error("there is no session", place, "make one by palpate_create");
  code = PALPATE_ERROR_STATE;
  throw Error("the session has ended, or another thread steps it", place,
              "use the functions of the loop from one thread, and none after palpate_destroy");
}

}  // namespace
}  // namespace palpate

using namespace palpate;

extern "C" {

const char* palpate_status_name(uint32_t bit) noexcept {
  if (bit == PALPATE_NOT_STEPPED) return "not_stepped";
  for (const auto& [status, name] : status_names) {
    if (static_cast<std::uint32_t>(status) == bit) return name;
  }
  return nullptr;
}

palpate_session* palpate_create(const char* file, const palpate_tool* tools, int tool_count, int max_contacts,
                                char* error, size_t error_size) noexcept {
  return palpate_create_with_options(file, tools, tool_count, max_contacts, &default_options, error,
                                     error_size);
}

palpate_session* palpate_create_with_options(const char* file, const palpate_tool* tools, int tool_count,
                                             int max_contacts, const palpate_options* options, char* error,
                                             size_t error_size) noexcept {
  palpate_session* session = nullptr;
  tell_failure("palpate_create", "close other programs, or precompute with fewer surface nodes", error,
               error_size, [&](int& code) {
                 if (file == nullptr)
                   throw Error("there is no file name", "palpate_create", "name a .palpate.hdf file");
                 if (options == nullptr)
                   throw Error("there are no options", "palpate_create_with_options",
                               "begin with PALPATE_OPTIONS_INIT");
                 const palpate_options wanted =
                     read_or_throw(options, 0, default_options, "the options", "PALPATE_OPTIONS_INIT");
                 const palpate_overlay overlay = read_overlay(wanted.overlay);
                 StateOptions state = read_tools(tools, tool_count, max_contacts);
                 state.tick = wanted.tick;
                 const ContactModel contact = read_contact(wanted, overlay);
                 const std::int64_t stress_ticks = read_stress_ticks(wanted.stress_ticks);
                 code = PALPATE_ERROR_FILE;
                 Model model = load_model(file);
                 code = PALPATE_ERROR_ARGUMENT;
                 auto loop =
                     std::make_unique<OwnLoop>(file, std::move(model), state, overlay, contact, stress_ticks);
                 session = std::make_unique<palpate_session>(std::move(loop)).release();
               });
  return session;
}

void palpate_destroy(palpate_session* session) noexcept {
  if (session != nullptr) session->end();
}

uint32_t palpate_step(palpate_session* session, const palpate_pose* poses) noexcept {
  const Inside<OwnLoop> loop(session, Use::alone);
  if (!loop) return PALPATE_NOT_STEPPED;
  if (poses == nullptr) return PALPATE_POSE_NOT_FINITE;
  for (std::size_t k = 0; k < loop->poses.size(); ++k) {
    const auto pose = read_struct(poses, k, default_pose);
    if (!pose) return PALPATE_POSE_NOT_FINITE;
    loop->poses[k] = to_pose(*pose);
  }
  const std::int64_t begun = loop->recording ? monotonic_now() : 0;
  if (loop->overlays) loop->overlays->serve(loop->state);
  if (loop->motion) loop->motion->receive(loop->state);
  const StepStatus status = step(loop->body, loop->state, loop->poses);
  if (loop->motion) loop->motion->post(loop->state);
  loop->publish();
  if (loop->frames) loop->frames->post(loop->state, loop->ticks, 0.0);
  if (loop->recording)
    loop->recording->note(loop->poses[loop->recorded_tool], loop->overlays ? loop->overlays->centre() : -1,
                          monotonic_now() - begun);
  ++loop->ticks;
  return static_cast<uint32_t>(status);
}

int palpate_get(const palpate_session* session, int tool, palpate_result* result) noexcept {
  const Inside<OwnLoop> loop(const_cast<palpate_session*>(session), Use::alone);  // NOLINT: as in look
  palpate_result felt{};
  const bool exists = loop && tool >= 0 && static_cast<std::size_t>(tool) < loop->state.tools.size();
  if (exists)
    felt = to_result(loop->state.tools[static_cast<std::size_t>(tool)],
                     loop->state.surface.motion.small_strain());
  if (!write_struct(felt, result)) return -1;
  if (!loop) return refused(session);
  return exists ? 0 : -1;
}

int palpate_get_contacts(const palpate_session* session, int tool, palpate_contact* contacts, int room,
                         int* count) noexcept {
  const Inside<OwnLoop> loop(const_cast<palpate_session*>(session), Use::alone);  // NOLINT: as in look
  if (!loop) return refused(session);
  if (count == nullptr || room < 0 || tool < 0 || static_cast<std::size_t>(tool) >= loop->state.tools.size())
    return -1;
  if (room > 0 && (contacts == nullptr || !is_size_of<palpate_contact>(contacts->size))) return -1;
  *count = 0;
  for (const ContactPoint& contact : loop->state.contacts()) {
    if (contact.tool != tool || contact.force.isZero(0.0)) continue;
    if (*count < room) {
      const SeenContact seen = seen_contact(loop->body, loop->state, contact);
      palpate_contact filled{};
      copy(seen.position, filled.position);
      copy(seen.normal, filled.normal);
      copy(contact.force, filled.force);
      write_struct(filled, contacts, static_cast<std::size_t>(*count));
    }
    ++*count;
  }
  return 0;
}

int palpate_set_tool(palpate_session* session, int number, const palpate_tool* tool) noexcept {
  const Inside<OwnLoop> loop(session, Use::alone);
  if (!loop) return refused(session);
  if (number < 0 || static_cast<std::size_t>(number) >= loop->state.tools.size()) return -1;
  const auto given = read_struct(tool, 0, default_tool);
  if (!given) return -1;
  Tool& now = loop->state.tools[static_cast<std::size_t>(number)].tool;
  const Tool next = to_tool(*given);
  if (!can_become(now, next)) return -1;
  now = next;
  return 0;
}

int palpate_reset(palpate_session* session) noexcept {
  const Inside<OwnLoop> loop(session, Use::alone);
  if (!loop) return refused(session);
  if (loop->recording) return PALPATE_ERROR_STATE;
  loop->reset();
  return 0;
}

int palpate_record(palpate_session* session, const char* file, const palpate_record_options* options,
                   char* error, size_t error_size) noexcept {
  constexpr const char* place = "palpate_record";
  return tell_failure(place, "close other programs", error, error_size, [&](int& code) {
    const Inside<OwnLoop> inside(session, Use::alone);
    OwnLoop& loop = expect(inside, session, place, code);
#ifdef _WIN32
    throw Error("recordings are not written on Windows", place, "record on Linux");
#endif
    if (file == nullptr) throw Error("there is no file name", place, "name the recording, OUT.mcap");
    if (options == nullptr)
      throw Error("there are no options", place, "begin with PALPATE_RECORD_OPTIONS_INIT");
    const palpate_record_options wanted = read_or_throw(options, 0, default_record_options, "the options",
                                                        "PALPATE_RECORD_OPTIONS_INIT", place);
    const std::size_t tools = loop.state.tools.size();
    if (wanted.tool < 0 || static_cast<std::size_t>(wanted.tool) >= tools)
      throw Error("there is no tool " + std::to_string(wanted.tool), place,
                  "name one of 0 to " + std::to_string(tools - 1));
    if (!(wanted.pictures >= 0.0) || std::isinf(wanted.pictures))
      throw Error(std::to_string(wanted.pictures) + " pictures a second were asked for", place,
                  "ask for 0 or more");
    const auto tool = static_cast<std::size_t>(wanted.tool);
    const Settings settings = settings_of(loop.state.tools[tool].tool, loop.state_options,
                                          loop.overlay_options, loop.body.contact_model());
    code = PALPATE_ERROR_STATE;
    if (loop.recording) throw Error("a recording is being made", place, "end it by palpate_record_end first");
    code = PALPATE_ERROR_FILE;
    const std::filesystem::path output = recording_output(loop.body.model(), loop.file, file);
    loop.reset();
    loop.recorded_tool = tool;
    loop.recording.emplace(loop.body, loop.state,
                           SessionRecording::Options{.file = output,
                                                     .model = loop.file,
                                                     .settings = settings,
                                                     .tool = tool,
                                                     .pictures = wanted.pictures});
  });
}

int palpate_record_end(palpate_session* session, char* error, size_t error_size) noexcept {
  constexpr const char* place = "palpate_record_end";
  return tell_failure(place, "close other programs", error, error_size, [&](int& code) {
    const Inside<OwnLoop> inside(session, Use::alone);
    OwnLoop& loop = expect(inside, session, place, code);
    code = PALPATE_ERROR_STATE;
    if (!loop.recording) throw Error("no recording is being made", place, "begin one by palpate_record");
    code = PALPATE_ERROR_FILE;
    std::int64_t dropped = 0;
    try {
      loop.recording->finish();
      dropped = loop.recording->dropped();
      loop.recording.reset();
    } catch (...) {
      loop.recording.reset();
      throw;
    }
    code = PALPATE_ERROR_INCOMPLETE;
    if (dropped > 0)
      throw Error(std::to_string(dropped) + " ticks or pictures found no room", place,
                  "record to a faster disk, or fewer pictures a second");
  });
}

}  // extern "C"
