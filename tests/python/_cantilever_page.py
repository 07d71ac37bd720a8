"""The page and the table of `cargo xtask cantilever`."""

import csv
import os
import platform
import subprocess
from importlib.metadata import version

import numpy as np

COLUMNS = ("case", "solved by", "formulation", "dt, s", "substeps", "iterations", "down, % of length", "sideways, % of length",
           "down beyond FEM, %", "distance from FEM, %", "at rest", "simulated, s")


def rows_of(case):
    """One row for each way in which the beam was bent."""
    reference = np.array(case["fem"]["displacement"])

    def row(solved_by, displacement, way=None, rest=None):
        x = np.full(3, np.nan) if displacement is None else np.array(displacement)
        way, rest = way or {}, rest or {}
        return (case["name"], solved_by, way.get("formulation", ""), way.get("dt_s", ""), way.get("substeps", ""), way.get("iterations", ""),
                -100 * x[1], 100 * x[2], 100 * (x[1] / reference[1] - 1),
                100 * np.linalg.norm(x - reference) / np.linalg.norm(reference),
                rest.get("at_rest", ""), rest.get("time_s", ""))

    yield row("scikit-fem", reference)
    yield row("newton", case["newton"]["displacement"])
    yield row("scikit-fem, small strain, isotropic", case["fem"]["small_strain"]["displacement"])
    for kind, runs in (("short substeps", case["converged"]), ("real time", case["real_time"])):
        for run in runs:
            rest = run["rest"]
            solved_by = f"{kind}, {run['backend']} {run['precision']}"
            yield row(solved_by, rest and rest["displacement"], run["way"], rest)


