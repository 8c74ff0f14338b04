#include "runtime/viewer/viewer_server.h"

#include <mutex>
#include <utility>

#include "runtime/viewer/page_server.h"
#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

constexpr std::size_t most_waiting = 1024;  // calls of show_ticks that nobody has looked at

}  // namespace

struct ViewerServer::Impl {
  /// What was shown last of a run.
  struct Shown {
    std::shared_ptr<const Scene> scene;
    // The last picture's. The patch is kept so that no other one can have its address.
    std::shared_ptr<const Scene> patch_scene;
    std::shared_ptr<const Patch> patch;
    std::shared_ptr<const ScenePatch> drawn_patch;
    std::uint32_t patches = 0;
  };

  Impl(ViewerPort port, const std::vector<RunToShow>& runs)
      : shown(runs.size()), server(std::move(port), runs) {}

  std::mutex mutex;  // of what is shown
  std::vector<Shown> shown;
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
  impl_->shown[run].scene = scene;
  impl_->server.post(run, [&](Mail& mail) {
    mail.scene = std::move(scene);
    mail.picture.reset();
    mail.ticks.clear();
  });
}

void ViewerServer::show_picture(SurfacePicture picture, const Body* body, std::size_t run) {
  const std::lock_guard lock(impl_->mutex);
  Impl::Shown& last = impl_->shown[run];
  DrawnPicture shown{.scene = last.scene, .patch = nullptr, .picture = {}};
  if (shown.scene == nullptr) return;
  if (picture.patch != last.patch || shown.scene != last.patch_scene) {
    last.patch = picture.patch;
    last.patch_scene = shown.scene;
    last.drawn_patch.reset();
    if (picture.patch != nullptr && body != nullptr) {
      auto drawn = std::make_shared<ScenePatch>(make_scene_patch(*body, *shown.scene, *picture.patch));
      drawn->number = ++last.patches;
      last.drawn_patch = std::move(drawn);
    }
  }
  shown.patch = last.drawn_patch;
  picture.patch.reset();
  if (!fits(picture, *shown.scene, shown.patch.get())) return;
  shown.picture = std::move(picture);
  impl_->server.post(run, [&](Mail& mail) { mail.picture = std::move(shown); });
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
