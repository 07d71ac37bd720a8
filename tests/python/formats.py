"""NRRD and MetaImage files: `cutis` reads what SimpleITK and pynrrd write, and they read what it
writes."""

import tempfile
from pathlib import Path

import nrrd
import numpy as np
import SimpleITK

from _compare import Seen, Tally, by_itk, by_nibabel, differences, inspect, require_rejection, run_program

EXTENSIONS = (".nrrd", ".nhdr", ".mha", ".mhd")
# Signs from the coordinates of a space to RAS.
SPACES = {
    "left-posterior-superior": (-1, -1, 1),
    "right-anterior-superior": (1, 1, 1),
    "left-anterior-superior": (-1, 1, 1),
}


def by_pynrrd(path):
    """Reads a file with pynrrd and converts its space to RAS."""
    values, header = nrrd.read(str(path))
    affine = np.eye(4)
    affine[:3, :3] = header["space directions"].T
    affine[:3, 3] = header["space origin"]
    affine[:3] *= np.array(SPACES[header["space"]])[:, None]
    return Seen.of_values(values, affine, None)


def random_image(rng, dtype, oblique):
    """Voxels, and the affine of an LPS image."""
    low, high = (0, 256) if dtype == np.uint8 else (-1024, 3000)
    values = rng.integers(low, high, size=(6, 5, 4)).astype(dtype)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if oblique else np.eye(3)
    return values, turn, rng.uniform(0.4, 3.0, size=3), rng.uniform(-200.0, 200.0, size=3)


def write_itk(path, values, turn, spacing, origin, compressed):
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(values.T))
    image.SetDirection(turn.ravel().tolist())
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(origin.tolist())
    SimpleITK.WriteImage(image, str(path), useCompression=compressed)


def check_reading(label, path, reader, tally):
    """Compares `cutis inspect` and the voxels of `cutis convert` with another reader."""
    ours, report = inspect(path)
    if ours is None:
        tally.check(label, [f"was refused: {report.stderr}"])
        return
    theirs = reader(path)
    tally.check(label, differences(ours, theirs))
    require_rejection(theirs)
    out = path.parent / "voxels.nii"
    process = run_program("convert", path, "--out", out)
    if process.returncode != 0:
        tally.check(f"{label} voxels", [process.stderr])
        return
    seen = by_nibabel(out)
    same = seen.shape == theirs.shape and np.array_equal(seen.values, theirs.values)
    tally.check(f"{label} voxels", [] if same else ["voxels differ"])
    if np.array_equal(seen.values[::-1], theirs.values):
        raise AssertionError("negative control: a mirrored volume was not noticed")


def check_itk_files(folder, tally):
    rng = np.random.default_rng(3)
    for extension in EXTENSIONS:
        for dtype in (np.int16, np.uint8, np.float32, np.int32):
            for compressed in (False, True):
                path = folder / f"itk{extension}"
                write_itk(path, *random_image(rng, dtype, oblique=compressed), compressed)
                packed = "compressed" if compressed else "plain"
                check_reading(f"{extension} of ITK, {np.dtype(dtype)}, {packed}", path, by_itk, tally)


def check_nrrd_files(folder, tally):
    rng = np.random.default_rng(4)
    for extension in (".nrrd", ".nhdr"):
        for space in SPACES:
            for encoding, endian in (("raw", "little"), ("gzip", "big")):
                values, turn, spacing, origin = random_image(rng, np.int16, oblique=True)
                path = folder / f"nrrd{extension}"
                header = {
                    "space": space,
                    "space directions": (turn * spacing).T,
                    "space origin": origin,
                    "encoding": encoding,
                    "centerings": ["node"] * 3,
                }
                values = values.astype(">i2" if endian == "big" else "<i2")
                nrrd.write(str(path), values, header | {"endian": endian})
                check_reading(f"{extension} of pynrrd, {space}, {encoding}", path, by_pynrrd, tally)


def check_written_files(folder, tally):
    """The phantom in every format, read by the other programs."""
    source = folder / "phantom.nii"
    run_program("phantom", "--size", "24,20,16", "--turn-deg", "3", "-5", "20", "--out", source)
    original = by_nibabel(source)
    for extension in EXTENSIONS:
        path = folder / f"ours{extension}"
        process = run_program("convert", source, "--out", path)
        tally.check(f"{extension} written", [] if process.returncode == 0 else [process.stderr])
        readers = [("SimpleITK", by_itk)] + ([("pynrrd", by_pynrrd)] if extension in (".nrrd", ".nhdr") else [])
        for name, reader in readers:
            theirs = reader(path)
            tally.check(f"{extension} by {name}", differences(theirs, original, ignore=("dtype",)))
            same = np.array_equal(theirs.values, original.values)
            tally.check(f"{extension} voxels by {name}", [] if same else ["voxels differ"])
            require_rejection(theirs)


def main():
    tally = Tally("NRRD and MetaImage")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        check_itk_files(folder, tally)
        check_nrrd_files(folder, tally)
        check_written_files(folder, tally)
    tally.finish()


if __name__ == "__main__":
    main()
