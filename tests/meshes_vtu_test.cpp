// .vtu files as VTK itself reads them, and legacy .vtk files as VTK itself writes them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "meshes/generate.h"
#include "meshes/surface.h"
#include "meshes/volume_mesh.h"
#include "meshes/vtu_writer.h"
#include "tests/meshes_files.h"

namespace palpate {
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
  const Mesh mesh = generate(BoxShape{Vec3(1, 2, 3), Vec3(1, 0.5, 0.1), {2, 1, 1}});
  std::vector<double> displacement(3 * mesh.nodes.size()), depth(mesh.nodes.size());
  for (std::size_t i = 0; i < displacement.size(); ++i) displacement[i] = 1.0 / static_cast<double>(i + 3);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = -static_cast<double>(i);
  const NodalField fields[] = {{"displacement", 3, displacement}, {"depth <m>", 1, depth}};
  write_vtu(folder.path() / "volume.vtu", mesh.nodes, mesh.tets, {}, fields);
  const Surface surface = extract_surface(mesh);
  write_vtu(folder.path() / "surface.vtu", mesh.nodes, {}, surface.triangles, {});

  std::istringstream output(run_python(folder, R"(
import vtk
for name in "volume.vtu", "surface.vtu":
    reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName(name); reader.Update()
    grid = reader.GetOutput()
    print(grid.GetNumberOfPoints(), grid.GetNumberOfCells(), grid.GetPointData().GetNumberOfArrays())
    for i in range(grid.GetNumberOfPoints()): print(*map(repr, grid.GetPoint(i)))
    for c in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(c)
        print(cell.GetCellType(), *[cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())])
    for name in "displacement", "depth <m>":
        array = grid.GetPointData().GetArray(name)
        if array:
            for i in range(array.GetNumberOfTuples()): print(*map(repr, array.GetTuple(i)))
)"));
  const auto expect_grid = [&](const auto& cells, int type, std::size_t arrays) {
    std::size_t node_count = 0, cell_count = 0, array_count = 0;
    output >> node_count >> cell_count >> array_count;
    ASSERT_EQ(node_count, mesh.nodes.size());
    ASSERT_EQ(cell_count, cells.size());
    ASSERT_EQ(array_count, arrays);
    for (const Vec3& x : mesh.nodes) {
      Vec3 read;
      output >> read.x() >> read.y() >> read.z();
      EXPECT_EQ(read, x);
    }
    for (const auto& cell : cells) {
      int read_type = 0;
      output >> read_type;
      EXPECT_EQ(read_type, type);
      for (const Index node : cell) {
        Index read = -1;
        output >> read;
        EXPECT_EQ(read, node);
      }
    }
  };
  expect_grid(mesh.tets, 10, 2);
  for (const auto* field : {&displacement, &depth}) {
    for (const double value : *field) {
      double read = 0.0;
      output >> read;
      EXPECT_EQ(read, value);
    }
  }
  expect_grid(surface.triangles, 5, 0);
  EXPECT_TRUE(output.good());
}

TEST(Vtu, NothingIsLeftBehindWhenItCannotBeWritten) {
  const test::ScratchFolder folder;
  const Mesh mesh = generate(BoxShape{});
  const Error error =
      error_of([&] { write_vtu(folder.path() / "none" / "a.vtu", mesh.nodes, mesh.tets, {}, {}); });
  EXPECT_TRUE(contains(error.what(), "No such file")) << error.what();
  EXPECT_TRUE(contains(error.where(), "a.vtu"));
  std::filesystem::create_directory(folder.path() / "b.vtu");  // cannot be replaced by a file
  EXPECT_THROW(write_vtu(folder.path() / "b.vtu", mesh.nodes, mesh.tets, {}, {}), Error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "b.vtu.partial"));
  if (std::filesystem::exists("/dev/full")) {
    std::filesystem::create_symlink("/dev/full", folder.path() / "c.vtu.partial");
    const Error full = error_of([&] { write_vtu(folder.path() / "c.vtu", mesh.nodes, mesh.tets, {}, {}); });
    EXPECT_TRUE(contains(full.what(), "No space left")) << full.what();
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "c.vtu"));
  }
}

TEST(VtkLegacy, FilesThatVtkWritesInBothLayoutsAreRead) {
  const test::ScratchFolder folder;
  const Mesh mesh = generate(BoxShape{Vec3(1, 2, 3), Vec3(1, 0.5, 0.1), {2, 1, 1}});
  write_vtu(folder.path() / "mesh.vtu", mesh.nodes, mesh.tets, {}, {});
  run_python(folder, R"(
import vtk
reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName("mesh.vtu"); reader.Update()
grid = reader.GetOutput()
triangle = vtk.vtkIdList()
for node in 0, 1, 3: triangle.InsertNextId(node)
grid.InsertNextCell(5, triangle)
data = vtk.vtkDoubleArray(); data.SetName("time"); data.InsertNextValue(0.5); grid.GetFieldData().AddArray(data)
data = vtk.vtkDoubleArray(); data.SetName("speed"); data.SetNumberOfTuples(grid.GetNumberOfPoints()); data.Fill(2); grid.GetPointData().AddArray(data)
for version in 42, 51:
    writer = vtk.vtkUnstructuredGridWriter(); writer.SetInputData(grid)
    writer.SetFileVersion(version); writer.SetFileTypeToASCII(); writer.SetFileName("ascii%d.vtk" % version); writer.Write()
writer.SetFileTypeToBinary(); writer.SetFileName("binary.vtk"); writer.Write()
)");
  for (const char* name : {"ascii42.vtk", "ascii51.vtk"}) {
    const Mesh read = read_volume_mesh(folder.path() / name);
    EXPECT_EQ(read.tets, mesh.tets);
    EXPECT_EQ(read.regions, std::vector<Index>(mesh.tets.size(), 0));
    ASSERT_EQ(read.nodes.size(), mesh.nodes.size());
    for (std::size_t i = 0; i < read.nodes.size(); ++i)
      EXPECT_LT((read.nodes[i] - mesh.nodes[i]).norm(), 1e-4);
  }
  const Error binary = error_of([&] { read_volume_mesh(folder.path() / "binary.vtk"); });
  EXPECT_TRUE(contains(binary.what(), "binary"));
  EXPECT_TRUE(contains(binary.hint(), "ASCII"));
  EXPECT_TRUE(contains(binary.where(), "binary.vtk:3")) << binary.where();
}

}  // namespace
}  // namespace palpate
