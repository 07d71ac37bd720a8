"""From a DICOM series of full size to `report.html`: time and largest memory.

It makes a series of 512 x 512 x 209 voxels from the phantom, and runs the four commands of the
tutorial `From DICOM` with the program `cutis`, as a new user does. It fails if one of them takes
more than 3 GB, or if the wound stays closed. `--volume FILE` makes the series from a NIfTI file.

    pip install nibabel numpy pydicom
    cargo build --release --bin cutis
    python3 studies/python/large_series.py --cutis target/release/cutis
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import nibabel
import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

SIZE = (512, 512, 209)
MOST_GB = 3.0


def write_series(volume, folder):
    """Axial slices of 16 bits with HU = stored - 1024, in LPS."""
    image = nibabel.load(volume)
    affine = nibabel.as_closest_canonical(image).affine
    voxels = nibabel.as_closest_canonical(image).dataobj
    spacing = np.abs(np.diag(affine)[:3])
    if not np.allclose(affine[:3, :3], np.diag(spacing)):
        raise SystemExit(f"{volume}: the axes are not those of the body")
    series, study, frame = (generate_uid() for _ in range(3))
    for k in range(voxels.shape[2]):
        hu = np.asarray(voxels[..., k])
        slice_ = Dataset()
        slice_.file_meta = FileMetaDataset()
        slice_.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        slice_.file_meta.MediaStorageSOPClassUID = slice_.SOPClassUID = CTImageStorage
        slice_.file_meta.MediaStorageSOPInstanceUID = slice_.SOPInstanceUID = generate_uid()
        slice_.Modality, slice_.SeriesInstanceUID, slice_.SeriesNumber = "CT", series, 1
        slice_.StudyInstanceUID, slice_.FrameOfReferenceUID = study, frame
        slice_.ImageType, slice_.InstanceNumber = ["ORIGINAL", "PRIMARY", "AXIAL"], k + 1
        slice_.Rows, slice_.Columns = hu.shape[1], hu.shape[0]
        slice_.PixelSpacing = [f"{spacing[1]:.8f}", f"{spacing[0]:.8f}"]
        slice_.SliceThickness = f"{spacing[2]:.8f}"
        # Rows run to the left, and columns to the back.
        corner = affine @ [hu.shape[0] - 1, hu.shape[1] - 1, k, 1]
        slice_.ImagePositionPatient = [f"{value:.6f}" for value in (-corner[0], -corner[1], corner[2])]
        slice_.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        slice_.SamplesPerPixel, slice_.PhotometricInterpretation = 1, "MONOCHROME2"
        slice_.BitsAllocated, slice_.BitsStored, slice_.HighBit = 16, 16, 15
        slice_.PixelRepresentation, slice_.RescaleSlope, slice_.RescaleIntercept = 0, 1, -1024
        stored = np.clip(np.round(hu) + 1024, 0, 65535).astype("<u2")
        slice_.PixelData = np.ascontiguousarray(stored[::-1, ::-1].T).tobytes()
        slice_.save_as(folder / f"{k:04}.dcm", enforce_file_format=True)


def run(program, *words, cwd):
    """Runs a command. Returns its output, its time in s and its largest memory in GB."""
    start = time.monotonic()
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as messages:
        process = subprocess.Popen([program, *words], cwd=cwd, stdout=output, stderr=messages)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        output.seek(0)
        messages.seek(0)
        if process.returncode != 0:
            raise SystemExit(f"cutis {' '.join(words)} failed:\n{messages.read().decode()}")
        unit = 1 if sys.platform == "darwin" else 1024
        return output.read(), seconds, usage.ru_maxrss * unit / 1e9


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cutis", default="cutis", help="the program")
    parser.add_argument("--volume", help="a NIfTI file in place of the phantom")
    parser.add_argument("--most-gb", type=float, default=MOST_GB, help="fail above this memory")
    parser.add_argument("--keep", help="folder for the files; else they are removed")
    options = parser.parse_args()
    program = str(Path(options.cutis).resolve()) if os.sep in options.cutis else options.cutis
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(options.keep or temporary)
        (folder / "series").mkdir(parents=True, exist_ok=True)
        volume = options.volume
        if volume is None:
            volume = folder / "phantom.nii"
            run(program, "phantom", "--size", ",".join(map(str, SIZE)), "--out", str(volume), cwd=folder)
        write_series(volume, folder / "series")
        worst = 0.0
        for words in (
            ("inspect", "series"),
            ("scene", "new", "series"),
            ("check", "scene.toml"),
            ("settle", "scene.toml"),
        ):
            output, seconds, gigabytes = run(program, *words, cwd=folder)
            if words[0] == "scene":
                (folder / "scene.toml").write_bytes(output)
            worst = max(worst, gigabytes)
            print(f"| `cutis {' '.join(words)}` | {seconds:.1f} | {gigabytes:.2f} |", flush=True)
        report = json.loads((folder / "scene-run/report.json").read_text())
        opening = report["wound"]["final_mm"]
        size = (folder / "scene-run/report.html").stat().st_size
        print(f"report.html: {size / 1e6:.1f} MB; the wound is open by {opening:.1f} mm")
        print(f"largest memory: {worst:.2f} GB of at most {options.most_gb} GB")
        if worst > options.most_gb or opening <= 0.0:
            raise SystemExit(f"more than {options.most_gb} GB, or a closed wound")


if __name__ == "__main__":
    main()
