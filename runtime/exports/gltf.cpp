#include "runtime/exports/gltf.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/json_text.h"
#include "runtime/exports/tool_mesh.h"

namespace palpate {
namespace {

using nlohmann::json;

// Constants of the specification (Khronos, glTF 2.0).
constexpr int float_component = 5126, index_component = 5125;
constexpr int vertex_buffer = 34962, index_buffer = 34963;
constexpr int lines = 1, triangles = 4;

constexpr std::size_t glb_header = 12;  // [bytes]

constexpr double point_share = 0.01;  // [size of the body] radius at which a tool without one is drawn
const double half = std::sqrt(0.5);
const json z_becomes_y = json::array({-half, 0.0, 0.0, half});

using Floats = std::vector<float>;

/// Binary part with its views and accessors.
class Buffer {
 public:
  /// Appends floats, `width` per element, and returns the number of their accessor. `target`: buffer target
  /// of the view, 0 for none.
  int add(const Floats& numbers, int width, int target) {
    constexpr const char* types[] = {"SCALAR", "", "VEC3", "VEC4"};
    json accessor = {{"componentType", float_component},
                     {"count", numbers.size() / static_cast<std::size_t>(width)},
                     {"type", types[width - 1]}};
    if (width == 3 || target == 0) {  // required for positions and times
      Floats least(numbers.begin(), numbers.begin() + width), most = least;
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        const std::size_t axis = k % static_cast<std::size_t>(width);
        least[axis] = std::min(least[axis], numbers[k]);
        most[axis] = std::max(most[axis], numbers[k]);
      }
      accessor["min"] = least;
      accessor["max"] = most;
    }
    return add(accessor, numbers.data(), sizeof(float) * numbers.size(), target);
  }

  int add(const std::vector<std::uint32_t>& corners) {
    return add({{"componentType", index_component}, {"count", corners.size()}, {"type", "SCALAR"}},
               corners.data(), sizeof(std::uint32_t) * corners.size(), index_buffer);
  }

  json views = json::array(), accessors = json::array();
  std::string bytes;

 private:
  int add(json accessor, const void* data, std::size_t size, int target) {
    json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    bytes.append(static_cast<const char*>(data), size);
    accessor["bufferView"] = views.size();
    views.push_back(view);
    accessors.push_back(accessor);
    return static_cast<int>(accessors.size()) - 1;
  }
};

Floats floats_of(const std::vector<Vec3>& vectors) {
  Floats numbers;
  for (const Vec3& v : vectors) {
    for (const double x : v) numbers.push_back(static_cast<float>(x));
  }
  return numbers;
}

std::vector<Vec3> displaced(const RecordedSurface& surface, const SurfaceFrame& frame) {
  std::vector<Vec3> places = surface.nodes;
  for (std::size_t node = 0; node < places.size(); ++node)
    places[node] += Eigen::Map<const Eigen::Vector3f>(&frame.displacement[3 * node]).cast<double>();
  return places;
}

/// Nodal normals: means of the adjacent triangles' normals, weighted by area.
std::vector<Vec3> normals_of(const RecordedSurface& surface, const std::vector<Vec3>& places) {
  std::vector<Vec3> normals(places.size(), Vec3::Zero());
  for (std::size_t t = 0; t < surface.simplices.size(); t += 3) {
    const auto corner = [&](std::size_t k) { return static_cast<std::size_t>(surface.simplices[t + k]); };
    const Vec3 twice = (places[corner(1)] - places[corner(0)]).cross(places[corner(2)] - places[corner(0)]);
    for (std::size_t k = 0; k < 3; ++k) normals[corner(k)] += twice;
  }
  for (Vec3& normal : normals) {
    const double length = normal.norm();
    normal = length > 0.0 ? Vec3(normal / length) : Vec3::UnitZ();
  }
  return normals;
}

Floats change(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  std::vector<Vec3> differences(from.size());
  for (std::size_t k = 0; k < from.size(); ++k) differences[k] = to[k] - from[k];
  return floats_of(differences);
}

json material(const char* name, const std::array<double, 4>& color, double roughness) {
  return {{"name", name},
          {"doubleSided", true},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", color}, {"metallicFactor", 0.0}, {"roughnessFactor", roughness}}}};
}

std::vector<std::uint32_t> corners_of(const std::vector<Index>& simplices) {
  return {simplices.begin(), simplices.end()};
}

/// Time and tool pose of each picture.
struct Moments {
  std::vector<double> times;
  std::vector<ToolPose> tools;
};

/// Mesh of the surface at rest without loads, with the pictures as morph targets.
json surface_mesh(const RecordedSurface& surface, std::size_t pictures,
                  const std::function<SurfacePicture(std::size_t)>& picture_of, Moments& moments,
                  Buffer& buffer) {
  const bool is_solid = surface.corners == 3;
  const std::vector<Vec3> normals = is_solid ? normals_of(surface, surface.nodes) : std::vector<Vec3>{};
  json primitive = {{"attributes", {{"POSITION", buffer.add(floats_of(surface.nodes), 3, vertex_buffer)}}},
                    {"mode", is_solid ? triangles : lines},
                    {"material", 0}};
  if (is_solid) primitive["attributes"]["NORMAL"] = buffer.add(floats_of(normals), 3, vertex_buffer);
  primitive["indices"] = buffer.add(corners_of(surface.simplices));
  for (std::size_t k = 0; k < pictures; ++k) {
    const SurfacePicture picture = picture_of(k);
    moments.times.push_back(picture.frame.time);
    moments.tools.push_back(picture.tool);
    const std::vector<Vec3> places = displaced(surface, picture.frame);
    json target = {{"POSITION", buffer.add(picture.frame.displacement, 3, vertex_buffer)}};
    if (is_solid)
      target["NORMAL"] = buffer.add(change(normals, normals_of(surface, places)), 3, vertex_buffer);
    primitive["targets"].push_back(target);
  }
  Floats weights(pictures, 0.0F);
  weights.front() = 1.0F;
  return {{"name", "surface"}, {"primitives", json::array({primitive})}, {"weights", weights}};
}

json mesh_of_tool(const ToolMesh& mesh, Buffer& buffer) {
  const json primitive = {{"attributes",
                           {{"POSITION", buffer.add(floats_of(mesh.positions), 3, vertex_buffer)},
                            {"NORMAL", buffer.add(floats_of(mesh.normals), 3, vertex_buffer)}}},
                          {"indices", buffer.add(corners_of(mesh.triangles))},
                          {"material", 1}};
  return {{"name", "tool"}, {"primitives", json::array({primitive})}};
}

/// Animation that shows the morph target and the tool pose of each picture.
json animation(const Moments& moments, int surface_node, int tool_node, Buffer& buffer) {
  const std::size_t pictures = moments.times.size();
  Floats times, weights(pictures * pictures, 0.0F), places, turns;
  for (std::size_t k = 0; k < pictures; ++k) {
    times.push_back(static_cast<float>(moments.times[k] - moments.times.front()));
    weights[k * pictures + k] = 1.0F;
    const ToolPose& tool = moments.tools[k];
    for (const double x : tool.position) places.push_back(static_cast<float>(x));
    for (const double x : tool.orientation.coeffs()) turns.push_back(static_cast<float>(x));  // x, y, z, w
  }
  const int input = buffer.add(times, 1, 0);
  json samplers = json::array(), channels = json::array();
  const auto move = [&](int node, const char* path, int output) {
    channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", node}, {"path", path}}}});
    samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  };
  move(surface_node, "weights", buffer.add(weights, 1, 0));
  move(tool_node, "translation", buffer.add(places, 3, 0));
  move(tool_node, "rotation", buffer.add(turns, 4, 0));
  return {{"name", "session"}, {"samplers", samplers}, {"channels", channels}};
}

void append(std::string& bytes, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xFFU);
}

/// Header of a chunk of `bytes` bytes.
std::string chunk_head(const char* kind, std::size_t bytes) {
  std::string head;
  append(head, static_cast<std::uint32_t>(bytes));
  return head.append(kind, 4);
}

void fill_up(std::string& chunk, char filling) {
  chunk.resize((chunk.size() + 3) / 4 * 4, filling);
}

}  // namespace

