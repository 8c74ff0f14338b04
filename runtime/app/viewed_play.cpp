#include "runtime/app/viewed_play.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "base/program.h"
#include "base/regular_file.h"
#include "runtime/app/fitting_tool.h"
#include "runtime/body/overlay_rings.h"
#include "runtime/loop/loading.h"
#include "runtime/loop/output.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

constexpr auto state_period = std::chrono::milliseconds(500);
constexpr auto pause_for_wishes = std::chrono::milliseconds(20);

/// Returns FILE-STEM-YYYYmmdd-HHMMSS.mcap in the working directory, with a number if that file exists
/// already.
std::filesystem::path name_recording(const std::filesystem::path& model) {
  std::filesystem::path stem = model.stem();  // without .hdf
  if (stem.extension() == ".palpate") stem = stem.stem();
  const std::string name =
      fmt::format("{}-{:%Y%m%d-%H%M%S}", stem.string(), fmt::localtime(std::time(nullptr)));
  std::filesystem::path path = name + ".mcap";
  for (int k = 2; std::filesystem::exists(path); ++k) path = fmt::format("{}-{}.mcap", name, k);
  return path;
}

/// Throws Error if a file is missing, before the body loaded from it is freed.
void expect_file(const std::filesystem::path& file) {
  check_regular_file(file, "put it back, or start palpate-runtime play anew");
}

bool is_of_the_run(const Setting& setting) {
  return setting.group == SettingGroup::loop || setting.group == SettingGroup::workspace;
}

}  // namespace

ViewedPlay::ViewedPlay(PlayOptions options, InputSource& input, std::unique_ptr<const Body> body,
                       ViewerPort port, SessionView* beside)
    : options_(std::move(options)),
      input_(input),
      body_(std::move(body)),
      body_options_(options_.settings.body()),
      can_move_(body_->model().dynamics.method != DynamicsMethod::none),
      most_rings_(overlay_rings(*body_)),
      size_(body_->bounds().diagonal().norm()),
      port_(std::move(port)),
      beside_(beside),
      requested_{.text = options_.settings_text, .settings = options_.settings, .record = options_.record} {
  if (options_.device.kind == DeviceChoice::Kind::mouse) add_mouse(input_, options_, *body_);
  state_.device = options_.device.text;
  state_.pointer = input_.mouse != nullptr;
  state_.hand = has_hand();
  state_.rate = options_.settings.rate;
  if (options_.session) state_.locked = "a replay is as its session was";
}

LoopReport ViewedPlay::run(const std::atomic<bool>& stop) {
  std::vector<RunToShow> runs = {{*this, false}};
  if (beside_ != nullptr) runs.push_back({*beside_, true});
  const ServedAddress served = port_.served();
  ViewerServer server(std::move(port_), runs);
  server_ = &server;
  if (beside_ != nullptr) beside_->show(server, 1);
  show_body();
  const std::jthread teller([this](const std::stop_token& over) { tell_states(over); });

  PlayedParts parts;
  std::optional<Plan> good;  // last plan that succeeded
  for (;;) {
    const Plan plan = next_plan();
    std::unique_ptr<PlaySession> session;
    LoopReport report;
    try {
      session = begin_act(plan);
      if (!good) tell_address(served, server.url(), "");
      const std::string because = why_begun(plan, good);
      good = plan;
      report = run_act(*session, stop);
      parts.add({because, plan.text, plan.record, session->dropped()}, report);
      if (has_hand()) latched_ = session->fault();
    } catch (const std::exception&) {
      if (!good || !take_back(plan, *good, handled_error("", "close other programs"))) throw;
      continue;
    }
    const bool over = options_.duration && report.ticks >= input_.ticks;
    if (stop || over || !wait_for_wish(stop)) {
      session->tell(&parts);
      return parts.report();
    }
  }
}

std::string ViewedPlay::why_begun(const Plan& plan, const std::optional<Plan>& before) {
  if (!before) return "start";
  if (plan.record != before->record) return plan.record.empty() ? "recording ended" : "recording begun";
  return plan.text != before->text ? "settings" : "reset";
}

