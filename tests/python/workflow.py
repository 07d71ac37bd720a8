"""`workflows/Snakefile` gives the table of `cutis sweep`, and repeats only what changed."""

import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from _compare import CHECKOUT, PROGRAM, Tally

# Columns that depend on the machine.
MEASURED = {"frame_ms", "seconds", "peak_mb"}
SCENE = CHECKOUT / "fixtures/scenes/phantom-small.toml"
STUDY = """\
scene = {scene!r}
set = ["output={{ report = true }}", "run.frames=2", "lattice.spacing_mm=14"]
[[scan]]
name = "p1"
set = ["volume.phantom.seed=1"]
[[scan]]
name = "p2"
set = ["volume.phantom.seed=2"]
[[axis]]
key = "constraints.stc.area_modulus_n_per_m"
values = {values}
[[case]]
name = "no-tension"
without = ["stc"]
"""


def run(work, *words):
    """Runs a program in the folder `work` and returns the finished process."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(work / "cache"), "HOME": str(work)}
    process = subprocess.run(
        list(map(str, words)), cwd=work, env=environment, capture_output=True, text=True, timeout=600
    )
    if process.returncode != 0:
        raise SystemExit(f"FAILED {' '.join(map(str, words))}:\n{process.stdout}{process.stderr}")
    return process


def snakemake(work, *options):
    call = [sys.executable, "-m", "snakemake", "--snakefile", CHECKOUT / "workflows/Snakefile", "--cores", "2"]
    config = ["--config", "study=study.toml", "out=cluster", f"cutis={PROGRAM}", "threads=1"]
    return run(work, *call, *options, *config)


def write_study(work, values):
    (work / "study.toml").write_text(STUDY.format(scene=str(SCENE), values=values))


def results(folder):
    """The table by case, without the columns that depend on the machine."""
    with open(folder / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return {row["case"]: {key: value for key, value in row.items() if key not in MEASURED} for row in rows}


def runs(folder):
    """How often each case ran."""
    return {path.stem: len(path.read_text().splitlines()) for path in (folder / "journal").glob("*.jsonl")}


def differences(a, b):
    names = sorted(a.keys() | b.keys())
    return [f"{name}: {a.get(name)} and {b.get(name)}" for name in names if a.get(name) != b.get(name)]


def main():
    tally = Tally("workflow")
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        cluster = work / "cluster"
        write_study(work, [50.0, 100.0])
        run(work, PROGRAM, "sweep", "study.toml", "--out", "local", "--jobs", "2")
        snakemake(work)
        local, first = results(work / "local"), results(cluster)
        tally.check("six cases are done", [] if [row["state"] for row in first.values()] == ["done"] * 6 else [str(first)])
        tally.check("the table of a sweep", differences(local, first))
        tally.check("plots", [] if "<svg" in (cluster / "plots.html").read_text() else ["there are none"])
        tally.check("each case ran once", [] if set(runs(cluster).values()) == {1} else [str(runs(cluster))])

        snakemake(work)
        tally.check("nothing runs again", [] if set(runs(cluster).values()) == {1} else [str(runs(cluster))])

        # Control: a changed value changes the table, and only its cases run.
        write_study(work, [50.0, 200.0])
        snakemake(work)
        changed, again = results(cluster), runs(cluster)
        new = {f"{scan}+area_modulus_n_per_m=200" for scan in ("p1", "p2")}
        tally.check("a changed value has its cases", [] if changed.keys() - first.keys() == new else [str(changed.keys())])
        tally.check("only they run", [] if set(again.values()) == {1} and new <= again.keys() else [str(again)])
        openings = {row["wound0_final_mm"] for row in changed.values()}
        tally.check("each case has its own opening", [] if len(openings) == 6 else [str(openings)])
        tally.check("the comparison notices it", [] if differences(local, changed) else ["no difference"])

        # The sweep goes on with what the workflow has done.
        run(work, PROGRAM, "sweep", "study.toml", "--out", "cluster")
        tally.check("a sweep goes on", [] if runs(cluster) == again else [str(runs(cluster))])
    tally.finish()


if __name__ == "__main__":
    main()
