"""The outputs of `cutis`, read by nibabel and SimpleITK: equal voxels, equal positions, and a
header that both accept."""

import json
import tempfile
from pathlib import Path

import nibabel
import numpy as np

from _compare import (
    POSITION_SHARE,
    Tally,
    by_itk,
    by_nibabel,
    data_folder,
    differences,
    inspect,
    marked_voxel_mm,
    require_rejection,
    run_program,
    same_place,
)

# Springs at rest, so that only gravity moves the body in these scenes.
SCENE = """
scan_is_at_rest = false
[volume]
path = "{volume}"
[tissue]
keep = "all"
[constraints.distance]
youngs_modulus_pa = 2.0e4
[solver]
formulation = "xpbd"
dt_s = {dt_s}
substeps = 1
gravity_m_s2 = [{gravity}, 0.0, 0.0]
damping_per_s = 0.0
[run]
frames = {frames}
[output]
volume = true
report = true
"""

# A handle pulls up a belly of ChainMail elements without fixed ones.
CHAIN = """
model = "chainmail"
[volume]
path = "{volume}"
[lattice]
spacing_mm = 16.0
[[handle]]
at_mm = [{at}]
radius_mm = {radius}
move_mm = [0.0, {by}, 0.0]
over_s = 0.02
[run]
frames = 4
[output]
volume = true
report = true
"""

# Inputs with other orientations, types and slopes, from the folder of test data.
OTHERS = ["awkward/orient_PIR.nii.gz", "awkward/oblique.nii.gz", "awkward/bigendian_i16.nii", "ct/leg_sts013_64x55x58.nii.gz"]

REPORT_KEYS = {
    "schema": (),
    "cutis_version": (),
    "inputs": (),
    "backend": ("name", "adapter"),
    "sizes": ("vertices", "edges", "tets", "skin_triangles"),
    "colors": ("descent",),
    "stages": (),
    "frames": ("count", "ms_mean", "ms_min"),
    "wound": ("initial_mm", "final_mm", "mid_mm"),
    "resample": ("moved_voxels", "folds"),
    "residuals": (),
    "left_out": (),
    "warnings": (),
}


def run_or_fail(*words):
    process = run_program(*words)
    if process.returncode != 0:
        command = " ".join(map(str, words))
        raise AssertionError(f"cutis {command} ended with {process.returncode}: {process.stderr}")
    return process


def header_problems(path):
    """Checks the header: NIfTI-1, int16, no scaling, mm, equal qform and sform."""
    image = nibabel.load(path)
    header = image.header
    wanted = {
        "NIfTI-1": type(image) is nibabel.Nifti1Image,
        "int16": image.get_data_dtype() == np.int16,
        "slope 1": image.dataobj.slope == 1.0 and image.dataobj.inter == 0.0,
        "mm": header.get_xyzt_units()[0] == "mm",
        "codes 1": int(header["qform_code"]) == int(header["sform_code"]) == 1,
        "qform = sform": np.allclose(
            image.get_qform(), image.get_sform(), rtol=0.0, atol=POSITION_SHARE * min(header.get_zooms())
        ),
    }
    return [f"header is not {name}" for name, held in wanted.items() if not held]


def readers_agree(path, label, tally):
    """Checks that all three programs read the same volume with the same brightest voxel. Returns
    the volume of nibabel."""
    ours, report = inspect(path)
    if ours is None:
        raise AssertionError(f"cutis refuses its own {label}: {report.stderr}")
    nibabel_sees, itk_sees = by_nibabel(path), by_itk(path)
    apart = np.abs(marked_voxel_mm(nibabel_sees) - marked_voxel_mm(itk_sees)).max()
    tally.check(f"{label} header", header_problems(path))
    tally.check(f"{label} by nibabel", differences(ours, nibabel_sees))
    tally.check(f"{label} by SimpleITK", differences(ours, itk_sees))
    tally.check(f"{label} marked voxel", [] if apart < 1e-3 else [f"{apart} mm apart"])
    require_rejection(nibabel_sees)
    return nibabel_sees


