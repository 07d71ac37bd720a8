"""P8: the bent beam by finite elements (scikit-fem), compared with Newton's method and the solver
of Cutis at rest.

Without arguments: a few cases, as part of the tests. With `--json FILE`: all cases, also in real
time, and all figures in that file; `cargo xtask study cantilever` makes the tables from it.
`CUTIS_STUDY` names the program of the studies.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np

from _cantilever_fem import Beam, Solid, isotropic
from _cantilever_moduli import effective
from _compare import Tally

# Largest difference of the end and of all vertices (RMS) from the FEM, as a share of the
# displacement.
EXACT = 1e-6
# The same for the end in a run of the solver with short substeps.
CONVERGED = 1e-2
# Single precision has to meet CONVERGED only if the strain due to the weight is this many times the
# rounding of a cell's strain.
RESOLVED = 100.0
# Relative difference of sizes, which Cutis keeps in single precision.
SIZES = 1e-6
# Relative difference of analytic and numerical derivatives.
DERIVATIVES = 1e-7
LOAD_STEPS = 4


def apart(found, reference):
    """Distance as a share of the reference's length."""
    return float(np.linalg.norm(np.subtract(found, reference)) / np.linalg.norm(reference))


def beyond(label, difference, bound):
    """A list with one message, or an empty list if the difference is within the bound."""
    return [] if difference <= bound else [f"{label}: off by {difference:.1e}, more than {bound:.0e}"]


def size_problems(ours, beam, corners):
    """Compares the volumes of tetrahedra, edges and vertices with sums over the mesh of scikit-
    fem."""
    volumes = beam.volumes
    vertices = np.zeros(len(ours["positions"]))
    np.add.at(vertices, corners.ravel(), np.tile(volumes / 4, 4))
    shares = {}
    for a in range(4):
        for b in range(a):
            for pair, volume in zip(np.sort(corners[[a, b]].T, axis=1).tolist(), volumes):
                shares[tuple(pair)] = shares.get(tuple(pair), 0.0) + volume / 6
    problems = []
    if set(shares) != {tuple(edge) for edge in ours["edges"]}:
        problems.append("the edges are not those of the tetrahedra")
        return problems
    edges = [shares[tuple(edge)] for edge in ours["edges"]]
    for key, theirs in (("tet_volumes", volumes), ("edge_volumes", edges), ("vertex_volumes", vertices)):
        if len(ours[key]) != len(theirs):
            problems.append(f"{key}: {len(ours[key])}, and {len(theirs)} by scikit-fem")
        else:
            problems += beyond(key, np.max(np.abs(np.divide(ours[key], theirs) - 1)), SIZES)
    return problems


class Mesh:
    """A mesh of the file in Cutis and in scikit-fem."""

    def __init__(self, ours):
        self.points = np.array(ours["positions"])
        self.tets = np.array(ours["tets"])
        self.held = np.array(ours["held"])
        self.beam = Beam(self.points, self.tets, self.held)
        self.end, self.length = np.array(ours["end"]), ours["length_m"]
        self.sizes = size_problems(ours, self.beam, self.beam.corners)
        fewer = {**ours, "tet_volumes": ours["tet_volumes"][1:]}
        longer = {**ours, "edge_volumes": [ours["edge_volumes"][0] * 1.00001, *ours["edge_volumes"][1:]]}
        self.controls = [size_problems(wrong, self.beam, self.beam.corners) for wrong in (fewer, longer)]

    def end_displacement(self, u):
        """Mean displacement of the free end, in lengths of the beam."""
        return self.beam.vectors(u)[self.end].mean(axis=0) / self.length


def solve(mesh, case, gravity):
    """The solution of the FEM: the solid, its coefficients at rest, and the end displacement
    with the iterations."""
    material = case["material"]
    youngs, bulk, density = (material[key] for key in ("youngs_pa", "bulk_pa", "density_kg_m3"))
    solid = Solid(mesh.beam, youngs, bulk, density, gravity)
    u, iterations = solid.settle(LOAD_STEPS)
    return solid, u, {"displacement": mesh.end_displacement(u).tolist(), "iterations": iterations}


def resolution(mesh, case, gravity):
    """The strain ρgL/max(E, K) due to the weight, over the rounding of the strain of a cell in
    `f32` at the beam's length."""
    material = case["material"]
    strain = material["density_kg_m3"] * np.linalg.norm(gravity) * mesh.length / max(material["youngs_pa"], material["bulk_pa"])
    cell = np.cbrt(6 * mesh.beam.volumes.min())
    return float(strain / (np.finfo(np.float32).eps / 2 * mesh.length / cell))


