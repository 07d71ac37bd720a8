"""The beam as a flex of MuJoCo: tetrahedra of a Saint Venant–Kirchhoff solid, with the mean
stiffness of the beam for small strains. A flex runs on one thread.

The integrator `Euler` makes explicit steps, which must be short. The integrator `discrete` is
implicit and makes one step per frame.
"""

import sys

import mujoco
import numpy as np

from _beam import isotropic
from _turns import beam_of, parser, take_turns

# Largest length of a step over the time of a pressure wave across a cell.
COURANT = 0.35


def model_of(options, beam, step):
    """The model, with a quarter of the mass of each tetrahedron at each of its vertices."""
    mu, lam = isotropic(options.youngs, options.bulk)
    youngs, poisson = mu * (3 * lam + 2 * mu) / (lam + mu), lam / (2 * (lam + mu))
    masses = beam.masses(options.density)
    numbers = {
        "point": beam.x.round(9).ravel(),
        "element": beam.tets.ravel(),
        "pin": np.flatnonzero(beam.fixed),
    }
    point, element, pin = (" ".join(map(str, numbers[key].tolist())) for key in ("point", "element", "pin"))
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{step}" gravity="0 {-options.gravity} 0" integrator="{options.integrator}">
            <flag contact="disable"/>
          </option>
          <worldbody>
            <flexcomp name="beam" type="direct" dim="3" mass="{masses.sum()}" radius="0.001"
                      point="{point}" element="{element}">
              <contact selfcollide="none" contype="0" conaffinity="0"/>
              <edge equality="false" damping="0"/>
              <elasticity young="{youngs}" poisson="{poisson}" damping="0"/>
              <pin id="{pin}"/>
            </flexcomp>
          </worldbody>
        </mujoco>""")
    # MuJoCo gives every vertex the same mass.
    model.body_mass[model.flex_vertbodyid[~beam.fixed]] = masses[~beam.fixed]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def main():
    options = parser(__doc__)
    options.add_argument("--integrator", choices=["Euler", "discrete"], default="Euler")
    options = options.parse_args()
    beam = beam_of(options)
    mu, lam = isotropic(options.youngs, options.bulk)
    crossing = options.spacing / np.sqrt((lam + 2 * mu) / options.density)
    steps = int(np.ceil(options.dt / (COURANT * crossing))) if options.integrator == "Euler" else 1
    model = model_of(options, beam, options.dt / steps)
    data = mujoco.MjData(model)

    def frame():
        mujoco.mj_step(model, data, steps)

    about = {"version": mujoco.__version__, "threads": 1, "precision": "f64", "iterations": steps}
    take_turns(options, beam, about, frame, lambda: data.flexvert_xpos)


if __name__ == "__main__":
    sys.exit(main())
