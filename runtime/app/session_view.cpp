#include "runtime/app/session_view.h"

#include <algorithm>
#include <memory>

#include "base/json_text.h"

namespace palpate {
SessionView::SessionView(const std::filesystem::path& recording)
    : pictures_(recording), state_(pictures_.state(pictures_.times())) {}

void SessionView::show(ViewerServer& server, std::size_t run) {
  const std::lock_guard lock(mutex_);  // a page may seek already
  server_ = &server;
  run_ = run;
  server.show_scene(std::make_shared<const Scene>(pictures_.scene()), run);
  server.show_state(json_text(state_), run);
  state_.erase("times");  // the server keeps them
  for (const TickRun& ticks : pictures_.ticks()) server.show_ticks(ticks.notes, ticks.stride, run);
  server.show_picture(pictures_.picture(0), nullptr, run);
}

void SessionView::seek(std::int64_t frame) {
  const std::lock_guard lock(mutex_);
  if (server_ == nullptr) return;
  const std::int64_t shown = nearest(frame);
  server_->show_picture(pictures_.picture(shown), nullptr, run_);
  state_["frame"] = shown;
  server_->show_state(json_text(state_), run_);
}

std::optional<RecordedFrame> SessionView::recorded_frame(std::int64_t frame) {
  const std::lock_guard lock(mutex_);
  return RecordedFrame{nearest(frame), pictures_.picture(nearest(frame))};
}

std::int64_t SessionView::nearest(std::int64_t frame) const {
  return std::clamp<std::int64_t>(frame, 0, pictures_.frames() - 1);
}

}  // namespace palpate
