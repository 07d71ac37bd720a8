"""CT series in DICOM files: `cutis convert` gives the voxels of pydicom, one by one, and the
positions of SimpleITK, or refuses the series."""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import (
    CTImageStorage,
    EnhancedCTImageStorage,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    RLELossless,
    generate_uid,
)
from scipy import ndimage

from _compare import Seen, Tally, by_nibabel, data_folder, differences, require_rejection, run_program

AIR_HU = -1024

# Folders that must be refused, and a part of the message.
REFUSED = {
    "bad_gantrytilting_001": "gantry tilt",
    "bad_notavolume_001": "same position",
    "bad_sliceincrement_001": "missing",
    "head_tilt_variable_spacing": "--resample",
    "transfer_syntaxes": "",
}

# Folders and files in JPEG 2000. A program without the feature `dicom-jpeg2000` refuses them.
JPEG_2000 = "abdomen_j2k"
JPEG_2000_FILES = ("4.90.dcm", "4.91.dcm")

# Files of `transfer_syntaxes` that were compressed with a loss.
LOSSY = ("4.50.dcm", "4.91.dcm")

# Files of `transfer_syntaxes` that must be refused, by the end of their transfer syntax.
REFUSED_SYNTAXES = ("4.80.dcm", "4.81.dcm", "4.51.dcm", "4.53.dcm", "4.55.dcm")


