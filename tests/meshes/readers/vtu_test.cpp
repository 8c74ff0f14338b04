// .vtu files as VTK itself reads them, legacy .vtk files as VTK itself writes them, and quality as VTK
// measures it.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <random>
#include <sstream>

#include "meshes/quality.h"
#include "meshes/readers/volume_mesh.h"
#include "meshes/readers/vtu_writer.h"
#include "meshes/surface.h"
#include "tests/support/bodies/meshes_bodies.h"
#include "tests/support/files/meshes_files.h"

namespace palpate::vtu_test {
namespace {

using test::contains;
using test::error_of;

/// Runs a Python program with Debian's VTK and returns what it prints.
std::string run_python(const test::ScratchFolder& folder, const std::string& program) {
  const auto script = folder.write("script.py", program), output = folder.path() / "output.txt";
  const std::string command = "cd '" + folder.path().string() + "' && /usr/bin/python3 '" + script.string() +
                              "' > '" + output.string() + "' 2>&1";
  const int status = std::system(command.c_str());  // NOLINT(bugprone-command-processor): our own script
  std::ifstream stream(output);
  std::ostringstream text;
  text << stream.rdbuf();
  EXPECT_EQ(status, 0) << text.str();
  return text.str();
}

TEST(Vtu, VtkReadsBackWhatWasWritten) {
  const test::ScratchFolder folder;
  const Mesh mesh = test::block(ElementType::tet4);
  std::vector<double> displacement(3 * mesh.nodes.size()), depth(mesh.nodes.size());
  for (std::size_t i = 0; i < displacement.size(); ++i) displacement[i] = 1.0 / static_cast<double>(i + 3);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = -static_cast<double>(i);
  const NodalField fields[] = {{"displacement", 3, displacement}, {"depth <m>", 1, depth}};
  write_vtu(folder.path() / "fields.vtu", mesh.nodes, mesh.element, mesh.connectivity, fields);

  std::istringstream output(run_python(folder, R"(
import vtk
reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName("fields.vtu"); reader.Update()
data = reader.GetOutput().GetPointData()
print(data.GetNumberOfArrays())
for name in "displacement", "depth <m>":
    array = data.GetArray(name)
    for i in range(array.GetNumberOfTuples()): print(*map(repr, array.GetTuple(i)))
)"));
  std::size_t arrays = 0;
  output >> arrays;
  ASSERT_EQ(arrays, 2u);
  for (const auto* field : {&displacement, &depth}) {
    for (const double value : *field) {
      double read = 0.0;
      output >> read;
      EXPECT_EQ(read, value);
    }
  }
  EXPECT_TRUE(output.good());
}

/// Bodies of every kind and their boundaries; VTK also says which nodes are on each edge of a cell.
TEST(Vtu, VtkReadsEveryKind) {
  const test::ScratchFolder folder;
  struct Grid {
    std::vector<Vec3> nodes;
    ElementType type;
    std::vector<Index> connectivity;
  };
  std::vector<Grid> grids;
  for (const ElementType type : body_elements) {
    const Mesh mesh = test::block(type);
    const Surface surface = extract_surface(mesh);
    grids.push_back({mesh.nodes, type, mesh.connectivity});
    grids.push_back({mesh.nodes, surface.facet, surface.facets});
  }
  for (std::size_t g = 0; g < grids.size(); ++g) {
    write_vtu(folder.path() / (std::to_string(g) + ".vtu"), grids[g].nodes, grids[g].type,
              grids[g].connectivity, {});
  }
  std::istringstream output(run_python(folder, R"(
import vtk
for g in range(12):
    reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName("%d.vtu" % g); reader.Update()
    grid = reader.GetOutput()
    print(grid.GetNumberOfPoints(), grid.GetNumberOfCells())
    for i in range(grid.GetNumberOfPoints()): print(*map(repr, grid.GetPoint(i)))
    for c in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(c)
        print(cell.GetCellType(), *[cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())])
        for e in range(cell.GetNumberOfEdges()):
            edge = cell.GetEdge(e)
            if edge.GetNumberOfPoints() < 3: continue
            a, b, middle = [grid.GetPoint(edge.GetPointId(i)) for i in range(3)]
            assert all(abs(a[k] + b[k] - 2 * middle[k]) < 1e-15 for k in range(3))
)"));
  for (const Grid& grid : grids) {
    SCOPED_TRACE(traits(grid.type).name);
    const auto width = static_cast<std::size_t>(traits(grid.type).nodes);
    std::size_t node_count = 0, cell_count = 0;
    output >> node_count >> cell_count;
    ASSERT_EQ(node_count, grid.nodes.size());
    ASSERT_EQ(cell_count, grid.connectivity.size() / width);
    for (const Vec3& x : grid.nodes) {
      Vec3 read;
      output >> read.x() >> read.y() >> read.z();
      EXPECT_EQ(read, x);
    }
    for (std::size_t i = 0; i < grid.connectivity.size(); ++i) {
      int type = traits(grid.type).vtk;
      Index read = -1;
      if (i % width == 0) output >> type;
      EXPECT_EQ(type, traits(grid.type).vtk);
      output >> read;
      EXPECT_EQ(read, grid.connectivity[i]);
    }
  }
  EXPECT_TRUE(output.good());
}

/// Verdict's measures, which VTK carries; its radius ratios are the inverse of ours.
TEST(Vtu, QualityIsWhatVtkMeasures) {
  const test::ScratchFolder folder;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.02, 0.02);
  std::vector<QualityReport> reports;
  for (const ElementType type :
       {ElementType::tri3, ElementType::quad4, ElementType::tet4, ElementType::hex8}) {
    Mesh mesh = test::block(type);
    for (Vec3& x : mesh.nodes) {
      for (int axis = 0; axis < mesh.dimension(); ++axis) x[axis] += shift(random);
    }
    reports.push_back(measure_quality(mesh));
    write_vtu(folder.path() / (std::string(traits(type).name) + ".vtu"), mesh.nodes, type, mesh.connectivity,
              {});
  }
  std::istringstream output(run_python(folder, R"(
import vtk
quality = vtk.vtkMeshQuality
for name, measure in (("tri3", quality.TriangleRadiusRatio), ("quad4", quality.QuadScaledJacobian),
                      ("tet4", quality.TetRadiusRatio), ("hex8", quality.HexScaledJacobian)):
    reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName(name + ".vtu"); reader.Update()
    grid = reader.GetOutput()
    values = [measure(grid.GetCell(c)) for c in range(grid.GetNumberOfCells())]
    if name in ("tri3", "tet4"): values = [1 / value for value in values]
    print(repr(min(values)), values.index(min(values)), repr(sum(values) / len(values)))
)"));
  for (const QualityReport& report : reports) {
    double smallest = 0.0, mean = 0.0;
    Index worst = -1;
    output >> smallest >> worst >> mean;
    EXPECT_NEAR(report.min_shape, smallest, 1e-12);
    EXPECT_EQ(report.worst_element, worst);
    EXPECT_NEAR(report.mean_shape, mean, 1e-12);
  }
  EXPECT_TRUE(output.good());
}

TEST(Vtu, NothingIsLeftBehindWhenItCannotBeWritten) {
  const test::ScratchFolder folder;
  const Mesh mesh = generate(BoxShape{});
  const Error error = error_of(
      [&] { write_vtu(folder.path() / "none" / "a.vtu", mesh.nodes, mesh.element, mesh.connectivity, {}); });
  EXPECT_TRUE(contains(error.what(), "No such file")) << error.what();
  EXPECT_TRUE(contains(error.where(), "a.vtu"));
  std::filesystem::create_directory(folder.path() / "b.vtu");  // cannot be replaced by a file
  EXPECT_THROW(write_vtu(folder.path() / "b.vtu", mesh.nodes, mesh.element, mesh.connectivity, {}), Error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "b.vtu.partial"));
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit small = before;
  small.rlim_cur = 100;  // bytes, as on a full disk
  setrlimit(RLIMIT_FSIZE, &small);
  const auto action = std::signal(SIGXFSZ, SIG_IGN);
  const Error full =
      error_of([&] { write_vtu(folder.path() / "c.vtu", mesh.nodes, mesh.element, mesh.connectivity, {}); });
  std::signal(SIGXFSZ, action);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_TRUE(contains(full.what(), "File too large")) << full.what();
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "c.vtu"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "c.vtu.partial"));
}