def small_strain(mesh, case, gravity):
    """The end displacement by small-strain isotropic elasticity, and the moduli of the lattice,
    for comparison."""
    material = case["material"]
    moduli = effective(material["youngs_pa"], material["bulk_pa"])
    u = isotropic(mesh.beam, moduli["lame_pa"], moduli["shear_pa"], material["density_kg_m3"], gravity)
    return {**moduli, "displacement": mesh.end_displacement(u).tolist()}


def check_case(tally, mesh, case, gravity):
    """Compares one case and returns the figures of the FEM."""
    name, newton = case["name"], case["newton"]
    solid, u, fem = solve(mesh, case, gravity)
    rng = np.random.default_rng(0)
    wobble = mesh.beam.field(rng.standard_normal(mesh.points.shape)) * 0.05 * np.cbrt(mesh.beam.volumes.min())
    fem["derivatives"] = solid.check_derivatives(u + wobble, rng)
    tally.check(f"{name}: derivatives", beyond("derivatives", fem["derivatives"], DERIVATIVES))
    field = np.array(case["positions"]) - mesh.points
    fem["newton_end"] = apart(newton["displacement"], fem["displacement"])
    fem["newton_field"] = apart(field, mesh.beam.vectors(u))
    tally.check(f"{name}: Newton", beyond("end", fem["newton_end"], EXACT) + beyond("field", fem["newton_field"], EXACT))
    # Cutis counts the height from the origin, the FEM from the rest shape.
    energy = solid.energy(u) - solid.load @ mesh.beam.field(mesh.points * ~mesh.held[:, None])
    tally.check(f"{name}: energy", beyond("energy", abs(newton["energy_j"] / energy - 1), EXACT))
    fem["f32_resolution"] = resolution(mesh, case, gravity)
    for run in case["converged"]:
        run["required"] = run["precision"] == "f64" or fem["f32_resolution"] >= RESOLVED
        if not run["required"]:
            continue
        label = f"{name}: {run['backend']} {run['precision']}"
        if run["rest"] is None or not run["rest"]["at_rest"]:
            tally.check(label, [run["error"] or "not at rest"])
        else:
            tally.check(label, beyond("end", apart(run["rest"]["displacement"], fem["displacement"]), CONVERGED))
    for what, displacement in case["controls"].items():
        difference = apart(displacement, fem["displacement"])
        # One tetrahedron shows only in the exact comparison, the other faults show in both.
        bound = EXACT if what.startswith("one") else CONVERGED
        noticed = beyond(what, difference, bound)
        fem.setdefault("controls", {})[what] = difference
        tally.check(f"{name}: control", [] if noticed else [f"{what} was not noticed: off by {difference:.1e}"])
    fem["small_strain"] = small_strain(mesh, case, gravity)
    return fem


def main(arguments):
    program = os.environ.get("CUTIS_STUDY") or sys.exit("FAILED: CUTIS_STUDY does not name the program of the studies")
    output = Path(arguments[1]) if arguments[:1] == ["--json"] and len(arguments) == 2 else None
    if arguments and output is None:
        sys.exit(f"FAILED: {' '.join(arguments)}: the only option is `--json FILE`")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cantilever.json"
        subprocess.run([program, "cantilever", *([] if output else ["--quick"]), "--beams", str(file)], check=True)
        found = json.loads(file.read_text())
    tally = Tally("bent beams, compared with scikit-fem")
    meshes = {key: Mesh(ours) for key, ours in found["beams"].items()}
    for key, mesh in meshes.items():
        tally.check(f"mesh {key}", mesh.sizes)
        tally.check(f"mesh {key}: control", [] if all(mesh.controls) else ["wrong sizes were not noticed"])
    for case in found["cases"]:
        case["fem"] = check_case(tally, meshes[str(case["refinement"])], case, found["gravity_m_s2"])
    if output and not tally.failed:
        packages = ", ".join(f"{name} {version(name)}" for name in ("scikit-fem", "numpy", "scipy"))
        found["python"] = f"Python {platform.python_version()}, {packages}"
        found["beams"] = {}  # the meshes are large, and the tables do not need them
        output.write_text(json.dumps(found))
    tally.finish()


if __name__ == "__main__":
    main(sys.argv[1:])
