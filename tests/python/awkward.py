"""Odd and ordinary NIfTI files: `cutis inspect` reads the same volume as nibabel and SimpleITK, or
refuses the file.

Known differences between the programs are data with a reason. A check fails if a file is
unexpectedly accepted or refused, or if a known difference no longer occurs.
"""

from pathlib import Path

import numpy as np

from _compare import Tally, by_itk, by_nibabel, data_folder, differences, inspect, require_rejection

# Files that must be refused with exit code 2, and a word of the message.
REFUSED = {
    "truncated.nii": "ends before the last voxel (SimpleITK fills the rest with zeros)",
    "truncated.nii.gz": "the compressed data ends early (SimpleITK fills the rest with zeros)",
    "rgb24.nii.gz": "three values a voxel are no Hounsfield units",
    "4d_x3.nii.gz": "three volumes in one file: which one is meant?",
}

# Fields in which a reader differs from the NIfTI standard and from Cutis.
NIBABEL_DIFFERS = {
    "no_form.nii.gz": (
        {"affine"},
        "without sform and qform nibabel centers and mirrors the volume; the standard only scales",
    ),
}
ITK_DIFFERS = {
    "no_form.nii.gz": ({"affine"}, "without sform and qform ITK takes the axes for LPS"),
    "q_s_conflict.nii.gz": ({"affine"}, "ITK prefers the qform, Cutis and nibabel the sform"),
    "i16_slope0.nii.gz": (
        {"hu_min", "hu_max", "hu_sum"},
        "slope 0 means unscaled; ITK adds the intercept",
    ),
    "f32_nan_padding.nii.gz": ({"nan_count"}, "ITK reads NaN as 0"),
}

# Files that another program refuses and Cutis reads.
ITK_REFUSES = {
    "nifti2_i16.nii.gz": "SimpleITK is built without NIfTI-2",
    "nifti2_bigendian_i16.nii.gz": "SimpleITK is built without NIfTI-2",
    "sheared_sform_only.nii.gz": "ITK wants orthogonal axes",
}

# Files that must cause a warning, and a word of the warning.
WARNED = {
    "q_s_conflict.nii.gz": "qform",
    "no_form.nii.gz": "",
    "f32_nan_padding.nii.gz": "NaN",
}

# No other program reads pixdim alone, so that the expected affine is written here.
NO_FORM_AFFINE = np.diag([9.307692527770996, 9.375, 9.514286041259766, 1.0])


def attempt(reader, path):
    """The volume as a program reads it, or the reason of its refusal."""
    try:
        return reader(path), None
    except Exception as error:  # each library has its own kinds
        return None, f"{type(error).__name__}: {str(error).strip().splitlines()[-1]}"


def compared(ours, theirs, known):
    """The unknown differences. A known difference that no longer occurs is a problem too."""
    fields, reason = known
    found = differences(ours, theirs)
    unexpected = [line for line in found if line.split(":")[0] not in fields]
    gone = fields - {line.split(":")[0] for line in found}
    return unexpected + [f"no longer differs in {field}; remove the entry ({reason})" for field in sorted(gone)]


def refusal_problems(path, accepted, process):
    if accepted is not None:
        return [f"was accepted, but {REFUSED[path.name]}"]
    message = process.stdout + process.stderr
    problems = [] if process.returncode == 2 else [f"exit code {process.returncode} instead of 2: {message}"]
    return problems + ([] if path.name in message else [f"the message does not name the file: {message}"])


def check_file(path, tally):
    ours, report = inspect(path)
    if path.name in REFUSED:
        tally.check(f"{path.name} refused", refusal_problems(path, ours, report))
        return
    if ours is None:
        tally.check(path.name, [f"was refused: {report.stderr.strip()}"])
        return
    for name, reader, differs, refuses in (
        ("nibabel", by_nibabel, NIBABEL_DIFFERS, {}),
        ("SimpleITK", by_itk, ITK_DIFFERS, ITK_REFUSES),
    ):
        theirs, reason = attempt(reader, path)
        if theirs is None:
            tally.check(f"{path.name} by {name}", [] if path.name in refuses else [f"{name} refuses: {reason}"])
        elif path.name in refuses:
            tally.check(f"{path.name} by {name}", [f"is read now; remove the entry ({refuses[path.name]})"])
        else:
            tally.check(f"{path.name} by {name}", compared(ours, theirs, differs.get(path.name, (set(), ""))))
            require_rejection(theirs)
    if path.name == "no_form.nii.gz":
        wrong = not np.allclose(ours.affine, NO_FORM_AFFINE, rtol=1e-6, atol=0.0)
        tally.check("no_form.nii.gz affine", [f"{ours.affine} is not pixdim alone"] if wrong else [])
    if path.name in WARNED:
        warned = any(WARNED[path.name].lower() in warning.lower() for warning in report["warnings"])
        tally.check(f"{path.name} warns", [] if warned else [f"no warning about {WARNED[path.name]!r}: {report['warnings']}"])


def main():
    folder = data_folder()
    if folder is None:
        return
    tally = Tally("awkward files")
    files = sorted(path for path in (folder / "awkward").iterdir() if path.suffix != ".img")
    files += sorted((folder / "ct").glob("*.nii.gz"))
    listed = {*REFUSED, *NIBABEL_DIFFERS, *ITK_DIFFERS, *ITK_REFUSES, *WARNED}
    missing = listed - {path.name for path in files}
    tally.check("every listed file is there", [f"{name} is missing" for name in sorted(missing)])
    for path in files:
        check_file(Path(path), tally)
    tally.finish()


if __name__ == "__main__":
    main()