def write_page(folder, found):
    """Writes both files."""
    with (folder / "cantilever.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for case in found["cases"]:
            for row in rows_of(case):
                table.writerow([f"{value:.9g}" if isinstance(value, float) else value for value in row])
    (folder / "cantilever.md").write_text(page(found))
    print(f"written: {folder / 'cantilever.md'}")


def page(found):
    """The page as text."""
    machine = found["machine"]
    commit = subprocess.run(["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"], capture_output=True, text=True)
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    versions = ", ".join(f"{name} {version(name)}" for name in ("scikit-fem", "numpy", "scipy"))
    parts = [
        "# Cantilever: a beam under its own weight, against scikit-fem\n",
        f"Written by `cargo xtask cantilever` at commit {commit.stdout.strip() or 'unknown'}, Cutis {found['cutis_version']}, Python "
        f"{platform.python_version()}, {versions}; on {machine['cpu']}, {machine['cores']} cores, {machine['system']}, load at the end "
        f"{load}; GPU: {found['gpu'] or 'none'}. Every row of every table, and more, is in [cantilever.csv](cantilever.csv).\n",
        "A beam of 200 × 50 × 50 mm on a `kuhn6` lattice of 20 × 5 × 5 or 40 × 10 × 10 cells, 1000 kg/m³, held at one end, bends under "
        "9.81 m/s². The same tetrahedra and the same energy are given to four programs: springs with `α = L²/(E·Vₑ)` and volumes with "
        "`α = V₀/K`, which on linear tetrahedra is the density `E/12·Σ(|F e| − 1)² + K/2·(det F − 1)²`. scikit-fem assembles that density "
        "with derivatives written out by hand and checked by differences; `cutis-newton` minimizes the energy of the constraints; the "
        "solver (CPU, GPU) steps until the beam hangs still. Measured is the mean displacement of the free end.\n",
        agreement(found), convergence(found), real_time(found), orientation(found), controls(found),
    ]
    return "\n".join(parts)


def table(head, rows):
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def agreement(found):
    cases = found["cases"]
    worst = max(max(case["fem"]["newton_end"], case["fem"]["newton_field"]) for case in cases)
    rows = []
    for case in cases:
        fem, newton, material = case["fem"], case["newton"], case["material"]
        x = np.array(fem["displacement"])
        rows.append([case["name"], f"{material['youngs_pa']:.3g}", f"{-100 * x[1]:.4f}", f"{100 * x[2]:.4f}", f"{fem['newton_end']:.0e}",
                     f"{fem['newton_field']:.0e}", f"{fem['derivatives']:.0e}", fem["iterations"], newton["iterations"]])
    head = ["case", "E, Pa", "down, % of length", "sideways, %", "Newton: end off by", "all vertices (RMS)", "FEM derivatives off by",
            "FEM iterations", "Newton iterations"]
    return (
        f"## Two independent programs\n\nThe largest relative difference between scikit-fem and `cutis-newton` is {worst:.0e}.\n\n"
        + table(head, rows)
        + "\nThe beam also moves sideways: the lattice has diagonals in one direction only and is no mirror image of itself.\n"
    )


def run_cells(run, reference):
    """How a run stepped and where it ended."""
    way = run["way"]
    how = [f"{1e3 * way['dt_s'] / way['substeps']:.3f}", way["substeps"], way["iterations"]]
    if run["rest"] is None:
        return [*how, "exploded", "", ""]
    x = np.array(run["rest"]["displacement"])
    off = 100 * np.linalg.norm(x - reference) / np.linalg.norm(reference)
    return [*how, f"{-100 * x[1]:.2f}", f"{off:.3g}", "yes" if run["rest"]["at_rest"] else "no"]


def convergence(found):
    rows, worst, lost = [], 0.0, []
    for case in found["cases"]:
        reference = np.array(case["fem"]["displacement"])
        for run in case["converged"]:
            cells = run_cells(run, reference)
            rows.append([case["name"], f"{run['backend']} {run['precision']}", *cells, f"{case['fem']['f32_resolution']:.0f}"])
            if run["held"]:
                worst = max(worst, float(cells[4]))
            else:
                lost.append(f"{case['name']} ({cells[4]} %)")
    head = ["case", "backend", "h, ms", "substeps", "iterations", "down, % of length", "off by, %", "at rest", "resolution of f32"]
    text = (
        f"## The solver with short substeps\n\nXPBD with substeps `h` that are not long beside the time in which a wave crosses a cell. "
        f"The end is off by at most {worst:.2g} %"
    )
    if lost:
        text += (
            f", but for {', '.join(lost)} in `f32`: there rounding takes part of the strain that the weight causes. The last column is that "
            "strain, `ρgL/max(E, K)`, over the one that rounding a position changes in a cell; below 100 single precision is not held to "
            "the 1 % that is asked for everywhere else. Double precision needs no such exception"
        )
    return text + ".\n\n" + table(head, rows)


def real_time(found):
    text = "## The solver in real time\n\nFrames of 1/60 s on the CPU in `f32`, damped until the beam hangs still (or 5 s are over: *no* " \
           "in the last column).\n"
    best, few, descent = [], [], []
    for case in found["cases"]:
        if not case["real_time"]:
            continue
        reference = np.array(case["fem"]["displacement"])
        rows = [[run["way"]["formulation"], *run_cells(run, reference)] for run in case["real_time"]]
        ratio = {}
        for run in case["real_time"]:
            if run["rest"] and run["way"]["formulation"] == "xpbd":
                ratio[run["way"]["substeps"], run["way"]["iterations"]] = run["rest"]["displacement"][1] / reference[1]
        for run, row in zip(case["real_time"], rows):
            if run["way"]["formulation"] == "vbd" and run["rest"]:
                descent.append((float(row[5]), case["name"], f"{row[2]} × {row[3]}"))
        for (substeps, iterations), share in ratio.items():
            (best if abs(share - 1) <= 0.05 else few).append((case["name"], substeps, iterations, share))
        head = ["formulation", "h, ms", "substeps", "iterations", "down, % of length", "off by, %", "at rest"]
        text += f"\n### {case['name']}\n\nThe FEM says {-100 * reference[1]:.2f} % down.\n\n" + table(head, rows)
    return text + "\n" + in_words(best, few, descent)


def in_words(near, far, descent):
    """What the tables of real time say."""
    text = "### In words\n\n"
    softest = max(far, key=lambda row: row[3], default=None)
    if near:
        cheapest = {}
        for name, substeps, iterations, share in sorted(near, key=lambda row: row[1] * row[2]):
            cheapest.setdefault(name, f"{substeps} × {iterations} ({100 * (share - 1):+.1f} %)")
        text += "Within 5 % of the sag, at the least work (substeps × iterations):\n\n"
        text += "".join(f"- {name}: {setting}\n" for name, setting in cheapest.items()) + "\n"
    names = {row[0] for row in far} - {row[0] for row in near}
    if names:
        text += "No setting came within 5 % for: " + "; ".join(sorted(names)) + ".\n\n"
    if softest:
        name, substeps, iterations, share = softest
        text += f"The softest was {substeps} × {iterations} on \"{name}\", which sank {share:.1f} times as far as the material does.\n\n"
    if descent:
        off, name, setting = max(descent)
        text += f"Vertex block descent (`vbd`) was off by at most {off:.2g} %, with {setting} on \"{name}\".\n\n"
    return text + (
        "A beam that hangs still is not a beam that hangs right: with long substeps a constraint of XPBD pulls with a part of its force only, "
        "and the stiffer the material and the finer the lattice, the smaller is that part (see [theory](../book/theory.md)). PBD knows no "
        "material: its sag is the same for every `E` and depends on substeps and iterations.\n"
    )


def orientation(found):
    rows = []
    for case in found["cases"]:
        fem, soft = case["fem"], case["fem"]["small_strain"]
        youngs = case["material"]["youngs_pa"]
        rows.append([case["name"], *(f"{soft[key] / youngs:.4f}" for key in ("along_axis_pa", "along_diagonal_pa", "youngs_pa")),
                     f"{soft['poisson']:.3f}", f"{-100 * soft['displacement'][1]:.2f}", f"{-100 * fem['displacement'][1]:.2f}",
                     f"{measured(case) / youngs:.4f}"])
    head = ["case", "along an axis / E", "along the diagonal / E", "isotropic / E", "its ν", "isotropic, small strain: down, %",
            "same energy: down, %", "slender beam / E"]
    return (
        "## For orientation: which Young's modulus is that?\n\n`E` is the modulus of the springs, not of the body. For small strains the lattice "
        "has the stiffness `E·⟨e e e e⟩ + K·1⊗1`, the mean over the edges; from it come Young's modulus along an axis and along the "
        "diagonal of the cubes, and that of the isotropic solid which is as stiff on average over all directions, with Poisson's "
        "ratio. scikit-fem bends the same mesh with that isotropic solid, too. The last column is the modulus with which Euler and "
        "Bernoulli's slender beam, `ρgAL⁴/(8·E·I)`, sinks as far; it means something where the sag is small. It is above the modulus along an axis "
        "where linear tetrahedra cannot bend without changing volume (locking: `K = 10 E`, the coarse mesh), and goes down as "
        "the mesh is refined.\n\n" + table(head, rows)
    )


def measured(case):
    """The modulus of a slender beam, 200 mm long and 50 mm thick, that sinks as far."""
    length, thick, density = 0.2, 0.05, case["material"]["density_kg_m3"]
    return 12 * density * 9.81 * length**3 / (8 * thick**2) / -case["fem"]["displacement"][1]


def controls(found):
    rows = [[case["name"], what, f"{off:.1e}"] for case in found["cases"] for what, off in case["fem"].get("controls", {}).items()]
    return (
        "## Controls\n\nThe comparison must see what is wrong on purpose; it does.\n\n" + table(["case", "wrong", "end off by"], rows)
    )
