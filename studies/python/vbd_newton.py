"""Vertex block descent of the beam in Newton, on the CPU. Warp runs kernels on one CPU thread.

With `--energy springs` the body has the energy of Cutis: springs on the edges and
`K/2 (det F − 1)²` in the tetrahedra. With `--energy solid` it has Newton's own Neo-Hookean solid,
with the mean stiffness for small strains.
"""

import sys

import numpy as np

from _beam import isotropic
from _turns import beam_of, parser, take_turns

PARSER = parser(__doc__)
PARSER.add_argument("--energy", choices=["springs", "solid"], default="springs")
OPTIONS = PARSER.parse_args()

import warp as wp  # noqa: E402

wp.config.log_level = wp.LOG_WARNING  # its output goes to the output of this program
import newton  # noqa: E402


def model_of(beam):
    """The model with the energy of the options."""
    springs = OPTIONS.energy == "springs"
    mu, lam = (0.0, OPTIONS.bulk) if springs else isotropic(OPTIONS.youngs, OPTIONS.bulk)
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -OPTIONS.gravity, 0.0))
    builder.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, 0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=beam.x.tolist(),
        indices=beam.tets.ravel().tolist(),
        density=OPTIONS.density,
        k_mu=mu,
        k_lambda=lam,
        k_damp=0.0,
        add_surface_mesh_edges=False,
    )
    for vertex in np.flatnonzero(beam.fixed):
        builder.particle_mass[vertex] = 0.0
    if springs:
        lengths = np.linalg.norm(beam.x[beam.edges[:, 0]] - beam.x[beam.edges[:, 1]], axis=1)
        stiffness = OPTIONS.youngs * beam.edge_volumes() / lengths**2
        builder.spring_indices += beam.edges.ravel().tolist()
        builder.spring_rest_length += lengths.tolist()
        builder.spring_stiffness += stiffness.tolist()
        builder.spring_damping += [0.0] * len(lengths)
        builder.spring_control += [0.0] * len(lengths)
    builder.set_coloring([np.flatnonzero(beam.vertex_colors == color) for color in range(4)])
    return builder.finalize(device="cpu")


def main():
    beam = beam_of(OPTIONS)
    model = model_of(beam)
    solver = newton.solvers.SolverVBD(
        model, iterations=OPTIONS.iterations, particle_enable_self_contact=False, particle_enable_tile_solve=False
    )
    states = [model.state(), model.state()]
    control = model.control()

    def step():
        states[0].clear_forces()
        solver.step(states[0], states[1], control, None, OPTIONS.dt)
        states.reverse()

    about = {"version": f"{newton.__version__}, Warp {wp.__version__}", "threads": 1, "precision": "f32"}
    take_turns(OPTIONS, beam, about, step, lambda: states[0].particle_q.numpy())


if __name__ == "__main__":
    sys.exit(main())
