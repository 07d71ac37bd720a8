"""What 3D Slicer, ITK and ParaView get from `cutis`, and what they give it: displacement fields,
label maps, markups, surfaces, time series, and the program as a module of 3D Slicer."""

import json
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import nibabel
import nrrd
import numpy as np
import SimpleITK
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from _compare import Tally, run_program

# A cut that opens, on a body whose skin is under tension.
CUT = """
materials = "trunk"
[volume]
path = "{volume}"
[lattice]
spacing_mm = 10.0
region = "whole"
[constraints.distance]
[constraints.volume]
[constraints.membrane]
preset = "trunk"
[fixed]
bone_above_hu = 250.0
end_layers = ["k"]
[[incision]]
{path}
depth_mm = 20.0
[solver]
formulation = "vbd"
substeps = 2
iterations = 2
backend = "cpu"
[run]
frames = {frames}
checkpoint_every = {frames}
[output]
{output}
"""

# A drag without a cut. The lattice has a vertex on every voxel center, and none of them moves onto
# a smooth skin.
DRAG = """
[volume]
path = "{volume}"
[skin]
smooth = false
[constraints.distance]
youngs_modulus_pa = 2.0e4
[fixed]
end_layers = ["k"]
[[handle]]
at_mm = [36.0, 101.0, 0.0]
radius_mm = 30.0
move_mm = [4.0, 9.0, -6.0]
over_s = 0.02
[solver]
formulation = "xpbd"
substeps = 2
backend = "cpu"
[run]
frames = 3
[output]
surface = true
displacement_forward = true
"""

# Moves the skin by more than two voxels.
DRAGGED = """
[[handle]]
at_mm = [-40.0, 100.0, 0.0]
radius_mm = 40.0
move_mm = [-8.0, 18.0, 14.0]
over_s = 0.1
"""

ENDS = "from_mm = [30.0, 110.0, -40.0]\nto_mm = [30.0, 110.0, 40.0]"
ENDS_RAS = [[30.0, 110.0, -40.0], [30.0, 110.0, 40.0]]
LABEL_TYPES = [SimpleITK.sitkUInt8, SimpleITK.sitkInt16, SimpleITK.sitkUInt16, SimpleITK.sitkInt32, SimpleITK.sitkInt64]

# Share of the voxels of a label map that may differ from SimpleITK on the grid of the field: places
# halfway between two voxels, which roundings of 32 bits decide.
SHARE_ON_GRID = 1e-4
# The same on another grid, where SimpleITK interpolates between the vectors of the field.
SHARE_OFF_GRID = 0.01


def run_or_fail(*words):
    process = run_program(*words)
    if process.returncode != 0:
        command = " ".join(map(str, words))
        raise AssertionError(f"cutis {command} ended with {process.returncode}: {process.stderr}")
    return process


def run_scene(folder, text, name="scene"):
    """Runs a scene. Returns its file and its run folder."""
    scene = folder / f"{name}.toml"
    scene.write_text(text)
    run_or_fail("run", scene, "--out", folder / name)
    return scene, folder / name


def transform(path, flip=None):
    """A field as a transform of ITK. `flip` mirrors one component, for a control."""
    image = SimpleITK.ReadImage(str(path), SimpleITK.sitkVectorFloat64)
    if flip is not None:
        values = SimpleITK.GetArrayFromImage(image)
        values[..., flip] *= -1.0
        mirrored = SimpleITK.GetImageFromArray(values, isVector=True)
        mirrored.CopyInformation(image)
        image = mirrored
    return SimpleITK.DisplacementFieldTransform(image)


def check_headers(run, tally):
    """Checks what pynrrd reads: the axes, the frame, and the same vectors as SimpleITK."""
    for name in ("displacement.nrrd", "displacement-forward.nrrd"):
        values, header = nrrd.read(str(run / name))
        problems = []
        if header["kinds"] != ["vector", "domain", "domain", "domain"]:
            problems.append(f"kinds are {header['kinds']}")
        if header["space"] != "left-posterior-superior" or header["type"] != "float":
            problems.append(f"{header['space']}, {header['type']}")
        if not np.isnan(header["space directions"][0]).all():
            problems.append(f"the vectors have a direction in space: {header['space directions'][0]}")
        by_itk = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(run / name)))
        same = np.array_equal(values, by_itk.transpose(3, 2, 1, 0))
        problems += [] if same else ["pynrrd and SimpleITK read different vectors"]
        problems += [] if np.abs(values).max() > 1.0 and np.isfinite(values).all() else ["no motion"]
        tally.check(f"{name} header", problems)