def deformed(volume, folder, frames=0, gravity=0.0, dt_s=0.01):
    """Runs the scene and returns the path of the deformed CT."""
    folder.mkdir()
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(volume=volume, frames=frames, gravity=gravity, dt_s=dt_s))
    run_or_fail("run", scene, "--out", folder / "run")
    return folder / "run" / "deformed.nii.gz"


def untouched_problems(before, after):
    """Checks that an unmoved body has the same voxels at the same position."""
    problems = [] if same_place(after, before) else ["shape or affine changed"]
    if before.values.shape == after.values.shape:
        changed = int((before.values != after.values).sum())
        problems += [f"{changed} voxels changed"] if changed else []
    return problems


def shifted_problems(before, after):
    """Checks that inner tissue has moved by one voxel along the first axis with equal values."""
    tissue = before.values > -449
    inner = tissue[1:-1, 1:-1, 1:-1].copy()
    for axis in range(3):
        for step in (-1, 1):
            inner &= np.roll(tissue, step, axis)[1:-1, 1:-1, 1:-1]
    if inner.sum() < 1000:
        return [f"only {inner.sum()} voxels to compare"]
    source = before.values[1:-1, 1:-1, 1:-1][inner]
    target = after.values[2:, 1:-1, 1:-1][inner]
    wrong = int((source != target).sum())
    return [f"{wrong} of {inner.sum()} voxels did not arrive"] if wrong else []


def check_phantom(work, tally):
    phantom = work / "phantom.nii.gz"
    for path, seed in ((phantom, 1), (work / "again.nii.gz", 1), (work / "other.nii.gz", 2)):
        run_or_fail("phantom", "--size", "48,48,40", "--seed", seed, "--out", path)
    same = phantom.read_bytes() == (work / "again.nii.gz").read_bytes()
    other = phantom.read_bytes() != (work / "other.nii.gz").read_bytes()
    tally.check("phantom by seed", ([] if same else ["one seed, two files"]) + ([] if other else ["the seed has no effect"]))
    return phantom, readers_agree(phantom, "phantom", tally)


def check_runs(phantom, before, work, tally):
    rest = readers_agree(deformed(phantom, work / "rest"), "rest", tally)
    tally.check("rest", untouched_problems(before, rest))

    # One frame under gravity g moves everything by g dt^2: here by one voxel along +x.
    step_mm = before.affine[0, 0]
    falling = deformed(phantom, work / "fall", frames=1, gravity=step_mm / 1000.0 / 0.01**2)
    fallen = readers_agree(falling, "fall", tally)
    tally.check("fall", shifted_problems(before, fallen))
    tally.check("fall keeps the grid", [] if same_place(fallen, before) else ["shape or affine changed"])

    caught = bool(untouched_problems(before, fallen)) and bool(shifted_problems(before, rest))
    tally.check("negative control", [] if caught else ["a fall passed for rest, or rest for a fall"])


def check_demo(work, tally):
    folder = work / "demo"
    run_or_fail("demo", "--out", folder, "--frames", 2)
    readers_agree(folder / "deformed.nii.gz", "demo", tally)
    report = json.loads((folder / "report.json").read_text())
    missing = [key for key in REPORT_KEYS if key not in report]
    for key, inner in REPORT_KEYS.items():
        missing += [f"{key}.{name}" for name in inner if name not in (report.get(key) or {})]
    tally.check("demo report", [f"report.json has no {key}" for key in missing])
    unfinished = [path.name for path in folder.iterdir() if not path.stat().st_size or path.suffix in (".tmp", ".part")]
    tally.check("demo folder", [f"{name} is empty or unfinished" for name in unfinished])


