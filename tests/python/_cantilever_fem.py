"""The lattice body as a hyperelastic solid, by finite elements with scikit-fem. It uses no code of
Cutis.

Linear tetrahedra with the energy density (J per m³ at rest, F the deformation gradient)

W(F) = E/12 · Σ (|F e| − 1)² + K/2 · (det F − 1)²

where e runs over the rest directions of the six edges. Integrated over the tetrahedra it is the sum
of ½C²/α over the springs with α = L²/(E·V_e), V_e a sixth of each tetrahedron around the edge, and
over the volumes with α = V0/K. Its first and second derivatives are written out by hand, and
`check_derivatives` compares them with differences.
"""

from itertools import combinations, product

import numpy as np
from scipy.sparse import eye
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTetP1, ElementVector, Functional, LinearForm, MeshTet, asm, condense
from skfem.helpers import ddot, det, grad, inv, sym_grad, trace, transpose

# Newton's method ends when the norm of the residual force is this share of the norm of the load.
TOLERANCE = 1e-9
MOST_ITERATIONS = 200
# A step is accepted if the energy falls by this share of the linear prediction (Armijo).
DESCENT = 1e-4


class Beam:
    """A mesh with fixed vertices: `points` (vertices × 3, m), `tets` (× 4), `held` (bool per
    vertex)."""

    def __init__(self, points, tets, held):
        mesh = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tets.T))
        self.basis = Basis(mesh, ElementVector(ElementTetP1()), intorder=1)
        self.held = self.basis.nodal_dofs[:, held].ravel()
        self.free = np.setdiff1d(np.arange(self.basis.N), self.held)
        self.volumes = self.basis.dx.sum(axis=1)
        pairs = np.array(list(combinations(range(4), 2))).T
        edges = mesh.p[:, mesh.t[pairs[1]]] - mesh.p[:, mesh.t[pairs[0]]]
        # Component × edge × tetrahedron × quadrature point.
        self.directions = (edges / np.linalg.norm(edges, axis=0))[..., None]
        self.corners = mesh.t

    def field(self, vectors):
        """The coefficients of a field given by one vector per vertex."""
        u = np.zeros(self.basis.N)
        u[self.basis.nodal_dofs] = vectors.T
        return u

    def vectors(self, u):
        """One vector per vertex."""
        return u[self.basis.nodal_dofs].T


@Functional
def integral(w):
    return w["density"]


@LinearForm
def weight(v, w):
    return sum(component * force for component, force in zip(v, w["force"]))


@LinearForm
def internal_force(v, w):
    return ddot(w["stress"], grad(v))


@BilinearForm
def internal_stiffness(u, v, w):
    # A shape function of a vector element moves along one axis: the other rows of its gradient are
    # zero.
    gu, gv, moduli = grad(u), grad(v), w["moduli"].value
    rows = [[axis for axis in range(3) if g[axis].any()] for g in (gv, gu)]
    terms = product(*rows, range(3), range(3))
    return sum(gv[a, b] * moduli[a, b, c, d] * gu[c, d] for a, c, b, d in terms)


def solve(matrix, right):
    """Solves a sparse symmetric system directly, with a symmetric ordering and pivots on the
    diagonal."""
    order = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return splu(matrix.tocsc(), **order).solve(right)


