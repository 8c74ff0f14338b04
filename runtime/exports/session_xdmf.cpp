#include "runtime/exports/session_xdmf.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <string>

#include "base/write_file.h"

namespace palpate {
namespace {

/// Escapes a file name for the value of an XML entity, which is parsed twice.
std::string escape(const std::string& name) {
  std::string escaped;
  for (const char c : name) {
    switch (c) {
      case '&':
        escaped += "&#38;#38;";
        break;
      case '<':
        escaped += "&#38;#60;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      case '%':
        escaped += "&#37;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// Scalar field of a picture.
struct Scalar {
  char entity;
  const char* dataset;
  const char* name;
};
constexpr std::array<Scalar, 2> nodal_scalars = {
    {{'s', "von_mises", "von Mises stress"}, {'p', "pressure", "contact pressure"}}};

}  // namespace

std::filesystem::path xdmf_path(const std::filesystem::path& hdf5) {
  return std::filesystem::path(hdf5).replace_extension(".xdmf");
}

void write_xdmf(const std::filesystem::path& hdf5, const RecordedSurface& surface,
                std::span<const double> times) {
  const std::string file = escape(hdf5.filename().string());
  const std::size_t S = surface.nodes.size(), F = times.size();
  const int d = surface.corners;
  const std::size_t T = surface.simplices.size() / static_cast<std::size_t>(d);
  const std::string kind =
      d == 3 ? R"(TopologyType="Triangle")" : R"(TopologyType="Polyline" NodesPerElement="2")";
  std::string scalars;
  for (const Scalar& scalar : nodal_scalars) {
    scalars += fmt::format(
        "<!ENTITY {} '<DataItem Dimensions=\"{} {}\" NumberType=\"Float\" Precision=\"4\" "
        "Format=\"HDF\">{}:/frames/{}</DataItem>'>\n",
        scalar.entity, F, S, file, scalar.dataset);
  }
  FileWriter out(xdmf_path(hdf5));
  out.write(fmt::format(
      "<?xml version=\"1.0\"?>\n<!-- palpate " PALPATE_VERSION
      " -->\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" [\n"
      "<!ENTITY t '<Topology {kind} NumberOfElements=\"{T}\"><DataItem Dimensions=\"{T} {d}\" "
      "NumberType=\"Int\" Format=\"HDF\">{file}:/surface/simplices</DataItem></Topology>'>\n"
      "<!ENTITY x '<DataItem Dimensions=\"{S} 3\" NumberType=\"Float\" Precision=\"8\" "
      "Format=\"HDF\">{file}:/surface/nodes</DataItem>'>\n"
      "<!ENTITY u '<DataItem Dimensions=\"{F} {S} 3\" NumberType=\"Float\" Precision=\"4\" "
      "Format=\"HDF\">{file}:/frames/displacement</DataItem>'>\n"
      "{scalars}"
      "]>\n<Xdmf Version=\"2.0\"><Domain><Grid GridType=\"Collection\" CollectionType=\"Temporal\">\n",
      fmt::arg("kind", kind), fmt::arg("T", T), fmt::arg("d", d), fmt::arg("S", S), fmt::arg("F", F),
      fmt::arg("file", file), fmt::arg("scalars", scalars)));
  for (std::size_t k = 0; k < F; ++k) {
    const std::string u = fmt::format(
        "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{0} 3\"><DataItem Dimensions=\"3 3\">{1} 0 0 1 1 1 1 "
        "{0} 3</DataItem>&u;</DataItem>",
        S, k);
    // ParaView keeps the geometry of the previous frame if its first text is the same; hence the comment.
    std::string text;
    fmt::format_to(std::back_inserter(text),
                   "<Grid><Time Value=\"{}\"/>&t;<Geometry><DataItem ItemType=\"Function\" "
                   "Function=\"$0 + $1\" Dimensions=\"{} 3\"><!--{}-->&x;{}</DataItem></Geometry>"
                   "<Attribute Name=\"displacement\" AttributeType=\"Vector\">{}</Attribute>",
                   times[k], S, k, u, u);
    for (const Scalar& scalar : nodal_scalars) {
      fmt::format_to(std::back_inserter(text),
                     "<Attribute Name=\"{}\" AttributeType=\"Scalar\"><DataItem ItemType=\"HyperSlab\" "
                     "Dimensions=\"{}\"><DataItem Dimensions=\"3 2\">{} 0 1 1 1 {}</DataItem>&{};</DataItem>"
                     "</Attribute>",
                     scalar.name, S, k, S, scalar.entity);
    }
    out.write(text + "</Grid>\n");
  }
  out.write("</Grid></Domain></Xdmf>\n");
  out.finish();
}

}  // namespace palpate
