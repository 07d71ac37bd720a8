"""Volumes as nibabel, SimpleITK and `cutis inspect` read them, converted to one form (RAS+
millimeters) and compared.

A comparison returns its differences as texts, or an empty list, so that controls can test that it
reports a difference.
"""

import json
import os
import subprocess
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import nibabel
import numpy as np
import SimpleITK

SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)
warnings.filterwarnings("ignore", category=UserWarning, module="nibabel")

PROGRAM = os.environ.get("CUTIS_PROGRAM", "cutis")
CHECKOUT = Path(__file__).resolve().parents[2]
IN_CI = os.environ.get("CI", "") not in ("", "false")

# Largest distance of two corners over the smallest voxel spacing: NIfTI stores single precision.
POSITION_SHARE = 1e-3
# Largest relative difference of extremes and mean: the rounding of a slope in double precision.
VALUE_SHARE = 1e-12

MILLIMETERS = {"meter": 1000.0, "mm": 1.0, "micron": 0.001, "unknown": 1.0}


@dataclass
class Seen:
    """A volume as one program reads it."""

    shape: tuple
    affine: np.ndarray  # 4 x 4, index to RAS+ mm
    hu_min: float
    hu_max: float
    hu_sum: float
    nan_count: int
    dtype: str | None = None  # None where the program does not tell
    values: np.ndarray | None = None  # indexed [i, j, k]

    @classmethod
    def of_values(cls, values, affine, dtype):
        finite = values[~np.isnan(values)] if values.dtype.kind == "f" else values
        extremes = float(finite.min()), float(finite.max())
        total = float(finite.sum(dtype=np.float64))
        return cls(values.shape, affine, *extremes, total, values.size - finite.size, dtype, values)


def by_nibabel(path):
    """Reads a file with nibabel and converts its unit to mm."""
    image = nibabel.load(path)
    if image.get_data_dtype().names is not None:
        raise ValueError("voxels are records")
    values = np.asarray(image.dataobj)
    if values.ndim == 4 and values.shape[3] == 1:
        values = values[..., 0]
    affine = image.affine.astype(np.float64).copy()
    affine[:3] *= MILLIMETERS[image.header.get_xyzt_units()[0]]
    return Seen.of_values(values, affine, image.get_data_dtype().newbyteorder("=").name)


def by_itk(path):
    """Reads a file with SimpleITK. It indexes [k, j, i] and uses LPS, so that the first two
    world axes change sign."""
    image = SimpleITK.ReadImage(str(path))
    if image.GetNumberOfComponentsPerPixel() > 1:
        raise ValueError("voxels are vectors")
    values = SimpleITK.GetArrayFromImage(image).T
    size = image.GetDimension()
    direction = np.array(image.GetDirection()).reshape(size, size)[:3, :3]
    affine = np.eye(4)
    affine[:3, :3] = direction * np.array(image.GetSpacing())[:3]
    affine[:3, 3] = image.GetOrigin()[:3]
    affine[:2] *= -1.0
    return Seen.of_values(values, affine, None)


def run_program(*words):
    """The finished `cutis` process."""
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=600)


def inspect(path):
    """Runs `cutis inspect`. Returns the volume and the report, or None and the process if it
    refuses the file."""
    process = run_program("inspect", path, "--json")
    if process.returncode != 0:
        return None, process
    report = json.loads(process.stdout)
    affine = np.array(report["affine"], dtype=np.float64)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not np.allclose(spacing, report["spacing_mm"], rtol=1e-5, atol=0.0):
        raise AssertionError(f"{path}: spacing_mm {report['spacing_mm']} is not that of the affine, {spacing}")
    keys = ("hu_min", "hu_max", "hu_sum", "nan_count", "dtype")
    return Seen(tuple(report["shape"]), affine, **{key: report[key] for key in keys}), report


def differences(ours, theirs, ignore=()):
    """The differences between two readings of one volume, as texts. `ignore` names fields to
    skip."""
    found = []

    def compare(field, same):
        if field not in ignore and not same:
            found.append(f"{field}: {getattr(ours, field)} is not {getattr(theirs, field)}".replace("\n", " "))

    compare("shape", tuple(ours.shape) == tuple(theirs.shape))
    compare("affine", same_place(ours, theirs))
    allowed = VALUE_SHARE * max(abs(theirs.hu_min), abs(theirs.hu_max), 1.0)
    compare("hu_min", abs(ours.hu_min - theirs.hu_min) <= allowed)
    compare("hu_max", abs(ours.hu_max - theirs.hu_max) <= allowed)
    compare("hu_sum", abs(ours.hu_sum - theirs.hu_sum) <= allowed * np.prod(theirs.shape))
    compare("nan_count", ours.nan_count == theirs.nan_count)
    if ours.dtype is not None and theirs.dtype is not None:
        compare("dtype", ours.dtype == theirs.dtype)
    return found


def same_place(ours, theirs):
    """True if all eight corners have the same world position."""
    if tuple(ours.shape) != tuple(theirs.shape):
        return False
    corners = np.array([[i, j, k, 1.0] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    corners[:, :3] *= np.array(theirs.shape) - 1.0
    corners[:, :3] += np.arange(8)[:, None] / 8.0  # so that a single slice, too, has an extent along its normal
    apart = np.linalg.norm(corners @ (ours.affine - theirs.affine).T, axis=1).max()
    return bool(apart <= POSITION_SHARE * np.linalg.norm(theirs.affine[:3, :3], axis=0).min())


def marked_voxel_mm(seen):
    """World position of the first voxel with the largest value."""
    index = np.unravel_index(np.nanargmax(seen.values), seen.values.shape)
    return (seen.affine @ np.array([*index, 1.0]))[:3]


def require_rejection(seen):
    """Control: each single change of `seen` must be reported as a difference."""
    spacing = np.linalg.norm(seen.affine[:3, :3], axis=0).min()
    shifted = seen.affine.copy()
    shifted[0, 3] += 0.01 * spacing
    mirrored = seen.affine.copy()
    mirrored[:2] *= -1.0
    changes = {
        "affine": (shifted, mirrored),
        "shape": ((*seen.shape[:2], seen.shape[2] + 1),),
        "hu_min": (seen.hu_min - 1.0,),
        "hu_sum": (seen.hu_sum + 1.0,),
        "nan_count": (seen.nan_count + 1,),
    }
    for field, values in changes.items():
        for value in values:
            changed = Seen(**{**seen.__dict__, field: value})
            if not any(line.startswith(field) for line in differences(changed, seen)):
                raise AssertionError(f"negative control: a wrong {field} was not noticed")


class Tally:
    """Counts passed and failed checks, and ends the program with the exit code."""

    def __init__(self, title):
        self.title, self.passed, self.failed = title, 0, 0

    def check(self, label, problems):
        """Counts one check. `problems` is a list of texts, empty if the check passed."""
        if problems:
            self.failed += 1
            for problem in problems:
                print(f"FAILED {label}: {problem}")
        else:
            self.passed += 1

    def finish(self):
        print(f"{self.title}: {self.passed} passed, {self.failed} failed")
        sys.exit(1 if self.failed or not self.passed else 0)


def data_folder():
    """The folder of real test volumes. None if it is missing, with a printed reason; in CI that
    is an error."""
    folder = Path(os.environ.get("CUTIS_TEST_DATA") or CHECKOUT.parent / "shared" / "data")
    if folder.is_dir():
        return folder
    reason = f"no test data in {folder} (set CUTIS_TEST_DATA)"
    if IN_CI:
        sys.exit(f"FAILED: {reason}, and CI is set")
    print(f"skipped: {reason}")
    return None