ViewedPlay::Plan ViewedPlay::next_plan() {
  const std::lock_guard lock(mutex_);
  control_.leave = false;
  control_.single_ticks = control_.paused ? 1 : 0;  // shows the new state of the body
  return requested_;
}

/// Starts a session. From here on pages see the state of the new session.
std::unique_ptr<PlaySession> ViewedPlay::begin_act(const Plan& plan) {
  if (latched_ != Fault::none && !plan.record.empty()) {
    throw Error("there is no force until the fault is acknowledged, and a recording begins without one",
                "record", "acknowledge the fault first");
  }
  load(plan.settings);
  PlayOptions options = options_;
  options.settings_text = plan.text;
  options.settings = plan.settings;
  settle_tool(options, *body_);
  options.settings = apply_defaults(options.settings, input_, *body_);
  options.record = plan.record;
  if (!plan.record.empty() && plan.record != options_.record) {  // already checked otherwise
    OutputPaths paths;
    paths.add(plan.record, OutputKind::recording, "record");
  }
  print_device(input_, options.settings);
  if (options.settings.overlay.has_patches()) begin_making("the overlay is being made");
  const SettingsText settled = options.settings_text;
  const Tool settled_tool = options.settings.tool;
  {
    const std::lock_guard lock(mutex_);
    state_.recording_failed.reset();
  }
  auto session = std::make_unique<PlaySession>(
      std::move(options), *body_, input_,
      SessionViewer{.control = &control_,
                    .ticks = [this](std::span<const TickNote> notes) { take_ticks(notes); },
                    .pictures =
                        [this](SurfacePicture picture) {
                          take_change(picture.frame);
                          server_->show_picture(std::move(picture), body_.get());
                        },
                    .recording_failed = [this](const Error& reason) { take_recording_failure(reason); }});
  session->latch(latched_);
  const std::lock_guard lock(mutex_);
  if (const std::string small = too_small(settled_tool, *body_); small != state_.tool_note) {
    tell_small_tool(small);
    state_.tool_note = small;
  }
  state_.settings = settled;
  state_.busy.reset();
  state_.ticks = 0;
  state_.misses = 0;
  state_.change.reset();
  state_.recording.reset();
  if (!plan.record.empty()) state_.recording = plan.record.string();
  if (!options_.session) {
    state_.locked.reset();
    if (state_.recording) state_.locked = "a recording is being made";
  }
  changed_ = true;
  tell_.notify_all();
  return session;
}

/// Loads another body if the settings need one; the old one, which is large, is freed first.
void ViewedPlay::load(const Settings& settings) {
  const BodyOptions wanted = settings.body();
  if (body_ != nullptr) {
    BodyOptions before = body_options_;
    before.radius = wanted.radius;
    if (before == wanted &&
        met_surface(body_->model(), wanted) == met_surface(body_->model(), body_options_)) {
      body_options_ = wanted;
      return;
    }
  }
  expect_file(options_.file);
  begin_making("the model is being loaded");
  body_.reset();
  body_ = load_and_print(options_.file, options_.model_toml, settings.body());
  body_options_ = settings.body();
  show_body();
}

/// Shows the reason for a delay in the pages.
void ViewedPlay::begin_making(const char* what) {
  const std::lock_guard lock(mutex_);
  state_.busy = what;
  changed_ = true;
  tell_.notify_all();
}

void ViewedPlay::show_body() {
  std::uint32_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = ++state_.scene;
    state_.model = describe_model(*body_, options_.file.string());
    state_.defaults = describe_defaults(*body_);
    changed_ = true;
  }
  server_->show_scene(std::make_shared<const Scene>(make_scene(*body_, number)));
  tell_.notify_all();
}