TEST(VtkLegacy, FilesThatVtkWritesInBothLayoutsAreRead) {
  const test::ScratchFolder folder;
  for (const ElementType type : body_elements) {
    const Mesh mesh = test::block(type);
    write_vtu(folder.path() / (std::string(traits(type).name) + ".vtu"), mesh.nodes, type, mesh.connectivity,
              {});
  }
  run_python(folder, R"(
import vtk
def add(grid, cell_type, *nodes):
    ids = vtk.vtkIdList()
    for node in nodes: ids.InsertNextId(node)
    grid.InsertNextCell(cell_type, ids)
for name in "tri3", "quad4", "tet4", "tet4a", "tet10", "hex8":
    reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName(name + ".vtu"); reader.Update()
    grid = reader.GetOutput()
    add(grid, 1, 0); add(grid, 3, 0, 1); add(grid, 2, 0, 3, 1); add(grid, 21, 0, 1, 2)
    if grid.GetCell(0).GetCellDimension() == 3:
        add(grid, 5, 0, 1, 3); add(grid, 22, 0, 1, 3, 5, 6, 7); add(grid, 9, 0, 1, 3, 2)
    data = vtk.vtkDoubleArray(); data.SetName("time"); data.InsertNextValue(0.5); grid.GetFieldData().AddArray(data)
    data = vtk.vtkDoubleArray(); data.SetName("speed"); data.SetNumberOfTuples(grid.GetNumberOfPoints()); data.Fill(2); grid.GetPointData().AddArray(data)
    for version in 42, 51:
        writer = vtk.vtkUnstructuredGridWriter(); writer.SetInputData(grid); writer.SetFileTypeToASCII()
        writer.SetFileVersion(version); writer.SetFileName("%s_%d.vtk" % (name, version)); writer.Write()
    writer.SetFileTypeToBinary(); writer.SetFileName("binary.vtk"); writer.Write()
)");
  for (const ElementType type : body_elements) {
    const Mesh mesh = test::block(type);
    for (const char* version : {"42", "51"}) {
      SCOPED_TRACE(std::string(traits(type).name) + " " + version);
      const Mesh read =
          read_volume_mesh(folder.path() / (std::string(traits(type).name) + "_" + version + ".vtk"));
      EXPECT_EQ(traits(read.element).vtk, traits(type).vtk);
      EXPECT_EQ(read.connectivity, mesh.connectivity);
      EXPECT_EQ(read.regions, std::vector<Index>(static_cast<std::size_t>(mesh.elements()), 0));
      EXPECT_TRUE(read.tagged_facets.empty());
      ASSERT_EQ(read.nodes.size(), mesh.nodes.size());
      for (std::size_t i = 0; i < read.nodes.size(); ++i)
        EXPECT_LT((read.nodes[i] - mesh.nodes[i]).norm(), 1e-6);
    }
  }
  const Error binary = error_of([&] { read_volume_mesh(folder.path() / "binary.vtk"); });
  EXPECT_TRUE(contains(binary.what(), "binary"));
  EXPECT_TRUE(contains(binary.hint(), "ASCII"));
  EXPECT_TRUE(contains(binary.where(), "binary.vtk:3")) << binary.where();
}

}  // namespace
}  // namespace palpate::vtu_test