def check_ct(run, volume, tally):
    """Checks that the field resamples the CT as the run did, away from the walls and the gap."""
    ct = SimpleITK.ReadImage(str(volume), SimpleITK.sitkFloat32)
    ours = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(run / "deformed.nii.gz")))
    coverage = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(run / "displacement-coverage.nrrd")))
    apart = {}
    for flip in (None, 0):
        theirs = SimpleITK.Resample(ct, ct, transform(run / "displacement.nrrd", flip), SimpleITK.sitkLinear, -1024.0)
        theirs = SimpleITK.GetArrayFromImage(theirs)
        theirs[coverage == 2] = -1024.0
        apart[flip] = float((np.abs(theirs - ours) > 1.0).mean())
    # Voxels that the wall of the wound crosses hold a mean over the voxel.
    tally.check("the field resamples the CT", [] if apart[None] < 2e-3 else [f"{apart[None]:.2%} of the voxels differ"])
    tally.check("control: a flipped axis", [] if apart[0] > 0.01 else [f"only {apart[0]:.2%} of the voxels differ"])
    print(f"CT by SimpleITK: {apart[None]:.4%} of the voxels differ by more than 1 HU, with a flipped axis {apart[0]:.2%}")
    counts = [int((coverage == value).sum()) for value in range(3)]
    tally.check("coverage", [] if min(counts) > 10 and sum(counts) == coverage.size else [f"counts {counts}"])