class Solid:
    """The energy of a beam in E and K (Pa), density (kg/m³) and gravity (m/s²), with both
    derivatives."""

    def __init__(self, beam, youngs, bulk, density, gravity):
        self.beam, self.basis, self.youngs, self.bulk = beam, beam.basis, youngs, bulk
        self.load = asm(weight, self.basis, force=density * np.reshape(gravity, (3, 1, 1)))

    def shape(self, u):
        """F and, for every edge, F e and its length; component first, tetrahedron and quadrature
        point last."""
        f = self.basis.interpolate(u).grad + np.eye(3)[:, :, None, None]
        edges = np.einsum("ij...,jk...->ik...", f, self.beam.directions)
        return f, edges, np.linalg.norm(edges, axis=0)

    def energy(self, u, share=1.0):
        """Elastic energy plus the energy of a share of the load, J."""
        f, _, lengths = self.shape(u)
        density = self.youngs / 12 * ((lengths - 1) ** 2).sum(axis=0) + self.bulk / 2 * (det(f) - 1) ** 2
        return asm(integral, self.basis, density=density) - share * self.load @ u

    def gradient(self, u, share=1.0):
        """The derivative of the energy with respect to the coefficients, N."""
        f, edges, lengths = self.shape(u)
        pull = self.youngs / 6 * (1 - 1 / lengths) * edges
        stress = np.einsum("ik...,jk...->ij...", pull, self.beam.directions)
        stress += self.bulk * (det(f) - 1) * det(f) * transpose(inv(f))
        return asm(internal_force, self.basis, stress=stress) - share * self.load

    def tangent(self, u):
        """The second derivative of the energy, N/m."""
        f, edges, lengths = self.shape(u)
        e, along = self.beam.directions, edges / lengths
        # d²(½(|F e| − 1)²) by dF: full along the edge, and across it by the relative extension.
        across = np.einsum("ij,k...->ijk...", np.eye(3), 1 - 1 / lengths)
        inner = across + np.einsum("ik...,jk...,k...->ijk...", along, along, 1 / lengths)
        moduli = self.youngs / 6 * np.einsum("acm...,bm...,dm...->abcd...", inner, e, e)
        # d²(½(det F − 1)²), with the cofactors J F⁻ᵀ.
        j, r = det(f), transpose(inv(f))
        moduli += self.bulk * j * (2 * j - 1) * np.einsum("ab...,cd...->abcd...", r, r)
        moduli -= self.bulk * j * (j - 1) * np.einsum("ad...,cb...->abcd...", r, r)
        return asm(internal_stiffness, self.basis, moduli=moduli)

    def check_derivatives(self, u, rng):
        """Largest relative deviation of gradient and tangent from central differences along
        random directions."""
        size = np.cbrt(self.beam.volumes.min())
        deviations = []
        for _ in range(3):
            d = rng.standard_normal(self.basis.N)
            step = 1e-5 * size
            slope = (self.energy(u + step * d) - self.energy(u - step * d)) / (2 * step)
            bend = (self.gradient(u + step * d) - self.gradient(u - step * d)) / (2 * step)
            exact = self.tangent(u) @ d
            by_gradient = self.gradient(u) @ d
            scale = np.linalg.norm(self.gradient(u)) * np.linalg.norm(d)
            deviations.append(
                max(abs(slope - by_gradient) / scale, np.linalg.norm(bend - exact) / np.linalg.norm(exact))
            )
        return max(deviations)

    def settle(self, load_steps):
        """The coefficients at the minimum of the energy. The load grows in equal steps."""
        u = np.zeros(self.basis.N)
        iterations = 0
        for share in np.linspace(0.0, 1.0, load_steps + 1)[1:]:
            # The load is a dead load, so that only the last step has to be exact.
            tolerance = TOLERANCE if share == 1.0 else 1e-3
            u, needed = self.newton(u, share, tolerance)
            iterations += needed
        return u, iterations

    def newton(self, u, share, tolerance):
        """The minimum of the energy near `u` under a share of the load."""
        free = self.beam.free
        limit = tolerance * np.linalg.norm(self.load[free])
        for iteration in range(MOST_ITERATIONS):
            residual = self.gradient(u, share)
            if np.linalg.norm(residual[free]) <= limit:
                return u, iteration
            step = self.descent(u, residual)
            slope, before, length = residual @ step, self.energy(u, share), 1.0
            rounding = 1e-13 * (abs(before) + abs(self.load @ u))
            while self.energy(u + length * step, share) > before + DESCENT * length * slope + rounding:
                length /= 2
                if length < 1e-8:
                    raise ArithmeticError(f"no descent at a residual of {np.linalg.norm(residual[free])} N")
            u = u + length * step
        raise ArithmeticError(f"not at rest after {MOST_ITERATIONS} iterations")

    def descent(self, u, residual):
        """Newton's direction. If it points uphill, a growing multiple of the unit matrix is
        added to the tangent."""
        matrix, right, _, inner = condense(self.tangent(u), -residual, x=np.zeros_like(u), D=self.beam.held)
        shift, size = 0.0, abs(matrix.diagonal()).mean()
        while True:
            step = np.zeros_like(u)
            step[inner] = solve(matrix + shift * eye(matrix.shape[0]), right)
            if residual @ step < 0:
                return step
            shift = max(10 * shift, 1e-4 * size)


def isotropic(beam, lame, shear, density, gravity):
    """Coefficients by small-strain elasticity with Lamé's moduli (Pa) on the same mesh."""

    @BilinearForm
    def stiffness(u, v, _):
        return lame * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * shear * ddot(sym_grad(u), sym_grad(v))

    load = asm(weight, beam.basis, force=density * np.reshape(gravity, (3, 1, 1)))
    matrix, right, u, inner = condense(asm(stiffness, beam.basis), load, D=beam.held)
    u[inner] = solve(matrix, right)
    return u