std::size_t glb_bytes(const RecordedSurface& surface, std::size_t pictures) noexcept {
  return sizeof(float) * 3 * surface.nodes.size() * (pictures + 1) * (surface.corners == 3 ? 2 : 1);
}

void write_glb(FileWriter& file, const std::string& name, const RecordedSurface& surface, const Tool& tool,
               std::size_t pictures, const std::function<SurfacePicture(std::size_t)>& picture) {
  Eigen::AlignedBox3d bounds;
  for (const Vec3& node : surface.nodes) bounds.extend(node);
  Buffer buffer;
  json scene;
  scene["asset"] = {{"version", "2.0"}, {"generator", "Palpate " PALPATE_VERSION}};
  scene["scene"] = 0;
  scene["scenes"] = json::array({{{"name", name}, {"nodes", json::array({0})}}});
  scene["nodes"] =
      json::array({{{"name", name}, {"rotation", z_becomes_y}, {"children", json::array({1, 2})}},
                   {{"name", "surface"}, {"mesh", 0}},
                   {{"name", "tool"}, {"mesh", 1}}});
  scene["materials"] = json::array(
      {material("body", {0.62, 0.24, 0.2, 1.0}, 0.45), material("tool", {0.75, 0.77, 0.8, 1.0}, 0.3)});
  const ToolMesh seen_tool = tool_mesh(tool, point_share * bounds.diagonal().norm());
  Moments moments;
  json body = surface_mesh(surface, pictures, picture, moments, buffer);
  scene["meshes"] = json::array({std::move(body), mesh_of_tool(seen_tool, buffer)});
  scene["animations"] = json::array({animation(moments, 1, 2, buffer)});
  scene["bufferViews"] = buffer.views;
  scene["accessors"] = buffer.accessors;
  scene["buffers"] = json::array({{{"byteLength", buffer.bytes.size()}}});

  std::string text = json_text(scene);
  fill_up(text, ' ');
  fill_up(buffer.bytes, '\0');
  constexpr std::size_t head_bytes = 8;  // header of a chunk
  std::string head = "glTF";
  append(head, 2);
  append(head, static_cast<std::uint32_t>(glb_header + 2 * head_bytes + text.size() + buffer.bytes.size()));
  file.write(head + chunk_head("JSON", text.size()));
  file.write(text);
  file.write(chunk_head("BIN\0", buffer.bytes.size()));
  file.write(buffer.bytes);
}

}  // namespace palpate
