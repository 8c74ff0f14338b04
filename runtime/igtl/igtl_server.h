// Server for OpenIGTLink clients.
#pragma once

#include <memory>

#include "runtime/scene/scene.h"
#include "runtime/serving/listening_socket.h"

namespace palpate {

/// Largest number of connected clients.
constexpr std::size_t most_igtl_clients = 8;

/// Sends surface, tool and force to all clients, from a thread of its own. If one more than
/// `most_igtl_clients` connects, the slowest client is disconnected; if none is slow, the newest of the
/// address with the most connections, counting the new one, gives way; if each address has one only, the new
/// one is turned away. It sends no requests and accepts none. Any thread may call the `show` functions; they
/// never wait for a client.
class IgtlServer {
 public:
  /// Serves clients that already wait at the socket and later ones.
  explicit IgtlServer(ListeningSocket socket);
  /// Closes all connections, after the last picture if clients receive it within half a second.
  ~IgtlServer();
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;

  /// Sets the scene of all pictures from now on.
  void show_scene(std::shared_ptr<const Scene> scene);
  /// Sends a picture; one without values for all nodes of the scene is ignored. `body`, to which the scene
  /// belongs, is used only during the call to draw the picture's overlay.
  void show_picture(SurfacePicture picture, const Body& body);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
