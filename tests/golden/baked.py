"""What a .palpate.hdf holds, and the text files of golden figures."""

import numpy as np


def stored_greens(file):
    """Xi of a .palpate.hdf, full matrix in mesh node order, and the stored nodes."""
    import h5py
    with h5py.File(file) as hdf:
        d = int(hdf.attrs["dimension"])
        stored = hdf["dofs/stored_nodes"][:]
        packed = hdf["greens/packed"][:].astype(float)
    order = d * len(stored)
    Xi = np.zeros((order, order))
    Xi.T[np.triu_indices(order)] = packed  # lower triangle column by column
    Xi = np.tril(Xi) + np.tril(Xi, -1).T
    by_node = np.argsort(stored)
    dofs = (d * by_node[:, None] + np.arange(d)).ravel()
    return Xi[np.ix_(dofs, dofs)], stored[by_node]


def stored_rest(file):
    """Nodal forces and displacements of the rest state [N, 6]."""
    import h5py
    with h5py.File(file) as hdf:
        return np.column_stack([hdf["rest/force"], hdf["rest/displacement"]])


def write_rows(file, rows):
    """A line a row, 17 digits."""
    with open(file, "w", encoding="ascii") as text:
        for row in rows:
            text.write(" ".join(f"{value:.17g}" for value in row) + "\n")


def read_rows(file):
    return [np.array(line.split(), dtype=float) for line in file.read_text().splitlines()]


def read_greens(file):
    """The full matrix of a lower triangle."""
    rows = read_rows(file)
    Xi = np.zeros((len(rows),) * 2)
    for i, row in enumerate(rows):
        Xi[i, : i + 1] = Xi[: i + 1, i] = row
    return Xi
