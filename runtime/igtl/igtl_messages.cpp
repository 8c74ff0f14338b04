#include "runtime/igtl/igtl_messages.h"

#include <fmt/format.h>
#include <igtlMath.h>
#include <igtlPolyDataMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {
namespace {

constexpr float mm_per_m = 1e3F;

/// Packs a message and returns its bytes.
std::string finish(igtl::MessageBase& message, const char* name, double time) {
  message.SetDeviceName(name);
  const double seconds = std::floor(time);
  message.SetTimeStamp(static_cast<std::uint32_t>(seconds),
                       static_cast<std::uint32_t>(std::ldexp(time - seconds, 32)));
  message.Pack();
  return {static_cast<const char*>(message.GetPackPointer()),
          static_cast<std::size_t>(message.GetPackSize())};
}

igtl::PolyDataCellArray::Pointer cell_array(std::vector<std::uint32_t> nodes, std::size_t corners) {
  auto cells = igtl::PolyDataCellArray::New();
  for (std::size_t at = 0; at < nodes.size(); at += corners)
    cells->AddCell(static_cast<int>(corners), nodes.data() + at);
  return cells;
}

igtl::PolyDataPointArray::Pointer point_array(const std::vector<std::array<float, 3>>& nodes) {
  auto points = igtl::PolyDataPointArray::New();
  points->SetNumberOfPoints(static_cast<int>(nodes.size()));
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto& [x, y, z] = nodes[k];
    points->SetPoint(static_cast<unsigned>(k), mm_per_m * x, mm_per_m * y, mm_per_m * z);
  }
  return points;
}

void add_scalars(igtl::PolyDataMessage& message, const char* name, std::vector<float> values) {
  auto attribute = igtl::PolyDataAttribute::New();
  attribute->SetType(igtl::PolyDataAttribute::POINT_SCALAR);
  attribute->SetSize(static_cast<igtlUint32>(values.size()));
  attribute->SetName(name);
  attribute->SetData(values.data());
  message.AddAttribute(attribute);
}

}  // namespace

std::string igtl_surface(const WatchedPicture& picture) {
  auto message = igtl::PolyDataMessage::New();
  message->SetPoints(point_array(picture.nodes));
  auto cells = cell_array(picture.cells, picture.corners);
  if (picture.corners == 3) {
    message->SetPolygons(cells);
  } else {
    message->SetLines(cells);
  }
  std::vector<float> displacement = picture.displacement;
  for (float& size : displacement) size *= mm_per_m;
  add_scalars(*message, "displacement [mm]", std::move(displacement));
  add_scalars(*message, "von Mises stress [Pa]", picture.von_mises);
  add_scalars(*message, "contact pressure [Pa]", picture.pressure);
  return finish(*message, igtl_surface_name, picture.time);
}

std::string igtl_tool(const WatchedPicture& picture) {
  std::array<float, 4> quaternion{};
  std::copy(picture.tool.begin() + 3, picture.tool.end(), quaternion.begin());
  igtl::Matrix4x4 matrix{};
  igtl::QuaternionToMatrix(quaternion.data(), matrix);
  for (std::size_t axis = 0; axis < 3; ++axis) matrix[axis][3] = mm_per_m * picture.tool[axis];
  auto message = igtl::TransformMessage::New();
  message->SetMatrix(matrix);
  return finish(*message, igtl_tool_name, picture.time);
}

std::string igtl_force(const WatchedPicture& picture) {
  const auto& [x, y, z] = picture.force;
  const auto& [a, b, c] = picture.torque;
  std::string text = fmt::format(R"({{"force_N":[{},{},{}],"torque_Nm":[{},{},{}]}})", 0 - x, 0 - y, 0 - z,
                                 0 - a, 0 - b, 0 - c);
  auto message = igtl::StringMessage::New();
  message->SetString(text);
  return finish(*message, igtl_force_name, picture.time);
}

}  // namespace palpate
