// Server of the viewer's page, pictures and requests.
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

/// HTTP and WebSocket server in a thread of its own (web/PROTOCOL.md). Any thread may call the `show`
/// functions; they never wait for a page. A slow page misses pictures and delays nothing else.
class ViewerServer {
 public:
  /// Serves clients that already wait at the port and later ones. Two runs are shown side by side; `run` in
  /// the functions below is the index in `runs`.
  ViewerServer(ViewerPort port, const std::vector<RunToShow>& runs);
  ~ViewerServer();  ///< closes all connections
  ViewerServer(const ViewerServer&) = delete;
  ViewerServer& operator=(const ViewerServer&) = delete;

  /// See ViewerPort::url.
  [[nodiscard]] const std::string& url() const noexcept;

  /// Sets the scene of all content shown from now on.
  void show_scene(std::shared_ptr<const Scene> scene, std::size_t run = 0);
  /// Shows a picture; one without values for all nodes of the scene is ignored. `body`, to which the scene
  /// belongs, is used only during the call to draw the picture's overlay; null for none.
  void show_picture(SurfacePicture picture, const Body* body = nullptr, std::size_t run = 0);
  /// Shows ticks that are `stride` apart. In a live run, pages receive at most the last two seconds.
  void show_ticks(std::span<const TickNote> ticks, std::int64_t stride = 1, std::size_t run = 0);
  /// Shows the common members of the message `state`, given as a JSON object; the server adds those of each
  /// page (`pointer` says whether the run's device is a pointer). `times` of a replay are kept for pages that
  /// join later. Throws Error if it is not an object.
  void show_state(const std::string& json, std::size_t run = 0);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
