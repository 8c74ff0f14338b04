// Pictures of a run, from the messages that pages are sent (web/PROTOCOL.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace palpate {

/// The surface with its values at nodes, those of an overlay's finer surface last, the tool and its force.
/// Coordinates are the model's.
struct WatchedPicture {
  double time = 0.0;                        ///< of the tick since the run began [s]
  std::array<float, 7> tool{};              ///< position [m], quaternion x y z w
  std::array<float, 3> force{}, torque{};   ///< on the body [N], about the tool's origin [N m]
  std::vector<std::array<float, 3>> nodes;  ///< [n] as they are seen [m]
  std::size_t corners = 3;                  ///< of a cell: 3 of triangles, 2 of lines
  std::vector<std::uint32_t> cells;         ///< [cells x corners] nodes
  std::vector<float> displacement;          ///< [n] its size [m]
  std::vector<float> von_mises;             ///< [n] NaN where unknown [Pa]
  std::vector<float> pressure;              ///< [n] contact pressure [Pa]
};

/// Puts pictures together.
class PictureReader {
 public:
  /// True where the message completes a picture. Throws std::out_of_range where it is none of the protocol,
  /// or a picture that is not sent whole.
  [[nodiscard]] bool take(std::string_view message);
  /// The last one.
  [[nodiscard]] const WatchedPicture& picture() const noexcept { return picture_; }

 private:
  struct Mesh {
    std::uint32_t number = 0;
    std::vector<std::array<float, 3>> nodes;  // without loads
    std::vector<std::uint32_t> triangles;
    std::vector<std::uint32_t> others;  // lines of a scene; triangles of the scene that a patch hides
  };
  class Reader;

  void take_scene(Reader& message);
  void take_patch(Reader& message);
  void take_frame(Reader& message);
  void take_values(std::array<std::int32_t, 2> exponents, std::string_view bits);
  void join_cells();

  Mesh scene_, patch_;
  WatchedPicture picture_;
};

}  // namespace palpate
