"""The cube's Green's functions by NumPy alone: a second route past everything that Palpate does."""

import itertools

import numpy as np


def kuhn_cube(cells):
    """Nodes [N, 3], x fastest, and tetrahedra [E, 4] of the unit cube with six Kuhn tetrahedra a cell."""
    ticks = np.arange(cells + 1) / cells
    nodes = np.array([(x, y, z) for z in ticks for y in ticks for x in ticks])
    stride = (1, cells + 1, (cells + 1) ** 2)
    tets = []
    for k, j, i in itertools.product(range(cells), repeat=3):
        corner = i * stride[0] + j * stride[1] + k * stride[2]
        for path in itertools.permutations(stride):
            tets.append(np.cumsum((corner, *path)))
    return nodes, np.array(tets)


def stiffness(nodes, tets, youngs_modulus, poissons_ratio):
    """Dense K of all dofs, from the coefficients of the linear shape functions."""
    lame = youngs_modulus * poissons_ratio / ((1 + poissons_ratio) * (1 - 2 * poissons_ratio))
    shear = youngs_modulus / (2 * (1 + poissons_ratio))
    K = np.zeros((3 * len(nodes),) * 2)
    for tet in tets:
        coordinates = np.column_stack([np.ones(4), nodes[tet]])
        volume = abs(np.linalg.det(coordinates)) / 6
        gradients = np.linalg.inv(coordinates)[1:].T  # row a: grad N_a
        products = np.einsum("pi,qj->piqj", gradients, gradients)
        dots = np.einsum("piqi,kl->pkql", products, np.eye(3))
        blocks = lame * products + shear * (products.transpose(0, 3, 2, 1) + dots)
        dofs = (3 * tet[:, None] + np.arange(3)).ravel()
        K[np.ix_(dofs, dofs)] += volume * blocks.reshape(12, 12)
    return K


def greens(cells, youngs_modulus=1.0, poissons_ratio=0.3):
    """Xi of the free dofs (z > 0) in mesh node order, and the free nodes."""
    nodes, tets = kuhn_cube(cells)
    free = np.flatnonzero(nodes[:, 2] > 0)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    K = stiffness(nodes, tets, youngs_modulus, poissons_ratio)
    return np.linalg.inv(K[np.ix_(dofs, dofs)]), free
