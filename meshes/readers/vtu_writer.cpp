#include "meshes/readers/vtu_writer.h"

#include <fmt/format.h>

#include <bit>

#include "base/words.h"
#include "base/write_file.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the raw numbers are written as they are in memory");

/// The XML head and the raw data that it points into.
class Document {
 public:
  template <class Number>
  void add_array(const char* type, const std::string& name, int components, std::span<const Number> values) {
    xml_ += fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n",
        type, name, components, raw_.size());
    const std::uint64_t bytes = values.size_bytes();
    append(&bytes, sizeof bytes);
    append(values.data(), bytes);
  }
  void add(const std::string& xml) { xml_ += xml; }

  [[nodiscard]] std::string text() const {
    return xml_ + "<AppendedData encoding=\"raw\">\n_" + raw_ + "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  void append(const void* data, std::size_t bytes) {
    if (bytes > 0) raw_.append(static_cast<const char*>(data), bytes);
  }

  std::string xml_;
  std::string raw_;
};

void add_cells(Document& document, ElementType element, std::span<const Index> connectivity) {
  const auto width = static_cast<std::size_t>(traits(element).nodes), cells = connectivity.size() / width;
  std::vector<std::int64_t> offsets(cells);
  for (std::size_t i = 0; i < cells; ++i) offsets[i] = static_cast<std::int64_t>(width * (i + 1));
  const std::vector<std::uint8_t> types(cells, traits(element).vtk);
  document.add("<Cells>\n");
  document.add_array<Index>("Int32", "connectivity", 1, connectivity);
  document.add_array<std::int64_t>("Int64", "offsets", 1, offsets);
  document.add_array<std::uint8_t>("UInt8", "types", 1, types);
  document.add("</Cells>\n");
}

Document make_document(std::span<const Vec3> nodes, ElementType element, std::span<const Index> connectivity,
                       std::span<const NodalField> fields) {
  Document document;
  document.add("<?xml version=\"1.0\"?>\n<!-- palpate " PALPATE_VERSION
               " -->\n"
               "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
               "header_type=\"UInt64\">\n");
  document.add(fmt::format("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
                           nodes.size(),
                           connectivity.size() / static_cast<std::size_t>(traits(element).nodes)));
  document.add("<PointData>\n");
  for (const NodalField& field : fields) {
    document.add_array<double>("Float64", xml_escaped(field.name), field.components, field.values);
  }
  document.add("</PointData>\n<Points>\n");
  document.add_array<double>("Float64", "Points", 3,
                             {nodes.empty() ? nullptr : nodes.data()->data(), 3 * nodes.size()});
  document.add("</Points>\n");
  add_cells(document, element, connectivity);
  document.add("</Piece>\n</UnstructuredGrid>\n");
  return document;
}

}  // namespace

std::string vtu_text(std::span<const Vec3> nodes, ElementType element, std::span<const Index> connectivity,
                     std::span<const NodalField> fields) {
  return make_document(nodes, element, connectivity, fields).text();
}

void write_vtu(const std::filesystem::path& file, std::span<const Vec3> nodes, ElementType element,
               std::span<const Index> connectivity, std::span<const NodalField> fields) {
  write_file(file, vtu_text(nodes, element, connectivity, fields));
}

}  // namespace palpate