def convert(source, *options):
    """The volume that `cutis convert` writes, or None and the finished process."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.nii.gz"
        process = run_program("convert", source, "--out", out, *options)
        return (by_nibabel(out) if process.returncode == 0 else None), process


def by_pydicom(path):
    """The HU of one file, indexed [column, row]. Padding is air."""
    slice_ = pydicom.dcmread(path)
    stored = slice_.pixel_array.astype(np.float64)
    hu = stored * float(slice_.RescaleSlope) + float(slice_.RescaleIntercept)
    if "PixelPaddingValue" in slice_:
        hu[stored == slice_.PixelPaddingValue] = AIR_HU
    return slice_, hu.T


def by_gdcm(folder):
    """The series as the reader of ITK sees it."""
    reader = SimpleITK.ImageSeriesReader()
    names = reader.GetGDCMSeriesFileNames(str(folder))
    reader.SetFileNames(names)
    image = reader.Execute()
    values = SimpleITK.GetArrayFromImage(image).T
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    affine[:2] *= -1.0
    return Seen.of_values(values, affine, None)


def voxel_problems(ours, expected):
    if ours.shape != expected.shape:
        return [f"shape {ours.shape} is not {expected.shape}"]
    different = int((ours != expected).sum())
    return [f"{different} voxels differ"] if different else []


def require_voxel_rejection(expected):
    """Control: one voxel that differs by 1 HU, and rows in the place of columns."""
    changed = expected.copy()
    changed[tuple(size // 2 for size in changed.shape)] += 1
    flipped = expected[::-1]
    if not voxel_problems(changed, expected) or not voxel_problems(flipped, expected):
        raise AssertionError("negative control: a wrong voxel was not noticed")


def check_refused(folder, tally):
    listed = {path.name for path in folder.iterdir()}
    tally.check("every folder is listed", [f"{name} is not" for name in listed ^ {*REFUSED, JPEG_2000}])
    for name, word in REFUSED.items():
        ours, process = convert(folder / name)
        problems = [] if ours is None and process.returncode == 2 else [f"was not refused: {process.returncode}"]
        if word not in process.stderr:
            problems.append(f"the message lacks {word!r}: {process.stderr}")
        tally.check(f"{name} refused", problems)


def check_syntaxes(folder, tally):
    """Each file alone. The lossless ones hold the same voxels."""
    reference = None
    for path in sorted((folder / "transfer_syntaxes").iterdir()):
        with tempfile.TemporaryDirectory() as alone:
            shutil.copy(path, alone)
            ours, process = convert(alone)
        if path.name.endswith(REFUSED_SYNTAXES):
            named = path.name in process.stderr and process.returncode == 2
            tally.check(f"{path.name} refused", [] if named else [f"{process.returncode}: {process.stderr}"])
            continue
        if ours is None:
            expected = path.name.endswith(JPEG_2000_FILES) and lacks_jpeg_2000(process)
            tally.check(path.name, [] if expected else [f"was refused: {process.stderr}"])
            continue
        header, hu = by_pydicom(path)
        if path.name.endswith(LOSSY):
            # Two decoders of lossy JPEG may differ by one stored value (ISO 10918-2).
            worst = np.abs(ours.values[..., 0] - hu).max()
            close = worst <= float(header.RescaleSlope) + 0.5
            tally.check(f"{path.name}, lossy", [] if close else [f"{worst} HU apart"])
            continue
        tally.check(path.name, voxel_problems(ours.values[..., 0], np.round(hu)))
        reference = ours.values if reference is None else reference
        tally.check(f"{path.name} as the others", voxel_problems(ours.values, reference))
        require_voxel_rejection(ours.values[..., 0])


def lacks_jpeg_2000(process):
    """True if the program refuses JPEG 2000, and names the feature that it lacks."""
    return process.returncode == 2 and "build Cutis with the feature dicom-jpeg2000" in process.stderr


def check_jpeg_2000(folder, tally):
    """A series in JPEG 2000, or its refusal."""
    ours, process = convert(folder / JPEG_2000)
    if ours is None:
        refused = lacks_jpeg_2000(process)
        tally.check(f"{JPEG_2000} refused", [] if refused else [f"{process.returncode}: {process.stderr}"])
        return
    compare_with_gdcm(JPEG_2000, folder / JPEG_2000, tally)


def check_stack(folder, tally):
    """Three slices at equal distances: order and geometry as ITK reads them."""
    with tempfile.TemporaryDirectory() as part:
        for path in sorted((folder / "bad_sliceincrement_001").iterdir())[:3]:
            shutil.copy(path, part)
        compare_with_gdcm("three slices", Path(part), tally)


def compare_with_gdcm(label, folder, tally):
    ours, process = convert(folder)
    if ours is None:
        tally.check(label, [f"was refused: {process.stderr}"])
        return
    theirs = by_gdcm(folder)
    tally.check(f"{label} in place", differences(ours, theirs))
    tally.check(f"{label} voxels", voxel_problems(ours.values, theirs.values))
    require_rejection(theirs)


def check_tilted(folder, tally):
    """The resampled head: its first plane is the first slice, and its last plane is the last slice,
    shifted within its plane."""
    name = "head_tilt_variable_spacing"
    ours, process = convert(folder / name, "--resample")
    if ours is None:
        tally.check(name, [f"was refused: {process.stderr}"])
        return
    perpendicular = ours.affine[:3, :3].T @ ours.affine[:3, :3]
    shear = np.abs(perpendicular - np.diag(np.diag(perpendicular))).max()
    tally.check(f"{name} perpendicular", [] if shear < 1e-4 else [f"{perpendicular}"])
    files = sorted((folder / name).iterdir())
    for file, plane in ((files[0], 0), (files[-1], -1)):
        header, hu = by_pydicom(file)
        k = plane % ours.shape[2]
        found = ours.values[..., k]
        expected = sampled(header, hu, ours.affine, found.shape, k)
        inside = ~np.isnan(expected)
        worst = np.abs(found[inside] - expected[inside]).max()
        problems = [] if worst <= 0.51 and inside.sum() > 200_000 else [f"{worst} HU in {inside.sum()} voxels"]
        tally.check(f"{name} plane {plane}", problems)
        # Control: one row further the values differ.
        moved = sampled(header, np.roll(hu, 1, axis=1), ours.affine, found.shape, k)
        if np.nanmax(np.abs(found - moved)) < 100.0:
            raise AssertionError("negative control: a shift by one row was not noticed")


def sampled(header, hu, affine, shape, k):
    """A slice at the places of plane `k` of a grid, by SciPy. NaN outside the slice."""
    i, j = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij")
    index = np.stack([i.ravel(), j.ravel(), np.full(i.size, k), np.ones(i.size)])
    lps = (affine @ index)[:3] * np.array([[-1.0], [-1.0], [1.0]])
    offset = lps - np.array(header.ImagePositionPatient, dtype=float)[:, None]
    row, column = np.array(header.ImageOrientationPatient, dtype=float).reshape(2, 3)
    spacing = [float(value) for value in header.PixelSpacing]
    # NIfTI stores positions in single precision: a place next to a pixel is that pixel.
    at = np.stack([row @ offset / spacing[1], column @ offset / spacing[0]])
    at = np.where(np.abs(at - np.round(at)) < 2e-3, np.round(at), at)
    return ndimage.map_coordinates(hu, at, order=1, cval=np.nan).reshape(shape)


def write_series(folder, rng, *, signed, stored_bits, oblique, syntax):
    """A series by pydicom: random voxels, values in the low bits, an overlay in the high ones, a
    slope and an intercept for each slice, names in another order than the slices."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if oblique else np.eye(3)
    if np.linalg.det(turn) < 0:
        turn[:, 2] *= -1.0
    series, study, frame = (generate_uid() for _ in range(3))
    names = rng.permutation(5)
    low = -(2 ** (stored_bits - 1)) if signed else 0
    for n, name in enumerate(names):
        slice_ = Dataset()
        slice_.file_meta = FileMetaDataset()
        slice_.file_meta.TransferSyntaxUID = syntax
        slice_.file_meta.MediaStorageSOPClassUID = slice_.SOPClassUID = CTImageStorage
        slice_.file_meta.MediaStorageSOPInstanceUID = slice_.SOPInstanceUID = generate_uid()
        slice_.Modality, slice_.SeriesInstanceUID, slice_.SeriesNumber = "CT", series, 4
        slice_.StudyInstanceUID, slice_.FrameOfReferenceUID = study, frame
        slice_.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
        slice_.InstanceNumber = int(name)
        slice_.Rows, slice_.Columns = 7, 9
        slice_.PixelSpacing, slice_.SliceThickness = [0.75, 0.5], 2.0
        position = np.array([-12.0, 30.0, 4.0]) + 2.5 * n * turn[:, 2]
        slice_.ImagePositionPatient = [f"{value:.9f}" for value in position]
        slice_.ImageOrientationPatient = [f"{value:.11f}" for value in turn[:, :2].T.ravel()]
        slice_.SamplesPerPixel, slice_.PhotometricInterpretation = 1, "MONOCHROME2"
        slice_.BitsAllocated, slice_.BitsStored, slice_.HighBit = 16, stored_bits, stored_bits - 1
        slice_.PixelRepresentation = int(signed)
        slice_.RescaleSlope, slice_.RescaleIntercept = int(n % 2 + 1), -1000 - 10 * n
        values = rng.integers(low, low + 2**stored_bits, size=(7, 9)) & (2**stored_bits - 1)
        overlay = rng.integers(0, 2 ** (16 - stored_bits), size=(7, 9)) << stored_bits
        slice_.PixelData = (values | overlay).astype("<u2").tobytes()
        slice_.save_as(folder / f"{name}.dcm", enforce_file_format=True)