def labels_on(reference, dtype, seed):
    """Blocks of labels on a grid."""
    size = np.array(reference.GetSize())
    blocks = np.random.default_rng(seed).integers(0, 5, size=tuple(size[::-1] // 4 + 1))
    values = np.array([0, 1, 3, 100, 127])[blocks.repeat(4, 0).repeat(4, 1).repeat(4, 2)]
    image = SimpleITK.GetImageFromArray(values[: size[2], : size[1], : size[0]].astype(np.int64))
    image = SimpleITK.Cast(image, dtype)
    image.CopyInformation(reference)
    return image


def by_itk(labels, run, flip=None):
    """A label map that SimpleITK moves, without what the body has left."""
    moved = SimpleITK.Resample(labels, labels, transform(run / "displacement.nrrd", flip), SimpleITK.sitkNearestNeighbor, 0)
    coverage = SimpleITK.ReadImage(str(run / "displacement-coverage.nrrd"))
    coverage = SimpleITK.Resample(coverage, labels, SimpleITK.Transform(), SimpleITK.sitkNearestNeighbor, 0)
    moved = SimpleITK.GetArrayFromImage(moved)
    moved[SimpleITK.GetArrayFromImage(coverage) == 2] = 0
    return moved


def check_labels(scene, run, volume, work, tally):
    """Checks `cutis resample --labels` against SimpleITK, in every format and type."""
    ct = SimpleITK.ReadImage(str(volume))
    fine = SimpleITK.Resample(
        ct, [2 * n for n in ct.GetSize()], SimpleITK.Transform(), SimpleITK.sitkNearestNeighbor, ct.GetOrigin(),
        [s / 2 for s in ct.GetSpacing()], ct.GetDirection(), 0.0, SimpleITK.sitkInt16,
    )
    for number, (dtype, ending) in enumerate(zip(LABEL_TYPES, (".nii.gz", ".nrrd", ".mha", ".nhdr", ".mhd"))):
        for reference, share in ((ct, SHARE_ON_GRID), (fine, SHARE_OFF_GRID)):
            labels = labels_on(reference, dtype, number)
            given, out = work / f"labels{number}{ending}", work / f"moved{number}{ending}"
            SimpleITK.WriteImage(labels, str(given))
            run_or_fail("resample", scene, "--run", run, "--labels", given, "--out", out)
            ours = SimpleITK.ReadImage(str(out))
            values, theirs = SimpleITK.GetArrayFromImage(ours), by_itk(labels, run)
            apart = float((values != theirs).mean())
            control = float((values != by_itk(labels, run, flip=1)).mean())
            problems = [] if apart <= share else [f"{apart:.4%} of the labels differ from SimpleITK"]
            problems += [] if control > 0.005 and control > 3 * apart else [f"the control passes: {control:.3%}"]
            problems += [] if ours.GetPixelID() == dtype else [f"the type is {ours.GetPixelIDTypeAsString()}"]
            new = set(np.unique(values)) - set(np.unique(SimpleITK.GetArrayFromImage(labels)))
            problems += [f"labels {new} are new"] if new else []
            unmoved = float((values == SimpleITK.GetArrayFromImage(labels)).mean())
            problems += [] if 0.3 < unmoved < 0.99 else [f"{unmoved:.1%} of the labels are unchanged"]
            grid = "its own grid" if reference is ct else "a finer grid"
            tally.check(f"labels {ending} on {grid}", problems)
            if ending == ".nii.gz":
                print(f"labels on {grid}: {apart:.4%} differ from SimpleITK, with a flipped axis {control:.2%}")


def check_segmentation(scene, run, volume, work, tally):
    """Checks that names of segments stay in an NRRD file, and that layers are refused."""
    labels = labels_on(SimpleITK.ReadImage(str(volume)), SimpleITK.sitkUInt8, 1)
    given, out = work / "skin.seg.nrrd", work / "moved.seg.nrrd"
    for key, value in {"Segment0_Name": "skin", "Segment0_LabelValue": "3", "Segment0_Extent": "0 1 0 1 0 1"}.items():
        labels.SetMetaData(key, value)
    SimpleITK.WriteImage(labels, str(given))
    run_or_fail("resample", scene, "--run", run, "--labels", given, "--out", out)
    header = nrrd.read_header(str(out))
    found = [header.get(f"Segment0_{key}") for key in ("Name", "LabelValue", "Extent")]
    tally.check("names of segments", [] if found == ["skin", "3", None] else [f"{found}"])
    values, header = nrrd.read(str(given))
    layers = {"space": header["space"], "kinds": ["list", "domain", "domain", "domain"], "encoding": "gzip"}
    layers["space directions"] = np.vstack([[np.nan] * 3, header["space directions"]])
    nrrd.write(str(given), np.stack([values, values]), layers)
    refused = run_program("resample", scene, "--run", run, "--labels", given, "--out", work / "none.nrrd")
    said = refused.returncode == 2 and str(given) in refused.stderr and "2 volumes" in refused.stderr
    problems = [] if said and not (work / "none.nrrd").exists() else [refused.stderr]
    tally.check("layers are refused", problems)


def points_of(path, reader):
    """The points of a mesh in mm, the displacements, and the triangles."""
    reader.SetFileName(str(path))
    reader.Update()
    mesh = reader.GetOutput()
    moved = mesh.GetPointData().GetArray("displacement_mm")
    cells = mesh.GetCells() if isinstance(mesh, vtk.vtkUnstructuredGrid) else mesh.GetPolys()
    triangles = vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 3)
    points = vtk_to_numpy(mesh.GetPoints().GetData()).astype(np.float64)
    return points, None if moved is None else vtk_to_numpy(moved).astype(np.float64), triangles


def check_landmarks(work, volume, tally):
    """Checks the field at the vertices of the skin, which are voxel centers."""
    _, run = run_scene(work, DRAG.format(volume=volume), "drag")
    points, moved, _ = points_of(run / "skin.vtu", vtk.vtkXMLUnstructuredGridReader())
    rest = points - moved
    image = SimpleITK.ReadImage(str(volume))
    indices = np.array([image.TransformPhysicalPointToContinuousIndex(p) for p in rest])
    on_voxels = np.abs(indices - indices.round()).max(axis=1) < 1e-3
    errors = {}
    for flip in (None, 1):
        field = transform(run / "displacement-forward.nrrd", flip)
        there = np.array([field.TransformPoint(image.TransformIndexToPhysicalPoint(i)) for i in indices.round().astype(int).tolist()])
        here = np.array([image.TransformIndexToPhysicalPoint(i) for i in indices.round().astype(int).tolist()])
        errors[flip] = np.linalg.norm((there - here) - moved, axis=1)[on_voxels].max()
    problems = [] if on_voxels.mean() > 0.99 and np.linalg.norm(moved, axis=1).max() > 5.0 else ["nothing to compare"]
    problems += [] if errors[None] < 1e-4 else [f"the field is up to {errors[None]:.2e} mm from the displacement of the skin"]
    problems += [] if errors[1] > 1.0 else [f"the control passes: {errors[1]} mm"]
    tally.check("landmarks", problems)
    print(f"landmarks: {on_voxels.sum()} vertices of the skin, largest difference {errors[None]:.2e} mm, with a flipped axis {errors[1]:.2f} mm")


def check_way_to_rest(run, tally):
    """Checks the field at vertices of the deformed skin, where ITK interpolates it."""
    points, moved, _ = points_of(run / "skin.vtu", vtk.vtkXMLUnstructuredGridReader())
    coverage = SimpleITK.ReadImage(str(run / "displacement-coverage.nrrd"))
    values = SimpleITK.GetArrayFromImage(coverage)
    low = np.array([coverage.TransformPhysicalPointToContinuousIndex(p) for p in points.tolist()])
    low = np.floor(low).astype(int)
    inside = ((low >= 0) & (low < np.array(values.shape)[::-1] - 1)).all(axis=1)
    corners = [[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    inside[inside] = np.all([values[tuple((low[inside] + c).T[::-1])] == 1 for c in corners], axis=0)
    field = transform(run / "displacement.nrrd")
    there = np.array([field.TransformPoint(p) for p in points[inside].tolist()])
    error = np.linalg.norm(there - (points - moved)[inside], axis=1)
    share, middle = np.percentile(error, 95), np.median(error)
    still = np.percentile(np.linalg.norm(moved[inside], axis=1), 95)
    problems = [] if inside.sum() > 500 and share < 0.5 and middle < 0.05 else [f"median {middle:.3f} mm, 95 % {share:.3f} mm of {inside.sum()}"]
    problems += [] if still > 2 * share else [f"the control: without the field {still:.3f} mm"]
    tally.check("way to rest", problems)
    print(f"way to rest between voxels: median error {middle:.4f} mm, 95 % below {share:.3f} mm, without the field {still:.2f} mm")


def markups(points_ras, system, kind="Curve", **more):
    sign = -1.0 if system == "LPS" else 1.0
    points = [{"position": [sign * x, sign * y, z]} for x, y, z in points_ras]
    return json.dumps({"markups": [{"type": kind, "coordinateSystem": system, "coordinateUnits": "mm", "controlPoints": points, **more}]})


def check_markups(work, volume, tally):
    """Checks that a path from a file is the same cut as its points in the scene."""
    output = "surface = true\nreport = true"

    def skin(name, path):
        _, run = run_scene(work, CUT.format(volume=volume, path=path, frames=2, output=output), name)
        return (run / "skin.vtu").read_bytes(), json.loads((run / "report.json").read_text())["scene"]["incision"]

    expected, _ = skin("points", f"path_mm = {ENDS_RAS}")
    for system in ("LPS", "RAS"):
        for kind in ("Curve", "Line", "Fiducial"):
            (work / "cut.mrk.json").write_text(markups(ENDS_RAS, system, kind))
            found, incision = skin("markups", 'markups = "cut.mrk.json"')
            problems = [] if found == expected else ["the skin differs from that of the points"]
            problems += [] if incision[0]["path_mm"] == ENDS_RAS and "markups" not in incision[0] else [f"{incision}"]
            tally.check(f"markups {kind} in {system}", problems)
    wrong = markups([[x + 10.0, y, z] for x, y, z in ENDS_RAS], "LPS")
    (work / "cut.mrk.json").write_text(wrong)
    tally.check("control: a shifted path", [] if skin("markups", 'markups = "cut.mrk.json"')[0] != expected else ["passes"])


def check_surfaces(run, tally):
    """Checks PLY, STL and the time series against the skin, as VTK reads them."""
    points, _, triangles = points_of(run / "skin.vtu", vtk.vtkXMLUnstructuredGridReader())
    corners = points[triangles]
    for name, reader in (("skin.ply", vtk.vtkPLYReader()), ("skin.stl", vtk.vtkSTLReader())):
        if name.endswith("stl"):
            reader.MergingOff()
        found, _, faces = points_of(run / name, reader)
        same = faces.shape == triangles.shape and np.abs(found[faces] - corners).max() < 1e-3
        problems = [] if same else ["the triangles are not those of skin.vtu"]
        head = (run / name).read_bytes()[:200]
        problems += [] if b"SPACE=LPS" in head and not head.startswith(b"solid") else ["no SPACE=LPS"]
        control = np.abs(found[faces] * [-1.0, 1.0, 1.0] - corners).max() > 10.0
        problems += [] if control else ["the control passes: a mirrored skin"]
        tally.check(name, problems)
    times, previous = [], None
    for data in ElementTree.parse(run / "skin.pvd").getroot().iter("DataSet"):
        found, moved, _ = points_of(run / data.get("file"), vtk.vtkXMLPolyDataReader())
        times.append((float(data.get("timestep")), float(np.linalg.norm(moved, axis=1).max())))
        previous = found
    problems = [] if len(times) == 4 and np.allclose([t for t, _ in times], np.array([0, 5, 10, 12]) / 60.0) else [f"{times}"]
    growing = [m for _, m in times]
    problems += [] if growing[0] == 0.0 and growing == sorted(growing) and growing[-1] > 1.0 else [f"{growing}"]
    problems += [] if previous is not None and np.array_equal(previous, points) else ["the last frame is not skin.vtu"]
    tally.check("skin.pvd", problems)


# Children of a parameter in the execution model of 3D Slicer.
KNOWN = {"name", "longflag", "flag", "label", "description", "channel", "default", "element", "constraints", "index"}
ELEMENTS = {"image", "pointfile", "double", "string-enumeration", "transform", "geometry", "directory", "file"}


def description_problems(text):
    """Checks a description of a module against the structure of the execution model."""
    root = ElementTree.fromstring(text)
    problems = [] if root.tag == "executable" else [f"the root is {root.tag}"]
    heads = [child.tag for child in root if child.tag != "parameters"]
    wanted = ["category", "title", "description", "version", "documentation-url", "license", "contributor"]
    problems += [] if heads == wanted else [f"{heads}"]
    names = []
    for group in root.iter("parameters"):
        inner = list(group)
        problems += [] if [c.tag for c in inner[:2]] == ["label", "description"] else ["a group has no label"]
        for parameter in inner[2:]:
            fields = {child.tag: child.text for child in parameter}
            names.append(fields.get("name"))
            what = f"<{parameter.tag}> {fields.get('name')}"
            problems += [] if parameter.tag in ELEMENTS else [f"{what} is not an element of a parameter"]
            problems += [f"{what} has <{tag}>" for tag in fields if tag not in KNOWN]
            problems += [f"{what} has no {tag}" for tag in ("name", "label", "description") if not fields.get(tag)]
            is_result = parameter.tag == "double" and fields.get("channel") == "output"
            problems += [] if fields.get("longflag") or is_result else [f"{what} has no flag"]
            needs_channel = parameter.tag in {"image", "pointfile", "transform", "geometry", "directory", "file"}
            valid = fields.get("channel") in ("input", "output")
            problems += [] if valid or not needs_channel else [f"{what} has the channel {fields.get('channel')}"]
            values = [child.text for child in parameter if child.tag == "element"]
            if parameter.tag == "string-enumeration":
                problems += [] if len(values) > 1 and fields.get("default") in values else [f"{what}: {values}"]
    problems += [] if names and len(names) == len(set(names)) else [f"names {names}"]
    return problems


def check_module(work, volume, tally):
    """Calls the program as 3D Slicer does: with each flag that its description lists."""
    text = run_or_fail("--xml").stdout
    tally.check("description", description_problems(text) + ([] if text.startswith("<?xml") else ["something before it"]))
    broken = (text.replace("<channel>", "<chanel>").replace("</channel>", "</chanel>"), text.replace("<longflag>depth</longflag>", ""))
    tally.check("control: a broken description", [] if all(map(description_problems, broken)) else ["passes"])

    (work / "cut.mrk.json").write_text(markups(ENDS_RAS, "LPS"))
    (work / "settings.toml").write_text(CUT.format(volume="elsewhere.nii.gz", path=ENDS, frames=2, output=""))
    values = {
        "inputVolume": volume,
        "incision": work / "cut.mrk.json",
        "outputVolume": work / "out.nrrd",
        "outputTransform": work / "out-transform.nrrd",
        "outputModel": work / "out.ply",
        "runFolder": work / "module-run",
        "scene": work / "settings.toml",
        "spacing": "12",
        "backend": "cpu",
    }
    listed = [(p.find("longflag").text, p.findtext("default")) for p in ElementTree.fromstring(text).iter() if p.find("longflag") is not None]
    words = []
    for flag, default in listed:
        words += [f"--{flag}", values.get(flag, default)]
    process = run_or_fail(*words, "--returnparameterfile", work / "result.txt")
    problems = [f"{path} is missing" for flag, path in values.items() if flag.startswith("output") and not path.exists()]
    deformed, field = SimpleITK.ReadImage(str(work / "out.nrrd")), SimpleITK.ReadImage(str(work / "out-transform.nrrd"))
    problems += [] if deformed.GetSize() == field.GetSize() and field.GetNumberOfComponentsPerPixel() == 3 else ["other grids"]
    opening = (work / "result.txt").read_text().strip().split(" = ")
    problems += [] if opening[0] == "opening" and float(opening[1]) > 1.0 else [f"the result is {opening}"]
    problems += [] if (work / "module-run" / "report.html").exists() else ["no report"]
    tags = [ElementTree.fromstring(line).tag for line in process.stdout.splitlines()]
    problems += [] if "filter-start" in tags and tags[-1] == "filter-end" else [f"progress {tags}"]
    tally.check("a call with each flag", problems)

    # The same without a scene, a run folder and most outputs.
    before = set(Path(tempfile.gettempdir()).glob("cutis-module-*"))
    run_or_fail("--inputVolume", volume, "--incision", work / "cut.mrk.json", "--spacing", 10, "--outputTransform", work / "alone.nrrd")
    left = set(Path(tempfile.gettempdir()).glob("cutis-module-*")) - before
    tally.check("a short call", ([] if (work / "alone.nrrd").exists() else ["no field"]) + [f"{path} is left" for path in left])
    for wrong, said in (
        (["--inputVolume", volume], "nothing to write"),
        (["--inputVolume", volume, "--outputVolume", work / "a.nrrd"], "--incision"),
        (["--inputVolume", volume, "--incision", volume, "--outputVolume", work / "a.nrrd"], "incision"),
        (["--inputVolume", volume, "--outputTransform", work / "a.h5"], ".nrrd"),
    ):
        process = run_program(*wrong)
        refused = process.returncode == 2 and said in process.stderr and not (work / "a.nrrd").exists()
        tally.check(f"refused: {said}", [] if refused else [f"{process.returncode} {process.stderr}"])


def main():
    tally = Tally("slicer")
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        volume = work / "ct.nii.gz"
        run_or_fail("phantom", "--size", "72,64,48", "--seed", 1, "--out", volume)
        assert nibabel.load(volume).shape == (72, 64, 48)
        output = "volume = true\nsurface = true\ndisplacement = true\ndisplacement_forward = true\nply = true\nstl = true\nseries_every = 5"
        scene, run = run_scene(work, CUT.format(volume=volume, path=ENDS, frames=12, output=output + DRAGGED))
        check_headers(run, tally)
        check_ct(run, volume, tally)
        check_labels(scene, run, volume, work, tally)
        check_segmentation(scene, run, volume, work, tally)
        check_landmarks(work, volume, tally)
        check_way_to_rest(run, tally)
        check_surfaces(run, tally)
        check_markups(work, volume, tally)
        check_module(work, volume, tally)
    tally.finish()


if __name__ == "__main__":
    main()
