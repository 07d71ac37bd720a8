"""Options that all programs share, and the turns in which `cargo xtask study peers` lets them run.

A program prints one JSON object per line: first its name, version and sizes, then the result of
each turn. With `--wait` it reads a line before each turn, so that the study can let another program
run in between.
"""

import argparse
import json
import math
import sys
import time

from _beam import Beam


def parser(description):
    """The options that all programs share."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--size", type=int, nargs=3, default=[25, 9, 9], help="vertices along x, y and z")
    parser.add_argument("--spacing", type=float, default=0.1, help="m")
    parser.add_argument("--shuffled", action="store_true", help="scramble vertices and constraints")
    parser.add_argument("--kinds", choices=["both", "edges", "tets"], default="both", help="constraints")
    parser.add_argument("--stiffness", type=float, default=1.0, help="of a projection, 0 to 1")
    parser.add_argument("--youngs", type=float, default=1e6, help="modulus of the springs, Pa")
    parser.add_argument("--bulk", type=float, default=1e6, help="modulus of the tetrahedra, Pa")
    parser.add_argument("--density", type=float, default=1000.0, help="kg/m³")
    parser.add_argument("--gravity", type=float, default=9.81, help="downwards, m/s²")
    parser.add_argument("--dt", type=float, default=0.005, help="time of a frame, s")
    parser.add_argument("--iterations", type=int, default=5, help="iterations of a frame")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--frames", type=int, default=10, help="frames of a turn")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--wait", action="store_true", help="read a line before each turn")
    return parser


def beam_of(options):
    """The beam of the options."""
    beam = Beam(options.size, options.spacing)
    return beam.shuffled() if options.shuffled else beam


def take_turns(options, beam, about, frame, positions):
    """Runs the turns: calls `frame()` for one frame and `positions()` for the vertices in m.

    One frame before the first turn compiles code and fills caches. It is not timed, but it belongs
    to the motion.
    """
    frame()
    sizes = {"vertices": len(beam.x), "edges": len(beam.edges), "tets": len(beam.tets)}
    print(json.dumps({"iterations": options.iterations, **about, **sizes}), flush=True)
    done = 1
    for _ in range(options.turns):
        if options.wait and not sys.stdin.readline():
            return
        times = []
        for _ in range(options.frames):
            start = time.perf_counter()
            frame()
            times.append(time.perf_counter() - start)
        done += options.frames
        sag = beam.sag(positions())
        if not math.isfinite(sag):
            sys.exit(f"the beam is no longer finite after {done} frames")
        print(json.dumps({"frames": done, "ms": 1e3 * min(times), "sag_m": sag}), flush=True)
