"""Position-based dynamics of the beam in numba: a compiled loop over each color, on all threads."""

import os
import sys
from importlib.metadata import version

import numpy as np

from _turns import beam_of, parser, take_turns

OPTIONS = parser(__doc__).parse_args()
os.environ["NUMBA_NUM_THREADS"] = str(OPTIONS.threads)

# Without this variable, compiled code would lie next to the script.
CACHE = "NUMBA_CACHE_DIR" in os.environ

import numba  # noqa: E402, because it reads the number of threads when it is imported
from numba import njit, prange  # noqa: E402


@njit(cache=CACHE)
def first_fit(tuples, count):
    """The lowest color for each tuple that no earlier tuple with a common vertex has."""
    taken = np.zeros(count, dtype=np.uint64)
    colors = np.empty(len(tuples), dtype=np.int64)
    for n in range(len(tuples)):
        used = np.uint64(0)
        for v in tuples[n]:
            used |= taken[v]
        color = 0
        while used & (np.uint64(1) << np.uint64(color)):
            color += 1
        colors[n] = color
        for v in tuples[n]:
            taken[v] |= np.uint64(1) << np.uint64(color)
    return colors


def grouped(tuples, colors, count):
    """The tuples sorted by color, and where each color starts."""
    if colors is None:
        colors = first_fit(tuples, count)
        assert colors.max() < 63, "more colors than bits"
    order = np.argsort(colors, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(colors))])
    return np.ascontiguousarray(tuples[order].astype(np.int32)), starts


@njit(parallel=True, fastmath=True, cache=CACHE)
def frame(x, old, v, edges, edge_starts, lengths, tets, tet_starts, volumes, iterations, dt, gravity, s):
    """One frame. `x` holds positions and inverse masses, `v` velocities."""
    for i in prange(len(x)):
        old[i] = x[i]
        if x[i, 3] > 0:
            v[i, 1] += gravity * dt
            for a in range(3):
                x[i, a] += v[i, a] * dt
    for _ in range(iterations):
        for color in range(len(edge_starts) - 1):
            for n in prange(edge_starts[color], edge_starts[color + 1]):
                i, j = edges[n, 0], edges[n, 1]
                dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
                wi, wj = x[i, 3], x[j, 3]
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                w = (wi + wj) * length
                if w > 0:
                    step = -s * (length - lengths[n]) / w
                    dx, dy, dz = dx * step, dy * step, dz * step
                    x[i, 0] += wi * dx
                    x[i, 1] += wi * dy
                    x[i, 2] += wi * dz
                    x[j, 0] -= wj * dx
                    x[j, 1] -= wj * dy
                    x[j, 2] -= wj * dz
        for color in range(len(tet_starts) - 1):
            for n in prange(tet_starts[color], tet_starts[color + 1]):
                i, j, k, l = tets[n, 0], tets[n, 1], tets[n, 2], tets[n, 3]
                px, py, pz = x[i, 0], x[i, 1], x[i, 2]
                ax, ay, az = x[j, 0] - px, x[j, 1] - py, x[j, 2] - pz
                bx, by, bz = x[k, 0] - px, x[k, 1] - py, x[k, 2] - pz
                cx, cy, cz = x[l, 0] - px, x[l, 1] - py, x[l, 2] - pz
                # Six times the gradients at the vertices 2, 3 and 4, and at 1.
                jx, jy, jz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
                kx, ky, kz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
                lx, ly, lz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
                ix, iy, iz = jx + kx + lx, jy + ky + ly, jz + kz + lz
                wi, wj, wk, wl = x[i, 3], x[j, 3], x[k, 3], x[l, 3]
                w = (
                    wi * (ix * ix + iy * iy + iz * iz)
                    + wj * (jx * jx + jy * jy + jz * jz)
                    + wk * (kx * kx + ky * ky + kz * kz)
                    + wl * (lx * lx + ly * ly + lz * lz)
                )
                if w > 0:
                    step = -s * (ax * jx + ay * jy + az * jz - volumes[n]) / w
                    x[i, 0] -= wi * step * ix
                    x[i, 1] -= wi * step * iy
                    x[i, 2] -= wi * step * iz
                    x[j, 0] += wj * step * jx
                    x[j, 1] += wj * step * jy
                    x[j, 2] += wj * step * jz
                    x[k, 0] += wk * step * kx
                    x[k, 1] += wk * step * ky
                    x[k, 2] += wk * step * kz
                    x[l, 0] += wl * step * lx
                    x[l, 1] += wl * step * ly
                    x[l, 2] += wl * step * lz
    for i in prange(len(x)):
        for a in range(3):
            v[i, a] = (x[i, a] - old[i, a]) / dt


def main():
    beam = beam_of(OPTIONS)
    count = len(beam.x)
    x = np.zeros((count, 4), dtype=np.float32)
    x[:, :3] = beam.x
    x[:, 3] = np.where(beam.fixed, 0, 1 / beam.masses(OPTIONS.density))
    edges, edge_starts = grouped(beam.edges, beam.edge_colors, count)
    tets, tet_starts = grouped(beam.tets, beam.tet_colors, count)
    lengths = np.linalg.norm(beam.x[edges[:, 0]] - beam.x[edges[:, 1]], axis=1).astype(np.float32)
    a, b, c = (beam.x[tets[:, n]] - beam.x[tets[:, 0]] for n in (1, 2, 3))
    six_volumes = np.einsum("ij,ij->i", a, np.cross(b, c)).astype(np.float32)
    if OPTIONS.kinds == "edges":
        tet_starts = tet_starts[:1]
    if OPTIONS.kinds == "tets":
        edge_starts = edge_starts[:1]
    old, v = x.copy(), np.zeros_like(x)
    dt, gravity, stiffness = np.float32(OPTIONS.dt), np.float32(-OPTIONS.gravity), np.float32(OPTIONS.stiffness)
    constants = (OPTIONS.iterations, dt, gravity, stiffness)

    def step():
        frame(x, old, v, edges, edge_starts, lengths, tets, tet_starts, six_volumes, *constants)

    about = {"version": version("numba"), "threads": numba.get_num_threads(), "precision": "f32"}
    take_turns(OPTIONS, beam, about, step, lambda: x[:, :3])


if __name__ == "__main__":
    sys.exit(main())
