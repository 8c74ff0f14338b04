#include "formats/output_kind.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <sstream>
#include <string>

#include "base/error.h"
#include "formats/contents.h"
#include "formats/mcap/reader.h"
#include "formats/recording_messages.h"

namespace palpate {
namespace {

constexpr std::size_t beginning = 4096;  // bytes that identify a file

/// The first bytes of a file, at most `beginning`; nullopt if it cannot be read.
std::optional<std::string> first_bytes(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  std::string bytes(beginning, '\0');
  const ssize_t got = ::pread(fd, bytes.data(), bytes.size(), 0);
  ::close(fd);
  if (got < 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(got));
  return bytes;
}

/// Attribute `format` of a file with an index.
std::string indexed_format(const std::filesystem::path& file) {
  try {
    return Contents::read(file).text_attribute("/", "format").value_or("");
  } catch (const Error&) {
    return "";
  }
}

bool contains(std::string_view text, std::string_view piece) {
  return text.find(piece) != std::string_view::npos;
}

/// True for XML files of ours, which begin with our comment or, from versions before it, with the given text.
bool is_our_xml(std::string_view text, std::string_view before_there_was_a_mark) {
  constexpr std::string_view head = "<?xml version=\"1.0\"?>\n";
  if (!text.starts_with(head)) return false;
  text.remove_prefix(head.size());
  return text.starts_with("<!-- palpate ") || text.starts_with(before_there_was_a_mark);
}

bool is_our_report(std::string_view text) {
  if (text.starts_with("{\n  \"generator\": \"palpate-")) return true;
  return text.starts_with("{\n  \"file\": ") && contains(text, "\n  \"fast\": ") &&
         contains(text, "\n  \"tool\": ");
}

/// True for an OFF file of triangles that have no common corners.
bool is_loose_triangles(const std::string& text) {
  std::istringstream words(text);
  std::string head;
  std::size_t corners = 0, triangles = 0;
  return words >> head >> corners >> triangles && head == "OFF" && triangles > 0 && corners == 3 * triangles;
}

struct About {
  std::string_view name;
  std::span<const std::string_view> endings;
};

constexpr std::string_view model_endings[] = {".hdf", ".h5", ".hdf5", ".vtkhdf"},
                           hdf5_endings[] = {".h5", ".hdf5", ".hdf"}, mcap[] = {".mcap"},
                           xdmf[] = {".xdmf", ".xmf"}, json[] = {".json"}, csv[] = {".csv"}, vtu[] = {".vtu"},
                           html[] = {".html", ".htm"}, glb[] = {".glb"}, pvd[] = {".pvd"}, off[] = {".off"};

About about(OutputKind kind) noexcept {
  switch (kind) {
    case OutputKind::model:
      return {"model", model_endings};
    case OutputKind::recording:
      return {"recording", mcap};
    case OutputKind::hdf5:
      return {"recording as HDF5", hdf5_endings};
    case OutputKind::frames:
      return {"description of pictures for ParaView", xdmf};
    case OutputKind::report:
      return {"report", json};
    case OutputKind::contacts:
      return {"table of contact points", csv};
    case OutputKind::field:
      return {"table of displacements", csv};
    case OutputKind::grid:
      return {"grid for ParaView", vtu};
    case OutputKind::page:
      return {"page", html};
    case OutputKind::scene:
      return {"glTF scene", glb};
    case OutputKind::series:
      return {"collection for ParaView", pvd};
    case OutputKind::ticks:
      return {"table of ticks", csv};
    case OutputKind::faces:
      return {"list of triangles", off};
    case OutputKind::surface:
      return {"repaired surface", off};
  }
  return {};
}

}  // namespace

std::string_view name_of(OutputKind kind) noexcept {
  return about(kind).name;
}

std::span<const std::string_view> endings_of(OutputKind kind) noexcept {
  return about(kind).endings;
}

bool needs_regular_file(OutputKind kind) noexcept {
  return kind == OutputKind::model || kind == OutputKind::recording || kind == OutputKind::hdf5 ||
         kind == OutputKind::frames;
}

bool is_ours(const std::filesystem::path& file, OutputKind kind) {
  const std::optional<std::string> bytes = first_bytes(file);
  if (!bytes) return false;
  const std::string_view text = *bytes;
  if (text.empty()) return true;
  switch (kind) {
    case OutputKind::model:
    case OutputKind::hdf5:
      return text.starts_with(index_magic) &&
             indexed_format(file) == (kind == OutputKind::model ? "palpate" : "palpate-recording");
    case OutputKind::recording:
      return text.starts_with("\x89MCAP0\r\n") && contains(text, "palpate-recording");
    case OutputKind::frames:
      return is_our_xml(text, "<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" [\n<!ENTITY t '<Topology ");
    case OutputKind::report:
      return is_our_report(text);
    case OutputKind::contacts:
      return text.starts_with(contacts_header);
    case OutputKind::field:
      return text.starts_with("node,x,y,z,u0x,u0y,u0z,ux,uy,uz\n") ||
             text.starts_with("node,x,y,z,u0x,u0y,u0z,ux,uy,uz,sxx,syy,szz,sxy,syz,szx,von_mises\n");
    case OutputKind::grid:
      return is_our_xml(text,
                        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
                        "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=");
    case OutputKind::page:
      return text.starts_with("<!doctype html>") &&
             (contains(text, "<meta name=\"generator\" content=\"palpate-runtime ") ||
              contains(text, "<title>Palpate</title>"));
    case OutputKind::scene:
      return text.starts_with("glTF") && contains(text, "\"generator\":\"Palpate ");
    case OutputKind::series:
      return is_our_xml(text, "<!-- palpate ");
    case OutputKind::ticks:
      return text.starts_with(ticks_header);
    case OutputKind::faces:
      return is_loose_triangles(*bytes);
    case OutputKind::surface:
      return text.starts_with("OFF\n# repaired by palpate-precompute\n");
  }
  return false;
}

bool holds_ticks(const std::filesystem::path& recording) {
  std::error_code unknown;
  if (std::filesystem::file_size(recording, unknown) == 0) return false;
  try {
    const mcap::Layout layout = mcap::read_layout(open_file(recording, OpenMode::read));
    return std::ranges::any_of(layout.chunks, [](const mcap::ChunkPlace& chunk) {
      return std::ranges::any_of(chunk.index, [](const mcap::MessageIndex& index) {
        return index.channel == static_cast<std::uint16_t>(RecordedChannel::tick) && index.count > 0;
      });
    });
  } catch (const Error&) {
    return true;
  }
}

}  // namespace palpate
