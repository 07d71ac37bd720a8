"""The small-strain moduli of a `kuhn6` lattice with springs and volumes.

Every vertex of the infinite lattice is a center of symmetry, so that a uniform strain is an
equilibrium and the stiffness is the mean over the edges: `C = E·⟨e e e e⟩ + K·1⊗1`, where each
tetrahedron counts its six edges e alike. It is not isotropic: the springs along the cube's diagonal
make that axis stiffer than the others.
"""

from itertools import permutations

import numpy as np


def stiffness(youngs, bulk):
    """The fourth-order tensor in Pa."""
    edges = []
    for walk in permutations(np.eye(3)):
        corners = np.cumsum([np.zeros(3), *walk], axis=0)
        edges += [corners[b] - corners[a] for a in range(4) for b in range(a + 1, 4)]
    e = np.array(edges) / np.linalg.norm(edges, axis=1)[:, None]
    springs = np.einsum("na,nb,nc,nd->abcd", e, e, e, e) / len(e)
    unit = np.eye(3)
    return youngs * springs + bulk * np.einsum("ab,cd->abcd", unit, unit)


def compliance(tensor):
    """Its inverse on symmetric matrices."""
    return np.linalg.pinv(tensor.reshape(9, 9), hermitian=True).reshape(3, 3, 3, 3)


def effective(youngs, bulk):
    """Young's modulus along an axis and the diagonal of the cubes, and the moduli of the
    isotropic solid that has the same bulk modulus and the same mean shear (Voigt's average over
    all directions). All in Pa."""
    tensor = stiffness(youngs, bulk)
    inverse = compliance(tensor)

    def along(direction):
        n = np.array(direction) / np.linalg.norm(direction)
        return float(1.0 / np.einsum("abcd,a,b,c,d->", inverse, n, n, n, n))

    dilation, full = float(np.einsum("aabb->", tensor)), float(np.einsum("abab->", tensor))
    mean_bulk = dilation / 9
    shear = (3 * full - dilation) / 30
    lame = mean_bulk - 2 * shear / 3
    return {
        "along_axis_pa": along([1, 0, 0]),
        "along_diagonal_pa": along([1, 1, 1]),
        "youngs_pa": 9 * mean_bulk * shear / (3 * mean_bulk + shear),
        "poisson": lame / (2 * (lame + shear)),
        "lame_pa": lame,
        "shear_pa": shear,
    }