def expected_volume(folder):
    """The voxels and the affine of a folder of slices, by definition and without another reader."""
    slices = [pydicom.dcmread(path) for path in folder.iterdir()]
    row, column = np.array(slices[0].ImageOrientationPatient, dtype=float).reshape(2, 3)
    normal = np.cross(row, column)
    slices.sort(key=lambda s: np.array(s.ImagePositionPatient, dtype=float) @ normal)
    planes = []
    for s in slices:
        raw = np.frombuffer(s.PixelData, "<u2").reshape(s.Rows, s.Columns).astype(np.int64)
        value = raw & (2**s.BitsStored - 1)
        if s.PixelRepresentation:
            value -= (value >> (s.BitsStored - 1)) << s.BitsStored
        planes.append((value * int(s.RescaleSlope) + int(s.RescaleIntercept)).T)
    first, last = (np.array(s.ImagePositionPatient, dtype=float) for s in (slices[0], slices[-1]))
    affine = np.eye(4)
    affine[:3, 0] = row * float(slices[0].PixelSpacing[1])
    affine[:3, 1] = column * float(slices[0].PixelSpacing[0])
    affine[:3, 2] = (last - first) / (len(slices) - 1)
    affine[:3, 3] = first
    affine[:2] *= -1.0
    return Seen.of_values(np.stack(planes, axis=-1), affine, None)


def check_written(tally):
    """Series by pydicom. GDCM is asked for positions only: it applies one slope to all slices."""
    rng = np.random.default_rng(7)
    for number, (signed, bits, oblique) in enumerate(
        [(False, 12, False), (True, 12, True), (True, 14, False), (False, 11, True)]
    ):
        syntax = (ExplicitVRLittleEndian, ImplicitVRLittleEndian)[number % 2]
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_series(folder, rng, signed=signed, stored_bits=bits, oblique=oblique, syntax=syntax)
            ours, process = convert(folder)
            label = f"written, {bits} bits, {'signed' if signed else 'unsigned'}, {'oblique' if oblique else 'axial'}"
            if ours is None:
                tally.check(label, [f"was refused: {process.stderr}"])
                continue
            expected = expected_volume(folder)
            tally.check(f"{label} in place", differences(ours, expected))
            tally.check(f"{label} voxels", voxel_problems(ours.values, expected.values))
            values = ("hu_min", "hu_max", "hu_sum")
            tally.check(f"{label} by ITK", differences(ours, by_gdcm(folder), ignore=values))
            require_rejection(expected)
            require_voxel_rejection(expected.values)


def group(**values):
    """A functional group: a sequence with one item."""
    item = Dataset()
    for keyword, value in values.items():
        setattr(item, keyword, value)
    return Sequence([item])


