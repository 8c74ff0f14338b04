// Serves OpenIGTLink clients.
#pragma once

#include <memory>

#include "runtime/scene/scene.h"
#include "runtime/serving/listening_socket.h"

namespace palpate {

/// Clients that may be connected at once.
constexpr std::size_t most_igtl_clients = 8;

/// Sends surface, tool and force to all clients, from a thread of its own. For one more than
/// `most_igtl_clients` that which is slowest to take what it is sent is cut; where none is slow, the newest
/// of the address with the most connections, the new one counted, gives way to it: where each has only one,
/// the new one is turned away. Asks nothing and obeys nothing. The `show` functions may be called by any
/// thread; they never wait for a client.
class IgtlServer {
 public:
  /// Serves who waits at the socket and who comes later.
  explicit IgtlServer(ListeningSocket socket);
  /// Closes all connections, after the last picture where clients take it within half a second.
  ~IgtlServer();
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;

  /// All pictures from now on are of this scene.
  void show_scene(std::shared_ptr<const Scene> scene);
  /// A picture without values for all nodes of the scene is not sent. `body`, which the scene is of, is used
  /// during the call only, to draw the picture's overlay.
  void show_picture(SurfacePicture picture, const Body& body);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