def near(image, place, radius):
    """A mask of the voxels within a distance of a point, in mm."""
    indices = np.indices(image.values.shape).reshape(3, -1)
    places = image.affine[:3, :3] @ indices + image.affine[:3, 3:]
    apart = np.linalg.norm(places - np.array(place).reshape(3, 1), axis=0)
    return (apart <= radius).reshape(image.values.shape)


def changed_problems(before, after, handle, reach):
    """Checks that voxels near the handle have changed and that voxels beyond its reach have not."""
    changed = before.values != after.values
    close, beyond = changed[near(before, handle, 30.0)], int(changed[~near(before, handle, reach)].sum())
    problems = [] if same_place(after, before) else ["shape or affine changed"]
    problems += [] if close.mean() > 0.9 else [f"only {close.sum()} of {close.size} voxels changed near the handle"]
    return problems + ([f"{beyond} voxels changed beyond its reach"] if beyond else [])


def unlike_schema(value, schema, whole, name="report"):
    """Required keys that a document lacks, and keys that its schema does not know."""
    if "$ref" in schema:
        schema = whole["$defs"][schema["$ref"].rsplit("/", 1)[1]]
    for choice in schema.get("anyOf", []):
        if "$ref" in choice and value is not None:
            return unlike_schema(value, choice, whole, name)
    if isinstance(value, list):
        return [line for entry in value for line in unlike_schema(entry, schema.get("items", {}), whole, f"{name}[]")]
    known = schema.get("properties")
    if not isinstance(value, dict) or known is None:
        return []
    problems = [f"{name}.{key} is missing" for key in schema.get("required", []) if key not in value]
    problems += [f"{name}.{key} is not in the schema" for key in value if key not in known]
    return problems + [line for key in value if key in known for line in unlike_schema(value[key], known[key], whole, f"{name}.{key}")]


def report_problems(path):
    """Checks that a report of ChainMail follows the schema."""
    report = json.loads(path.read_text())
    schema = json.loads(run_or_fail("scene", "report-schema").stdout)
    problems = unlike_schema(report, schema, schema)
    damaged = {**report, "chainmail": {"unheard_of": 0}}
    problems += [] if len(unlike_schema(damaged, schema, schema)) > 2 else ["a damaged report passes"]
    chainmail = report.get("chainmail") or {}
    problems += [] if chainmail.get("moved", 0) > 20 and chainmail.get("violated_links") == 0 else [f"chainmail: {chainmail}"]
    return problems


def check_chain(phantom, before, work, tally):
    handle, reach = [-40.0, 100.0, 0.0], 130.0
    after = {}
    for name, by in (("chain", 20.0), ("chain at rest", 0.0)):
        folder = work / name
        folder.mkdir()
        scene = folder / "scene.toml"
        scene.write_text(CHAIN.format(volume=phantom, at=", ".join(map(str, handle)), radius=25.0, by=by))
        run_or_fail("run", scene, "--out", folder / "run")
        after[name] = readers_agree(folder / "run" / "deformed.nii.gz", name, tally)
    tally.check("chain pulls", changed_problems(before, after["chain"], handle, reach))
    tally.check("chain report", report_problems(work / "chain" / "run" / "report.json"))
    tally.check("chain at rest stays", untouched_problems(before, after["chain at rest"]))
    caught = changed_problems(before, after["chain at rest"], handle, reach) and untouched_problems(before, after["chain"])
    tally.check("chain negative control", [] if caught else ["a drag passed for rest, or rest for a drag"])


def check_others(work, tally):
    data = data_folder()
    if data is None:
        return
    for number, name in enumerate(OTHERS):
        before = by_nibabel(data / name)
        after = readers_agree(deformed(data / name, work / f"other{number}"), name, tally)
        tally.check(f"{name} untouched", untouched_problems(before, after))


def main():
    tally = Tally("outputs")
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        phantom, before = check_phantom(work, tally)
        check_runs(phantom, before, work, tally)
        check_demo(work, tally)
        check_chain(phantom, before, work, tally)
        check_others(work, tally)
    tally.finish()


if __name__ == "__main__":
    main()
