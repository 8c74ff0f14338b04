#include "runtime/igtl/igtl_messages.h"

#include <fmt/format.h>
#include <igtlPolyDataMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "runtime/scene/seen_surface.h"

namespace palpate {
namespace {

constexpr double mm_per_m = 1e3;

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

/// Returns cells of `corners` nodes.
igtl::PolyDataCellArray::Pointer cell_array(std::span<const Index> nodes, std::size_t corners) {
  auto cells = igtl::PolyDataCellArray::New();
  std::array<igtlUint32, 3> cell{};
  for (std::size_t at = 0; at < nodes.size(); at += corners) {
    for (std::size_t k = 0; k < corners; ++k) cell[k] = static_cast<igtlUint32>(nodes[at + k]);
    cells->AddCell(static_cast<int>(corners), cell.data());
  }
  return cells;
}

igtl::PolyDataPointArray::Pointer point_array(std::span<const Vec3> nodes) {
  auto points = igtl::PolyDataPointArray::New();
  points->SetNumberOfPoints(static_cast<int>(nodes.size()));
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Eigen::Vector3f p = (mm_per_m * nodes[k]).cast<float>();
    points->SetPoint(static_cast<unsigned>(k), p.x(), p.y(), p.z());
  }
  return points;
}

void add_scalars(igtl::PolyDataMessage& message, const char* name, std::span<const double> values) {
  std::vector<igtlFloat32> numbers;
  for (const double value : values) numbers.push_back(static_cast<igtlFloat32>(value));
  auto attribute = igtl::PolyDataAttribute::New();
  attribute->SetType(igtl::PolyDataAttribute::POINT_SCALAR);
  attribute->SetSize(static_cast<igtlUint32>(numbers.size()));
  attribute->SetName(name);
  attribute->SetData(numbers.data());
  message.AddAttribute(attribute);
}

}  // namespace

std::string igtl_surface(const DrawnPicture& drawn) {
  const SeenMesh mesh = seen_mesh(drawn.picture, *drawn.scene, drawn.patch.get());
  auto message = igtl::PolyDataMessage::New();
  message->SetPoints(point_array(mesh.nodes));
  if (mesh.cell == ElementType::tri3) {
    message->SetPolygons(cell_array(mesh.cells, 3));
  } else {
    message->SetLines(cell_array(mesh.cells, 2));
  }
  std::vector<double> size;  // magnitude of the displacement
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k)
    size.push_back(mm_per_m * Eigen::Map<const Vec3>(mesh.displacement.data() + 3 * k).norm());
  add_scalars(*message, "displacement [mm]", size);
  add_scalars(*message, "von Mises stress [Pa]", mesh.von_mises);
  add_scalars(*message, "contact pressure [Pa]", mesh.pressure);
  return finish(*message, igtl_surface_name, drawn.picture.frame.time);
}

std::string igtl_tool(const SurfacePicture& picture) {
  const Eigen::Matrix3d rotation = picture.tool.orientation.toRotationMatrix();
  igtl::Matrix4x4 matrix{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      matrix[row][column] = static_cast<float>(rotation(row, column));
    matrix[row][3] = static_cast<float>(mm_per_m * picture.tool.position[row]);
  }
  matrix[3][3] = 1.0F;
  auto message = igtl::TransformMessage::New();
  message->SetMatrix(matrix);
  return finish(*message, igtl_tool_name, picture.frame.time);
}

std::string igtl_force(const SurfacePicture& picture) {
  const Vec3 force = Vec3::Zero() - picture.on_body.force;
  const Vec3 torque = Vec3::Zero() - picture.on_body.torque;
  std::string text = fmt::format(R"({{"force_N":[{},{},{}],"torque_Nm":[{},{},{}]}})", force.x(), force.y(),
                                 force.z(), torque.x(), torque.y(), torque.z());
  auto message = igtl::StringMessage::New();
  message->SetString(text);
  return finish(*message, igtl_force_name, picture.frame.time);
}

}  // namespace palpate