LoopReport ViewedPlay::run_act(PlaySession& session, const std::atomic<bool>& stop) {
  const LoopReport& report = session.run(stop);
  if (!session.recording_failure()) return report;
  recording_failed_ = true;
  if (stop) return report;
  const std::lock_guard lock(mutex_);  // the next session has no recording
  requested_.record.clear();
  const Error& reason = *session.recording_failure();
  refuse(Error(std::string("the recording failed: ") + reason.what(), reason.where(), reason.hint()));
  return report;
}

/// Waits with the final state of a finished script or session on display. False if the run is to stop.
bool ViewedPlay::wait_for_wish(const std::atomic<bool>& stop) const {
  while (!control_.leave && !stop) std::this_thread::sleep_for(pause_for_wishes);
  return !stop;
}

/// Returns to the last plan that succeeded, unless that plan failed itself.
bool ViewedPlay::take_back(const Plan& failed, const Plan& good, const Error& why) {
  const std::lock_guard lock(mutex_);
  if (failed.text == good.text && failed.record.empty()) return false;
  requested_ = good;
  requested_.record.clear();
  refuse(why);
  return true;
}

RunState ViewedPlay::state() const {
  const std::lock_guard lock(mutex_);
  RunState state = state_;
  state.paused = control_.paused;
  return state;
}

void ViewedPlay::point(const PointerPose& wanted) {
  if (input_.mouse != nullptr) input_.mouse->point(wanted);
}

void ViewedPlay::lose_pointer() {
  if (input_.mouse != nullptr) input_.mouse->lose();
}

void ViewedPlay::pause(bool paused) {
  const std::lock_guard lock(mutex_);
  control_.single_ticks = 0;
  control_.paused = paused;
  changed_ = true;
  tell_.notify_all();
}

void ViewedPlay::step_once() {
  if (control_.paused) ++control_.single_ticks;
}

void ViewedPlay::acknowledge() {
  if (has_hand()) {
    throw PageError(PageRefusal::hand, "a hand is in the device, and no page may give it force again",
                    "acknowledge",
                    "who holds it presses Enter where palpate-runtime was started, or sends it SIGUSR1");
  }
  control_.acknowledged = true;
}

void ViewedPlay::reset() {
  const std::lock_guard lock(mutex_);
  if (requested_.record.empty()) return end_act();
  throw PageError(PageRefusal::locked, "a recording is being made, which begins with the untouched body",
                  "reset", "end the recording first");
}

void ViewedPlay::change(const SettingsChange& settings) {
  const std::lock_guard lock(mutex_);
  refuse_to_hand(settings);
  refuse_while_locked();
  Plan plan = requested_;
  for (const auto& [name, value] : settings) {
    const Setting* setting = find_setting(name);
    if (setting != nullptr && is_of_the_run(*setting))
      throw Error("it stays as it is in a run", "--" + name,
                  "start palpate-runtime play anew with another one");
    if (value) {
      plan.text[name] = *value;
    } else {
      plan.text.erase(name);
    }
  }
  plan.settings = read_settings(plan.text);
  check(plan.settings);
  requested_ = std::move(plan);
  end_act();
}

void ViewedPlay::record(bool on) {
  const std::lock_guard lock(mutex_);
  if (on == !requested_.record.empty()) return;
  if (options_.session) {
    throw PageError(PageRefusal::locked, "a replay is recorded already", "record", "copy the session's file");
  }
  requested_.record = on ? name_recording(options_.file) : std::filesystem::path();
  end_act();
}

void ViewedPlay::seek(std::int64_t) {
  throw Error("the loop goes through all ticks of the session, one after the other", "seek",
              "reset it to see it from its beginning");
}

/// Throws if settings are locked. The caller holds mutex_, here and below.
void ViewedPlay::refuse_while_locked() const {
  if (options_.session)
    throw PageError(PageRefusal::locked, "a replay is as its session was", "change",
                    "play without --device replay");
  if (!requested_.record.empty()) {
    throw PageError(PageRefusal::locked, "a recording is being made, of one group of settings", "change",
                    "end the recording first");
  }
}

