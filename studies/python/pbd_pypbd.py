"""Position-based dynamics of the beam in PositionBasedDynamics, by its Python bindings pyPBD."""

import os
import sys
from importlib.metadata import version

from _turns import beam_of, parser, take_turns

OPTIONS = parser(__doc__).parse_args()
os.environ["OMP_NUM_THREADS"] = str(OPTIONS.threads)

import numpy as np  # noqa: E402
import pypbd as pbd  # noqa: E402, because it reads the number of threads when it is imported

# The gradients of its volume constraint lack the factor 1/6, so that stiffness 1 removes a sixth
# of the error. This stiffness makes it the projection of the other programs.
VOLUME_STIFFNESS = 6.0


def main():
    if OPTIONS.gravity != 9.81:
        sys.exit("the bindings of PositionBasedDynamics cannot change gravity")
    beam = beam_of(OPTIONS)
    simulation = pbd.Simulation.getCurrent()
    simulation.initDefault()
    model = simulation.getModel()
    model.addTetModel(list(beam.x), beam.tets.ravel().tolist())
    particles = model.getParticles()
    for vertex, (fixed, mass) in enumerate(zip(beam.fixed, beam.masses(OPTIONS.density))):
        particles.setMass(vertex, 0.0 if fixed else mass)
    if OPTIONS.kinds != "tets":
        for i, j in beam.edges.tolist():
            model.addDistanceConstraint(i, j, OPTIONS.stiffness)
    if OPTIONS.kinds != "edges":
        for i, j, k, l in beam.tets.tolist():
            model.addVolumeConstraint(i, j, k, l, VOLUME_STIFFNESS * OPTIONS.stiffness)
    model.initConstraintGroups()
    pbd.TimeManager.getCurrent().setTimeStepSize(OPTIONS.dt)
    controller = simulation.getTimeStep()
    controller.setValueUInt(pbd.TimeStepController.NUM_SUB_STEPS, 1)
    controller.setValueUInt(pbd.TimeStepController.MAX_ITERATIONS, OPTIONS.iterations)
    controller.setValueUInt(pbd.TimeStepController.MAX_ITERATIONS_V, 0)
    about = {"version": version("pyPBD"), "threads": OPTIONS.threads, "precision": "f64"}
    take_turns(OPTIONS, beam, about, lambda: controller.step(model), lambda: np.array(particles.getVertices()))


if __name__ == "__main__":
    sys.exit(main())
