"""Opens a baked file with VTK's vtkHDFReader, as ParaView does: read_with_vtk.py FILE"""

import sys

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import VTK_TETRA
from vtkmodules.vtkIOHDF import vtkHDFReader


def expect(condition, what):
    if not condition:
        sys.exit(f"VTK does not see what was stored: {what}")


reader = vtkHDFReader()
expect(reader.CanReadFile(sys.argv[1]), "the file")
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()

with h5py.File(sys.argv[1]) as file:
    nodes = file["/mesh/nodes"][:]
    tets = file["/mesh/connectivity"][:].reshape(-1, 4)
    fixed = file["/dofs/fixed"][:]
    regions = file["/mesh/regions"][:]

expect(grid.IsA("vtkUnstructuredGrid"), "an unstructured grid")
expect(grid.GetNumberOfPoints() == len(nodes) and grid.GetNumberOfCells() == len(tets), "counts")
expect(np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), nodes), "points")
expect(all(grid.GetCellType(e) == VTK_TETRA for e in range(len(tets))), "cell types")
expect(np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4), tets), "connectivity")
expect(np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("fixed")), fixed), "fixed")
expect(np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("region")), regions), "region")
print(f"{grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells, bounds {grid.GetBounds()}")
