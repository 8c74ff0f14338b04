// A run that is shown in a browser and steered from there.
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
#include "runtime/igtl/igtl_server.h"
#include "runtime/viewer/viewed_run.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

/// Runs one session after the other: what a page asks for that cannot be had within a session - the untouched
/// body, other settings, a recording - ends it and begins the next one, on the same loaded body where that
/// will do. A request that cannot be met is told to the page, and the session before begins again.
class ViewedPlay : public ViewedRun {
 public:
  /// `input` as make_input_source left it, `body` as the options ask for it; `port`: where it is shown;
  /// `beside`: a recording that is shown beside it, `igtl`: who else is sent its pictures. Both live as long;
  /// null for none.
  ViewedPlay(PlayOptions options, InputSource& input, std::unique_ptr<const Body> body, ViewerPort port,
             SessionView* beside = nullptr, IgtlServer* igtl = nullptr);

  /// Serves the pages, says where once the first session could begin, and goes on until `stop` or the end of
  /// a duration that the options give. Tells of all sessions together, whose report it returns. Throws Error.
  /// To be called once.
  LoopReport run(const std::atomic<bool>& stop);

  /// Whether a recording of the run is not whole.
  [[nodiscard]] bool recording_failed() const noexcept { return recording_failed_; }

  /// As pages are told.
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
  /// What a session is to be.
  struct Plan {
    SettingsText text;
    Settings settings;
    std::filesystem::path record;  ///< empty: nothing
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
  int most_rings_;  // that overlays of it may have
  double size_;     // of the body [m]
  ViewerPort port_;
  SessionView* beside_;
  IgtlServer* igtl_;
  ViewerServer* server_ = nullptr;
  LoopControl control_;
  bool recording_failed_ = false;

  Fault latched_ = Fault::none;  // of the session before, where a hand is in the device

  std::chrono::steady_clock::time_point next_change_{};  // of the surface, to be found

  mutable std::mutex mutex_;  // of what follows; the loop takes it never
  Plan requested_;            // of the next session
  RunState state_;
  bool changed_ = true;  // since pages were told
  std::condition_variable_any tell_;
};

}  // namespace palpate
