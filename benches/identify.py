"""Times `sinew identify` and `sinew compare` beside the same fits with scipy.

    target/venv/bin/python benches/identify.py      # after cargo build --release; needs numpy and scipy

identify: one model on 60 s at 1 kHz. compare: all models on 10 000 static points. scipy fits the same parameters with
`least_squares` and its soft loss, derivatives by differences, on all samples; times are wall clock, the best of three.
The comparison also cross-validates and writes the report, which scipy does not.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

SINEW = Path(__file__).parents[1] / "target" / "release" / "sinew"
AREA, ELASTIC, DAMPING = [-0.0266, 0.0091], [-1.0067e5, 5.2111e4, -8808.9, -113.29], 80.0
SCALE = np.array([1, 1, 0.1, 0.01, 1e5, 1e5, 1e4, 100, 100])  # area and elastic force, powers 3 to 0, and damping; SI


MOST = 2.0  # s


def force(p, x, v):
    return p * np.polyval(AREA, x) + np.polyval(ELASTIC, x) - DAMPING * v


def write(path, t, x, p, f):
    header = "time [s],contraction [m],gauge_pressure [Pa],force [N]"
    np.savetxt(path, np.c_[t, x, p, f], delimiter=",", fmt="%.9g", header=header, comments="")


def best(of):
    times = []
    for _ in range(3):
        start = time.perf_counter()
        of()
        times.append(time.perf_counter() - start)
    return min(times)


def scipy_virtual_area(p, x, v, f):
    """The same model with the same number of parameters, from a start that knows nothing."""
    def residuals(q):
        c = q * SCALE
        return p * np.polyval(c[:4], x) + np.polyval(c[4:8], x) - c[8] * v - f

    start = np.zeros(9)
    return least_squares(residuals, start, loss="soft_l1", f_scale=6.0, max_nfev=200)


def told(what, ours, theirs):
    print(f"{what}: {ours:.2f} s; scipy's fit of virtual-area alone {theirs:.2f} s; ratio {ours / theirs:.2f}")


def main():
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        t = np.arange(0, 60, 1e-3)
        p = 2.5e5 + 1.5e5 * np.sin(0.4 * t) + 0.5e5 * np.sin(1.9 * t)
        x, v = 0.11 + 0.06 * np.sin(0.31 * t + 1), 0.06 * 0.31 * np.cos(0.31 * t + 1)
        f = force(p, x, v) + rng.normal(0, 3, t.size)
        write(folder / "motion.csv", t, x, p, f)
        pressure, contraction = (g.ravel() for g in np.meshgrid(np.linspace(5e4, 5e5, 100), np.linspace(0, 0.22, 100)))
        static = force(pressure, contraction, 0) + rng.normal(0, 5, pressure.size)
        write(folder / "map.csv", np.arange(static.size), contraction, pressure, static)

        def sinew(*arguments):
            subprocess.run([SINEW, *arguments, "--out", folder / "out"], capture_output=True, check=True)

        ours = best(lambda: sinew("identify", folder / "motion.csv", "--model", "virtual-area"))
        theirs = best(lambda: scipy_virtual_area(p, x, v, f))
        told("identify, virtual-area, 60 s at 1 kHz", ours, theirs)
        slow = ours >= MOST
        ours = best(lambda: sinew("compare", folder / "map.csv"))
        theirs = best(lambda: scipy_virtual_area(pressure, contraction, 0, static))
        told("compare, all models, 10 000 points", ours, theirs)
        return int(slow or ours >= MOST)


if __name__ == "__main__":
    sys.exit(main())