/// Throws for changes that a page must not make while a hand is in the device. Allowed ones start a new
/// session: no force at first, then the same safety rules from their start, out of contact.
void ViewedPlay::refuse_to_hand(const SettingsChange& settings) const {
  if (!has_hand()) return;
  for (const Setting& setting : settings_table()) {
    if (!setting.protects_hand || !settings.contains(setting.name)) continue;
    throw PageError(PageRefusal::hand, "a hand is in the device, and no page may change what protects it",
                    std::string("--") + setting.name, "start palpate-runtime play anew with another one");
  }
}

/// Checks settings without loading the body.
void ViewedPlay::check(const Settings& settings) const {
  if (settings.contact == ContactModel::dynamic && !can_move_) {
    throw Error("the file has no dynamics, which dynamic contact needs", "--contact",
                "add [dynamics] to its model.toml and precompute it again");
  }
  if (settings.overlay.has_patches() && settings.overlay.rings > most_rings_) {
    throw Error(most_rings_ == 0
                    ? "the file keeps no layers below the surface, which overlays need, or is of tet4a, "
                      "which has none"
                    : fmt::format("the file keeps layers below the surface for at most {} rings, not {}",
                                  most_rings_, settings.overlay.rings),
                "--overlay",
                fmt::format("{}precompute it with [storage] layers = {}",
                            most_rings_ == 0 ? "" : "take fewer rings, or ", settings.overlay.rings));
  }
  const std::string problem = too_large(settings.tool, size_);
  if (!problem.empty()) throw Error(problem, "--tool", "take a smaller one");
}

void ViewedPlay::end_act() {
  state_.refused.reset();
  control_.leave = true;
  changed_ = true;
  tell_.notify_all();
}

/// Keeps the refusal for the pages until the next request.
void ViewedPlay::refuse(const Error& why) {
  print_warning(in_one_line(why));
  state_.refused = why;
  changed_ = true;
  tell_.notify_all();
}

/// Called by the recorder's thread.
void ViewedPlay::take_recording_failure(const Error& reason) {
  const std::lock_guard lock(mutex_);
  state_.recording_failed = reason;
  changed_ = true;
  tell_.notify_all();
}

/// Called by the thread that makes pictures, no more often than the state is sent: it takes milliseconds.
void ViewedPlay::take_change(const SurfaceFrame& frame) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_change_) return;
  next_change_ = now + state_period;
  const std::vector<Vec3> mesh = body_->surface_in_mesh();
  std::vector<Vec3> u(mesh.size());
  for (std::size_t node = 0; node < u.size(); ++node)
    u[node] = Eigen::Map<const Eigen::Vector3f>(frame.displacement.data() + 3 * node).cast<double>();
  const SurfaceChange change = surface_change(body_->dimension(), body_->drawn_simplices(), mesh, u);
  const std::lock_guard lock(mutex_);
  state_.change = change;
}

void ViewedPlay::take_ticks(std::span<const TickNote> notes) {
  server_->show_ticks(notes);
  const std::lock_guard lock(mutex_);
  const std::int64_t period = 1'000'000'000 / state_.rate;
  for (const TickNote& note : notes) state_.misses += note.lateness_ns + note.compute_ns > period ? 1 : 0;
  const TickNote& last = notes.back();
  state_.ticks = last.number + 1;
  const bool other = state_.phase != last.phase || state_.fault != last.fault;
  state_.phase = last.phase;
  state_.fault = last.fault;
  state_.small_strain = last.small_strain;
  if (!other) return;
  changed_ = true;
  tell_.notify_all();
}

/// Main function of the thread that sends the state to pages, twice a second and after changes.
void ViewedPlay::tell_states(const std::stop_token& over) {
  std::unique_lock lock(mutex_);
  while (!over.stop_requested()) {
    changed_ = false;
    lock.unlock();
    const std::string json = json_text(to_json(state()));
    server_->show_state(json);
    lock.lock();
    tell_.wait_for(lock, over, state_period, [this] { return changed_; });
  }
}

}  // namespace palpate
