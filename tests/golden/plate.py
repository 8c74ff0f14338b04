"""The hanging plate by NumPy alone: a second route past everything that Palpate does."""

import itertools

import numpy as np

# As in plate2/model.toml.
WIDTH, HEIGHT, THICKNESS, GRAVITY = 2.0, 1.0, 0.5, 9.81
LEFT, RIGHT = (1e5, 0.3, 1000.0), (4e5, 0.45, 1200.0)  # Young's modulus, Poisson's ratio, density


def rectangle_stiffness(a, b, youngs_modulus, poissons_ratio):
    """K [4, 2, 4, 2] of a rectangle a x b of unit thickness in plane stress, corners (0, 0), (a, 0), (0, b), (a, b).
    Its shape functions are products of linear ones, so every integral is a product of integrals over lines: no quadrature."""
    def line(h):
        """Integrals of N_i' N_j', N_i N_j and N_i' N_j of the two linear functions on a line of length h."""
        return (np.array([[1, -1], [-1, 1]]) / h, np.array([[2, 1], [1, 2]]) * h / 6, np.array([[-1, -1], [1, 1]]) / 2)

    (xx, x1, xs), (yy, y1, ys) = line(a), line(b)
    dxdx, dydy = np.kron(y1, xx), np.kron(yy, x1)  # corner = x + 2 y
    dxdy = np.kron(ys.T, xs)  # N_i,x N_j,y
    stretch = youngs_modulus / (1 - poissons_ratio**2)
    across, shear = poissons_ratio * stretch, youngs_modulus / (2 * (1 + poissons_ratio))
    K = np.zeros((4, 2, 4, 2))
    K[:, 0, :, 0] = stretch * dxdx + shear * dydy
    K[:, 1, :, 1] = stretch * dydy + shear * dxdx
    K[:, 0, :, 1] = across * dxdy + shear * dxdy.T
    K[:, 1, :, 0] = K[:, 0, :, 1].T
    return K


def plate(cells):
    """Xi of the free dofs (below the upper edge) in mesh node order, the free nodes, and the rest state: nodal forces and
    displacements [N, 6], z last and zero."""
    a, b, row = WIDTH / cells, HEIGHT / cells, cells + 1
    nodes = row * row
    K, force = np.zeros((nodes, 2, nodes, 2)), np.zeros((nodes, 3))
    for j, i in itertools.product(range(cells), repeat=2):
        youngs_modulus, poissons_ratio, density = LEFT if (i + 0.5) * a < WIDTH / 2 else RIGHT
        corners = i + row * j + np.array([0, 1, row, row + 1])
        K[np.ix_(corners, range(2), corners, range(2))] += THICKNESS * rectangle_stiffness(a, b, youngs_modulus, poissons_ratio)
        force[corners, 1] -= density * GRAVITY * THICKNESS * a * b / 4
    free = np.arange(nodes - row)
    order = 2 * len(free)
    Xi = np.linalg.inv(K[: len(free), :, : len(free), :].reshape(order, order))
    displacement = np.zeros((nodes, 3))
    displacement[: len(free), :2] = (Xi @ force[: len(free), :2].ravel()).reshape(-1, 2)
    return Xi, free, np.column_stack([force, displacement])
