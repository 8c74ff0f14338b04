// Serves the viewer's page, its pictures and its requests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/scene/scene.h"
#include "runtime/serving/viewer_port.h"
#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// HTTP and WebSocket in a thread of its own (web/PROTOCOL.md). The `show` functions may be called by any
/// thread; they never wait for a page. A page that is slow misses pictures, and holds up nothing else.
class ViewerServer {
 public:
  /// Serves who waits at the port and who comes later. Two runs are shown side by side; the functions below
  /// are told which by its place in `runs`.
  ViewerServer(ViewerPort port, const std::vector<RunToShow>& runs);
  ~ViewerServer();  ///< closes all connections
  ViewerServer(const ViewerServer&) = delete;
  ViewerServer& operator=(const ViewerServer&) = delete;

  /// As ViewerPort.
  [[nodiscard]] const std::string& url() const noexcept;

  /// All that is shown from now on is of this scene.
  void show_scene(std::shared_ptr<const Scene> scene, std::size_t run = 0);
  /// A picture without values for all nodes of the scene is not shown. `body`, which the scene is of, is used
  /// during the call only, to draw the picture's overlay: null for none.
  void show_picture(SurfacePicture picture, const Body* body = nullptr, std::size_t run = 0);
  /// Ticks `stride` apart. Live, pages are sent the last two seconds at most.
  void show_ticks(std::span<const TickNote> ticks, std::int64_t stride = 1, std::size_t run = 0);
  /// The members of the message `state` that are the run's, as a JSON object; the server adds those that are
  /// each page's (`pointer` says whether the run's device is a pointer). `times` of a replay are kept for
  /// pages that come later. Throws Error when it is not an object.
  void show_state(const std::string& json, std::size_t run = 0);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
