"""Opens what formats_sample_file wrote with h5py, as a user's notebook would: read_with_h5py.py FOLDER"""

import pathlib
import re
import sys

import h5py
import numpy as np


def expect(condition, what):
    if not condition:
        sys.exit(f"not as documented: {what}")


# dimension, nodes an element, VTK's number, (nodes, elements, surface simplices, stored nodes) of the sample
KINDS = {
    "tri3": (2, 3, 5, (9, 8, 8, 6)),
    "quad4": (2, 4, 9, (9, 4, 8, 6)),
    "tet4": (3, 4, 10, (27, 48, 48, 18)),
    "tet10": (3, 10, 24, (125, 48, 192, 100)),
    "hex8": (3, 8, 12, (27, 8, 48, 18)),
}


def measure(element, nodes, cells):
    """Volume (in the plane, area) of the body, from the corners alone."""
    if element in ("quad4", "tri3"):
        x, y = np.moveaxis(nodes[cells][..., :2], -1, 0)
        return 0.5 * (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum()  # shoelace
    corners = [0, 1, 3, 4] if element == "hex8" else [0, 1, 2, 3]  # the sample's cells are boxes
    edges = nodes[cells[:, corners[1:]]] - nodes[cells[:, corners[:1]]]
    return np.linalg.det(edges).sum() / (1 if element == "hex8" else 6)


def check_model(path, element, scalar):
    dimension, width, vtk, counts = KINDS[element]
    with h5py.File(path) as file:
        attributes = file.attrs
        expect(attributes["format"] == b"palpate", "format")
        expect(list(attributes["version"]) == [4, 0], "version of a model")
        expect(attributes["units"] == b"m, N, Pa, kg, s", "units")
        expect(attributes["scalar"].decode() == scalar, "scalar")
        expect(attributes["element"].decode() == element and attributes["dimension"] == dimension, "element")
        analysis = {"tri3": b"plane_strain", "quad4": b"plane_stress"}.get(element, b"solid")
        expect(attributes["analysis"] == analysis, "analysis")
        expect(attributes["scope"] == b"full" and attributes["layers"] == 0, "scope")
        expect(len(attributes["content_hash"]) == 32, "content_hash")

        nodes = file["/mesh/nodes"][:]
        cells = file["/mesh/connectivity"][:].reshape(-1, width)
        surface = file["/mesh/surface"][:]
        stored = file["/dofs/stored_nodes"][:]
        expect((len(nodes), len(cells), len(surface), len(stored)) == counts, "counts")
        expect(nodes.shape[1] == 3 and surface.shape[1] == dimension, "widths")
        expect(np.isclose(measure(element, nodes, cells), 1 * 2 * (3 if dimension == 3 else 1)), "volume")
        expect(np.isclose(enclosed(nodes, surface), 1 * 2 * (3 if dimension == 3 else 1)), "surface")
        expect((np.diff(file["/mesh/offsets"]) == width).all() and (file["/mesh/types"][:] == vtk).all(), "cells")
        expect(file["/model_toml"][:].tobytes().decode() == 'name = "sample"\n# Länge in m\n', "model_toml")
        expect(file["/provenance/sources"][:].tobytes().count(b"\n") == 2, "sources")

        isotropic, strain = file["/material/isotropic"][:], file["/material/initial_strain"][:]
        expect(np.array_equal(isotropic, [[5000, 0.49, 1060], [2e4, 0.3, 1100]]), "materials")
        expect(np.array_equal(file["/material/friction"], [0.25, 0.5]), "friction")
        expect(np.array_equal(strain, [[0] * 6, [1e-3, 2e-3, 3e-3, -1e-3, -2e-3, -3e-3]]), "initial strain")
        expect(np.array_equal(file["/material/of_element"], np.arange(len(cells)) % 2), "material of element")
        expect(file["/material/thickness"][0] == (0.02 if dimension == 2 else 1), "thickness")
        factors = [1e-3, 2e-3, 3e-3 if dimension == 3 else 0]
        expect(np.allclose(file["/rest/displacement"], nodes * factors, rtol=1e-15), "rest displacement")
        expect(np.array_equal(file["/rest/force"][:, :2], nodes[:, [1, 0]] * [1, -1]), "rest force")

        fixed = file["/dofs/fixed"][:]
        held = nodes[:, dimension - 1] == nodes[:, dimension - 1].min()
        expect(np.array_equal(fixed > 0, held) and fixed.max() == 2**dimension - 1, "fixed")
        expect(np.array_equal(np.sort(stored), np.flatnonzero(~held)), "stored nodes")
        n = dimension * len(stored)
        packed = file["/greens/packed"]
        expect(packed.dtype.name == scalar and packed.shape == (n * (n + 1) // 2,), "greens")
        xi = np.zeros((n, n))
        column, row = np.triu_indices(n)  # lower triangle, one column after the other
        xi[row, column] = packed[:]
        expect(np.allclose(np.diag(xi), 2e-3 + 1e-6 * np.arange(n)), "diagonal of the Green's functions")
        expect(np.isclose(xi[7, 3], 1e-3 / (1 + 7 + 1.1 * 3)), "an entry of the Green's functions")
        expect(packed.id.get_offset() % 4096 == 0, "page alignment")
        expect(file["/probes/forces"].shape == file["/probes/displacements"].shape == (2, n), "probes")

        overlay = file["/overlay"]
        expect((overlay["refinement"][0], overlay["rings"][0]) == (3, 2), "overlay")
        expect(list(overlay["nodes"]) == [2, 3] and list(overlay["surface_nodes"]) == [3, 1], "sizes of overlays")
        expect(set(overlay["centres"]) <= set(surface.ravel()) & set(stored), "centres of overlays")
        expect(list(overlay["surface"]) == [1, 3, 5, 1], "surface of overlays")
        g, m = dimension * overlay["nodes"][:], dimension * overlay["surface_nodes"][:]
        second = overlay["T"][m[0] * g[0]:].reshape(m[1], g[1])
        expect(np.allclose(second, np.arange(m[1])[:, None] - 0.01 * np.arange(g[1])), "T of overlays")
        column, row = np.triu_indices(g[0])
        expect(np.allclose(overlay["G"][:len(row)], 1 / (1 + row + column) + row * column), "G of overlays")
        expect(overlay["compliance"].shape == ((m * (m + 1) // 2).sum(),), "compliance of overlays")
        print(f"{path.name}: {len(nodes)} nodes, {len(cells)} {element} elements, {n} stored dofs")


def check_dynamics(path):
    with h5py.File(path) as file:
        dynamics = file["/dynamics"]
        n = file.attrs["dimension"] * len(file["/dofs/stored_nodes"])
        expect(np.array_equal(dynamics["newmark"], [0.3025, 0.6, 0.002]), "newmark")
        expect(np.array_equal(dynamics["damping"], [0.5, 1e-4]), "damping")
        expect(list(dynamics["lumped"]) == [0], "lumped")
        if dynamics["method"][0] == 1:
            expect(set(dynamics) == {"method", "lumped", "newmark", "damping", "matrices", "inverse"}, "packed dynamics")
            matrices = dynamics["matrices"]
            mass, damping = np.zeros((n, n)), np.zeros((n, n))
            column = np.repeat(np.arange(n), np.diff(matrices["start"]))
            mass[matrices["row"][:], column] = matrices["mass"]
            damping[matrices["row"][:], column] = matrices["damping"]
            expect(np.allclose(mass, np.diag(0.1 + 1e-3 * np.arange(n)) + np.diag(np.full(n - 1, 0.01), -1)), "mass")
            expect(np.allclose(damping, np.diag(0.5 + 1e-3 * np.arange(n)) - np.diag(np.full(n - 1, 0.02), -1)), "damping")
            expect(dynamics["inverse"].dtype == file["/greens/packed"].dtype, "precision of the inverse")
            expect(dynamics["inverse"].id.get_offset() % 4096 == 0, "page alignment of the inverse")
            expect(np.allclose(dynamics["inverse"][:], file["/greens/packed"][:] / 8), "inverse")
        else:
            expect(set(dynamics) == {"method", "lumped", "newmark", "damping", "modes"}, "modal dynamics")
            expect(list(dynamics["modes/omega"]) == [10, 10, 11, 11, 12, 1000], "omega")
            modes, dofs = np.arange(1, 6)[:, None], np.arange(n)
            expect(np.allclose(dynamics["modes/shapes"], np.cos(0.1 * modes * dofs)), "shapes")
        print(f"{path.name}: dynamics by method {dynamics['method'][0]}")


def enclosed(nodes, surface):
    """Volume inside triangles that look outwards; in the plane, area inside lines with the body on their left."""
    x = nodes[surface]
    if surface.shape[1] == 2:
        return 0.5 * (x[:, 0, 0] * x[:, 1, 1] - x[:, 0, 1] * x[:, 1, 0]).sum()
    return np.linalg.det(x).sum() / 6


folder = pathlib.Path(sys.argv[1])
check_model(folder / "single.palpate.hdf", "tet4", "float32")
for kind in KINDS:
    check_model(folder / f"{kind}.palpate.hdf", kind, "float64")
for method in ("packed", "modal"):
    check_dynamics(folder / f"{method}.palpate.hdf")
