"""Opens what formats_sample_file wrote with h5py, as a user's notebook would: read_with_h5py.py FOLDER"""

import pathlib
import sys

import h5py
import numpy as np


def expect(condition, what):
    if not condition:
        sys.exit(f"not as documented: {what}")


def check_model(path, scalar):
    with h5py.File(path) as file:
        attributes = file.attrs
        expect(attributes["format"] == b"palpate", "format")
        expect(list(attributes["version"]) == [1, 0], "version")
        expect(attributes["units"] == b"m, N, Pa, kg, s", "units")
        expect(attributes["scalar"].decode() == scalar, "scalar")
        expect(attributes["dimension"] == 3, "dimension")
        expect(attributes["scope"] == b"full" and attributes["layers"] == 0, "scope")
        expect(len(attributes["content_hash"]) == 32, "content_hash")

        nodes = file["/mesh/nodes"][:]
        tets = file["/mesh/connectivity"][:].reshape(-1, 4)
        expect(nodes.shape == (27, 3) and tets.shape == (48, 4), "mesh")
        edges = nodes[tets[:, 1:]] - nodes[tets[:, :1]]
        expect(np.isclose(np.linalg.det(edges).sum() / 6, 1 * 2 * 3), "volume of the box")
        expect((np.diff(file["/mesh/offsets"]) == 4).all() and (file["/mesh/types"][:] == 10).all(), "cells")
        expect(file["/model_toml"][:].tobytes().decode() == 'name = "sample"\n# Länge in m\n', "model_toml")
        expect(file["/provenance/sources"][:].tobytes().count(b"\n") == 2, "sources")

        stored = file["/dofs/stored_nodes"][:]
        expect(not file["/dofs/fixed"][:][stored].any() and len(stored) == 18, "stored nodes")
        n = 3 * len(stored)
        packed = file["/greens/packed"]
        expect(packed.dtype.name == scalar and packed.shape == (n * (n + 1) // 2,), "greens")
        xi = np.zeros((n, n))
        column, row = np.triu_indices(n)  # lower triangle, one column after the other
        xi[row, column] = packed[:]
        expect(np.allclose(np.diag(xi), 2e-3 + 1e-6 * np.arange(n)), "diagonal of the Green's functions")
        expect(np.isclose(xi[7, 3], 1e-3 / (1 + 7 + 1.1 * 3)), "an entry of the Green's functions")
        expect(packed.id.get_offset() % 4096 == 0, "page alignment")
        expect(file["/probes/forces"].shape == file["/probes/displacements"].shape == (2, n), "probes")
        print(f"{path.name}: {len(nodes)} nodes, {len(tets)} elements, {n} stored dofs")


def check_recording(path):
    with h5py.File(path) as file:
        expect(file.attrs["format"] == b"palpate-recording" and file.attrs["model"] == b"double.palpate.hdf", "recording")
        ticks = file["/ticks"]
        expect(np.array_equal(ticks["time"], 1e-3 * np.arange(5000)), "time")
        expect(np.array_equal(ticks["tool_position"][:, 1], 2.0 * np.arange(5000)), "tool_position")
        expect(np.array_equal(ticks["node"], np.arange(5000) % 5 - 1), "node")
        expect(all(ticks[name].shape[0] == 5000 for name in ticks) and len(ticks) == 8, "lengths")
        print(f"{path.name}: 5000 ticks")


folder = pathlib.Path(sys.argv[1])
check_model(folder / "single.palpate.hdf", "float32")
check_model(folder / "double.palpate.hdf", "float64")
check_recording(folder / "recording.h5")
