#include "runtime/viewer/viewer_server.h"

#include <mutex>
#include <optional>
#include <utility>

#include "runtime/scene/drawn_picture.h"
#include "runtime/viewer/page_server.h"

namespace palpate {
namespace {

constexpr std::size_t most_waiting = 1024;  // calls of show_ticks not yet taken

}  // namespace

struct ViewerServer::Impl {
  Impl(ViewerPort port, const std::vector<RunToShow>& runs)
      : shown(runs.size()), server(std::move(port), runs) {}

  std::mutex mutex;                   // guards `shown`
  std::vector<PictureDrawing> shown;  // one per run
  PageServer server;
};

ViewerServer::ViewerServer(ViewerPort port, const std::vector<RunToShow>& runs)
    : impl_(std::make_unique<Impl>(std::move(port), runs)) {}

ViewerServer::~ViewerServer() = default;

const std::string& ViewerServer::url() const noexcept {
  return impl_->server.url();
}

void ViewerServer::show_scene(std::shared_ptr<const Scene> scene, std::size_t run) {
  const std::lock_guard lock(impl_->mutex);
  impl_->shown[run].set_scene(scene);
  impl_->server.post(run, [&](Mail& mail) {
    mail.scene = std::move(scene);
    mail.picture.reset();
    mail.ticks.clear();
  });
}

void ViewerServer::show_picture(SurfacePicture picture, const Body* body, std::size_t run) {
  const std::lock_guard lock(impl_->mutex);
  std::optional<DrawnPicture> drawn = impl_->shown[run].draw(std::move(picture), body);
  if (!drawn) return;
  impl_->server.post(run, [&](Mail& mail) { mail.picture = std::move(drawn); });
}

void ViewerServer::show_ticks(std::span<const TickNote> ticks, std::int64_t stride, std::size_t run) {
  if (ticks.empty()) return;
  Mail::Ticks copy{{ticks.begin(), ticks.end()}, stride};
  impl_->server.post(run, [&](Mail& mail) {
    mail.ticks.push_back(std::move(copy));
    if (mail.ticks.size() > most_waiting) mail.ticks.pop_front();
  });
}

void ViewerServer::show_state(const std::string& json, std::size_t run) {
  StateWord state(json);
  impl_->server.post(run, [&](Mail& mail) {
    if (!state.times().is_null()) mail.times = state.times();
    mail.state = std::move(state);
  });
}

}  // namespace palpate
