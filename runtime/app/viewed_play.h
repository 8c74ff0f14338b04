// Run that is shown in a browser and controlled from there.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "base/error.h"
#include "runtime/app/play_session.h"
#include "runtime/app/run_state.h"
#include "runtime/app/session_view.h"
#include "runtime/viewer/viewed_run.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

/// Runs sessions one after the other. A request of a page that needs a new session - the untouched body,
/// other settings, a recording - ends the current one and starts the next, on the same loaded body if
/// possible. If a request fails, the page gets the reason and the previous session is restarted.
class ViewedPlay : public ViewedRun {
 public:
  /// `input` as make_input_source left it, `body` as the options ask for it; `port`: where it is shown;
  /// `beside`: a recording that is shown beside it, which lives as long; null for none.
  ViewedPlay(PlayOptions options, InputSource& input, std::unique_ptr<const Body> body, ViewerPort port,
             SessionView* beside = nullptr);

  /// Serves the pages, prints the address once the first session could start, and continues until `stop` or
  /// the end of the duration. Writes the report of all sessions together and returns it. Throws Error. Must
  /// be called only once.
  LoopReport run(const std::atomic<bool>& stop);

  /// True if a recording of the run is incomplete.
  [[nodiscard]] bool recording_failed() const noexcept { return recording_failed_; }

  /// Returns the state as sent to pages.
  [[nodiscard]] RunState state() const;

  void point(const PointerPose& wanted) override;
  void lose_pointer() override;
  void pause(bool paused) override;
  void step_once() override;
  void reset() override;
  void acknowledge() override;
  void change(const SettingsChange& settings) override;
  void record(bool on) override;
  void seek(std::int64_t frame) override;

 private:
  /// Plan of a session.
  struct Plan {
    SettingsText text;
    Settings settings;
    std::filesystem::path record;  ///< empty: no recording
  };

  std::unique_ptr<PlaySession> begin_act(const Plan& plan);
  void load(const Settings& settings);
  void show_body();
  LoopReport run_act(PlaySession& session, const std::atomic<bool>& stop);
  bool wait_for_wish(const std::atomic<bool>& stop) const;
  Plan next_plan();
  static std::string why_begun(const Plan& plan, const std::optional<Plan>& before);
  bool take_back(const Plan& failed, const Plan& good, const Error& why);

  [[nodiscard]] bool has_hand() const noexcept { return input_.link != nullptr; }
  void refuse_to_hand(const SettingsChange& settings) const;
  void refuse_while_locked() const;
  void check(const Settings& settings) const;
  void end_act();
  void begin_making(const char* what);
  void refuse(const Error& why);
  void take_recording_failure(const Error& reason);
  void take_change(const SurfaceFrame& frame);
  void take_ticks(std::span<const TickNote> notes);
  void tell_states(const std::stop_token& over);

  PlayOptions options_;
  InputSource& input_;
  std::unique_ptr<const Body> body_;
  BodyOptions body_options_;
  bool can_move_;   // the file has dynamics
  int most_rings_;  // most rings of its overlays
  double size_;     // size of the body [m]
  ViewerPort port_;
  SessionView* beside_;
  ViewerServer* server_ = nullptr;
  LoopControl control_;
  bool recording_failed_ = false;

  Fault latched_ = Fault::none;  // fault of the previous session, if a hand is in the device

  std::chrono::steady_clock::time_point next_change_{};  // earliest next computation of the surface's change

  mutable std::mutex mutex_;  // guards the following; the loop never locks it
  Plan requested_;            // next session
  RunState state_;
  bool changed_ = true;  // since the last state sent to pages
  std::condition_variable_any tell_;
};

}  // namespace palpate