def write_enhanced(path, rng, syntax, *, turn, frames):
    """An enhanced CT by pydicom: random voxels, each frame with its own position, orientation and
    scaling, in an order that is not that of the positions."""
    file = Dataset()
    file.file_meta = FileMetaDataset()
    file.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    file.file_meta.MediaStorageSOPClassUID = file.SOPClassUID = EnhancedCTImageStorage
    file.file_meta.MediaStorageSOPInstanceUID = file.SOPInstanceUID = generate_uid()
    file.Modality, file.SeriesInstanceUID, file.SeriesNumber = "CT", generate_uid(), 5
    file.StudyInstanceUID, file.FrameOfReferenceUID = generate_uid(), generate_uid()
    file.ImageType = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    file.Rows, file.Columns, file.NumberOfFrames = 7, 9, frames
    file.SamplesPerPixel, file.PhotometricInterpretation = 1, "MONOCHROME2"
    file.BitsAllocated, file.BitsStored, file.HighBit, file.PixelRepresentation = 16, 12, 11, 0
    shared = Dataset()
    shared.PixelMeasuresSequence = group(PixelSpacing=[0.75, 0.5], SliceThickness=2.0)
    file.SharedFunctionalGroupsSequence = Sequence([shared])
    file.PerFrameFunctionalGroupsSequence = Sequence()
    for n in rng.permutation(frames):
        own = Dataset()
        position = np.array([-12.0, 30.0, 4.0]) + 2.5 * n * turn[:, 2]
        own.PlanePositionSequence = group(ImagePositionPatient=[f"{value:.9f}" for value in position])
        orientation = [f"{value:.11f}" for value in turn[:, :2].T.ravel()]
        own.PlaneOrientationSequence = group(ImageOrientationPatient=orientation)
        own.PixelValueTransformationSequence = group(
            RescaleSlope=int(n % 2 + 1), RescaleIntercept=-1000 - 10 * int(n), RescaleType="HU"
        )
        file.PerFrameFunctionalGroupsSequence.append(own)
    file.PixelData = rng.integers(0, 4096, size=(frames, 7, 9)).astype("<u2").tobytes()
    if syntax != ExplicitVRLittleEndian:
        file.compress(syntax)
    file.save_as(path, enforce_file_format=True)


def expected_frames(path):
    """The voxels and the affine of an enhanced CT, by its functional groups."""
    file = pydicom.dcmread(path)
    frames = []
    for own, stored in zip(file.PerFrameFunctionalGroupsSequence, file.pixel_array, strict=True):
        scaling = own.PixelValueTransformationSequence[0]
        hu = stored.astype(np.int64) * int(scaling.RescaleSlope) + int(scaling.RescaleIntercept)
        position = np.array(own.PlanePositionSequence[0].ImagePositionPatient, dtype=float)
        frames.append((position, hu.T))
    own = file.PerFrameFunctionalGroupsSequence[0].PlaneOrientationSequence[0]
    row, column = np.array(own.ImageOrientationPatient, dtype=float).reshape(2, 3)
    frames.sort(key=lambda frame: frame[0] @ np.cross(row, column))
    spacing = file.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].PixelSpacing
    affine = np.eye(4)
    affine[:3, 0], affine[:3, 1] = row * float(spacing[1]), column * float(spacing[0])
    affine[:3, 2] = (frames[-1][0] - frames[0][0]) / (len(frames) - 1)
    affine[:3, 3] = frames[0][0]
    affine[:2] *= -1.0
    return Seen.of_values(np.stack([hu for _, hu in frames], axis=-1), affine, None)


def check_enhanced(tally):
    """Enhanced CT by pydicom, stored plainly and in run length encoding."""
    rng = np.random.default_rng(11)
    for syntax in (ExplicitVRLittleEndian, RLELossless):
        for oblique in (False, True):
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if oblique else np.eye(3)
            turn[:, 2] *= np.sign(np.linalg.det(turn))
            with tempfile.TemporaryDirectory() as name:
                path = Path(name) / "scan.dcm"
                # More frames than are decoded at a time.
                write_enhanced(path, rng, syntax, turn=turn, frames=21)
                ours, process = convert(path.parent)
                label = f"enhanced, {syntax.name}, {'oblique' if oblique else 'axial'}"
                if ours is None:
                    tally.check(label, [f"was refused: {process.stderr}"])
                    continue
                expected = expected_frames(path)
                tally.check(f"{label} in place", differences(ours, expected))
                tally.check(f"{label} voxels", voxel_problems(ours.values, expected.values))
                require_rejection(expected)
                require_voxel_rejection(expected.values)


def main():
    tally = Tally("DICOM series")
    check_written(tally)
    check_enhanced(tally)
    folder = data_folder()
    if folder is not None:
        check_refused(folder / "dicom", tally)
        check_syntaxes(folder / "dicom", tally)
        check_jpeg_2000(folder / "dicom", tally)
        check_stack(folder / "dicom", tally)
        check_tilted(folder / "dicom", tally)
    tally.finish()


if __name__ == "__main__":
    main()
