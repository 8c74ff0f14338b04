"""Opens what formats_sample_file wrote with VTK's vtkHDFReader, as ParaView does: read_with_vtk.py FOLDER"""

import pathlib
import sys

import h5py
import numpy as np
from vtkmodules import vtkCommonDataModel as vtk
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOHDF import vtkHDFReader

CELLS = {
    "tri3": vtk.VTK_TRIANGLE,
    "quad4": vtk.VTK_QUAD,
    "tet4": vtk.VTK_TETRA,
    "tet10": vtk.VTK_QUADRATIC_TETRA,
    "hex8": vtk.VTK_HEXAHEDRON,
}


def expect(condition, what):
    if not condition:
        sys.exit(f"VTK does not see what was stored: {what}")


def size_of(grid):
    """Volume, in the plane area, by VTK's own formulas: wrong where nodes are numbered in another way."""
    measure = vtkCellSizeFilter()
    measure.SetInputData(grid)
    measure.Update()
    data = measure.GetOutput().GetCellData()
    return sum(vtk_to_numpy(data.GetArray(name)).sum() for name in ("Area", "Volume"))


def check(path, kind):
    reader = vtkHDFReader()
    expect(reader.CanReadFile(str(path)), f"the file {path.name}")
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    with h5py.File(path) as file:
        nodes = file["/mesh/nodes"][:]
        connectivity = file["/mesh/connectivity"][:]
        points = {"fixed": file["/dofs/fixed"][:], "rest_displacement": file["/rest/displacement"][:]}
        cells = {"region": file["/mesh/regions"][:], "material": file["/material/of_element"][:]}

    expect(grid.IsA("vtkUnstructuredGrid"), "an unstructured grid")
    expect(grid.GetNumberOfPoints() == len(nodes), f"the number of points of {path.name}")
    expect(grid.GetNumberOfCells() == len(cells["region"]), f"the number of cells of {path.name}")
    expect(np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), nodes), f"points of {path.name}")
    expect(all(grid.GetCellType(e) == CELLS[kind] for e in range(grid.GetNumberOfCells())), f"cell types of {path.name}")
    expect(np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), connectivity), f"connectivity of {path.name}")
    for data, arrays in ((grid.GetPointData(), points), (grid.GetCellData(), cells)):
        expect(data.GetNumberOfArrays() == len(arrays), f"number of arrays of {path.name}")
        for name, values in arrays.items():
            expect(np.array_equal(vtk_to_numpy(data.GetArray(name)), values), f"{name} of {path.name}")
    expect(np.isclose(size_of(grid), 2 if kind in ("tri3", "quad4") else 6), f"size of {path.name}")
    if kind == "tet10":
        for e in range(grid.GetCell(0).GetNumberOfEdges()):
            ends_and_middle = vtk_to_numpy(grid.GetCell(0).GetEdge(e).GetPoints().GetData())
            expect(np.allclose(ends_and_middle[:2].mean(axis=0), ends_and_middle[2]), "middles of edges")
    print(f"{path.name}: {grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells, bounds {grid.GetBounds()}")


for kind in CELLS:
    check(pathlib.Path(sys.argv[1]) / f"{kind}.palpate.hdf", kind)
