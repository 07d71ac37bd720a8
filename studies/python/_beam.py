"""The beam of all programs: a block of cubes of six tetrahedra each (Kuhn), fixed at its lowest x.

`cutis-test-kit` builds the same vertices, edges, tetrahedra and colors, in the same order.
"""

import numpy as np

# Steps of the edges: along the axes, across the faces, through the cube.
DIRECTIONS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1))
# Axes along which the corners of a tetrahedron go through the cube.
WALKS = ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0))


def points(size):
    """All index triples below `size`, x fastest."""
    k, j, i = np.meshgrid(*(np.arange(n) for n in reversed(size)), indexing="ij")
    return np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1)


def scrambled(count):
    """A fixed order of `count` things, by a hash of their numbers (SplitMix64)."""
    z = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.argsort(z ^ (z >> np.uint64(31)), kind="stable")


class Beam:
    """Vertices in m, edges and positively oriented tetrahedra with their colors, and which
    vertices are fixed.

    `colors` are closed forms of the lattice. They are None after `shuffled`.
    """

    def __init__(self, size, spacing):
        size = np.asarray(size)
        strides = np.array([1, size[0], size[0] * size[1]])
        grid = points(size)
        self.size, self.spacing = size, spacing
        self.x = grid * spacing
        self.fixed = grid[:, 0] == 0
        self.end = np.flatnonzero(grid[:, 0] == size[0] - 1)
        directions = np.array(DIRECTIONS)
        ends = grid[:, None, :] + directions
        inside = (ends < size).all(axis=2)
        # The last axis of each direction.
        axis = 2 - directions[:, ::-1].argmax(axis=1)
        edges = np.stack([np.broadcast_to((grid @ strides)[:, None], inside.shape), ends @ strides], axis=2)
        colors = np.arange(7) * 2 + grid[:, axis] % 2
        self.vertex_colors = grid.sum(axis=1) % 4
        self.edges, self.edge_colors = edges[inside], colors[inside]
        cubes = points(size - 1)
        corners = np.zeros((6, 4), dtype=int)
        for walk, axes in enumerate(WALKS):
            corners[walk, 1:] = np.cumsum(strides[list(axes)])
        # The odd permutations have the other orientation.
        corners[3:, [1, 2]] = corners[3:, [2, 1]]
        self.tets = ((cubes @ strides)[:, None, None] + corners).reshape(-1, 4)
        # Parity along the middle axis of a walk, and of the sum along the other two.
        middle = cubes[:, [axes[1] for axes in WALKS]]
        ends = cubes.sum(axis=1)[:, None] - middle
        self.tet_colors = (np.arange(6) * 4 + 2 * (middle % 2) + ends % 2).ravel()

    def shuffled(self):
        """The same beam with vertices, edges and tetrahedra in a scrambled order."""
        order = scrambled(len(self.x))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        self.x, self.fixed = self.x[order], self.fixed[order]
        self.vertex_colors = self.vertex_colors[order]
        self.end = place[self.end]
        self.edges = place[self.edges][scrambled(len(self.edges))]
        self.tets = place[self.tets][scrambled(len(self.tets))]
        self.edge_colors = self.tet_colors = None
        return self

    def volumes(self):
        """Volume of each tetrahedron in m³."""
        a, b, c = (self.x[self.tets[:, n]] - self.x[self.tets[:, 0]] for n in (1, 2, 3))
        return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6

    def edge_volumes(self):
        """A sixth of each tetrahedron at each of its edges, in m³."""
        count = len(self.x)
        keys = np.sort(self.edges, axis=1) @ [count, 1]
        order = np.argsort(keys)
        found = np.zeros(len(keys))
        for a in range(4):
            for b in range(a):
                pairs = np.sort(self.tets[:, [a, b]], axis=1) @ [count, 1]
                np.add.at(found, order[np.searchsorted(keys, pairs, sorter=order)], self.volumes() / 6)
        return found

    def masses(self, density):
        """A quarter of the mass of each tetrahedron at each of its vertices, in kg."""
        masses = np.zeros(len(self.x))
        np.add.at(masses, self.tets.ravel(), np.repeat(self.volumes() * density / 4, 4))
        return masses

    def sag(self, x):
        """How far the free end has sunk on average, in m. Downwards is −y."""
        return float(np.mean(self.x[self.end, 1] - np.asarray(x, dtype=float)[self.end, 1]))


def isotropic(youngs, bulk):
    """Lamé's coefficients µ and λ in Pa of the isotropic solid with the mean stiffness of a beam
    with springs of modulus `youngs` and tetrahedra of modulus `bulk`, for small strains.

    The springs give the tensor `E ⟨e e e e⟩`, the mean over the edges `e`. Its isotropic part has
    `µ = λ = E/15`, as the mean over all directions.
    """
    return youngs / 15, youngs / 15 + bulk
