"""Measures the largest communication step at which the closed loop is stable, and what it costs in accuracy.

    python largest_step.py --sinew target/release/sinew --parameters dmsp-40-1000

Needs sinew, fmpy and numpy (pip). ClosedLoop.ssp moves 20, 40 and 80 kg along its reference with growing
steps; the worst load counts. A step is stable if the error after the motion decays. The master exchanges all values at
once (Jacobi), as FMPy, libcosim and ecos do, or in the order of the signals, where the controller's command is of this
moment and not of the last step. Inputs are held during a step (derivatives off), or go on with the derivative that the
output had at its beginning (on; fmi2SetRealInputDerivatives).
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy_closed_loop import exchange, exchange_in_order, simulate

MASSES = (20.0, 40.0, 80.0)  # kg
STEPS = (1e-3, 2e-3, 3e-3, 5e-3, 7e-3, 10e-3, 15e-3, 20e-3, 25e-3, 30e-3, 40e-3, 50e-3, 70e-3, 100e-3)  # s
SHOWN = (1e-3, 5e-3, 10e-3, 20e-3)  # s
AFTERWARDS = 4.0  # s after the motion, in which an error has to decay
AT_REST = 1e-6  # m; a smaller error is none
NAMES = ("reference.setpoint", "reference.setpoint_velocity", "muscle.measured.contraction")
MASTERS = [(name, how, derivatives) for name, how in (("at once", exchange), ("in order", exchange_in_order))
           for derivatives in (False, True)]


def export(sinew, parameters, target, mass, folder):
    """The closed loop with a load, and with a target that is not that of the preset, if one is given; its path."""
    source = folder / f"{mass:g}kg.toml"
    motion = "" if target is None else f"[reference]\ntarget = {target}\n"
    source.write_text(f'preset = "{parameters}"\n[load]\nmass = {mass}\n{motion}')
    out = folder / f"{mass:g}kg"
    subprocess.run([sinew, "export", "--parameters", source, "--out", out], check=True, stdout=subprocess.DEVNULL)
    return out / "ClosedLoop.ssp"


def end_of_motion(ssp):
    """Time in s at which the reference stands still."""
    course = simulate(ssp, 0.02, 20.0, NAMES)
    return course["time"][np.flatnonzero(course["reference.setpoint_velocity"])[-1]]


def largest_error(ssp, step_size, motion, how, derivatives):
    """Largest control error in m; infinite where the loop is not stable."""
    try:
        course = simulate(ssp, step_size, motion + 2.0 * AFTERWARDS, NAMES, derivatives, how)
    except FMICallException:  # the load has left the range of the muscle
        return np.inf
    error = np.abs(course["reference.setpoint"] - course["muscle.measured.contraction"])
    times = course["time"]
    at_first, at_last = (error[(times > start) & (times <= start + 0.5 * AFTERWARDS)].max()
                         for start in (motion, motion + 1.5 * AFTERWARDS))
    return error.max() if at_last < max(0.5 * at_first, AT_REST) else np.inf


def measure(systems, motion, how, derivatives):
    """Largest error in m by step, the worst of all systems, up to the first step that is not stable."""
    errors = {}
    for step_size in STEPS:
        errors[step_size] = max(largest_error(ssp, step_size, motion, how, derivatives) for ssp in systems)
        if errors[step_size] == np.inf:
            break
    return errors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sinew", default="sinew", help="the command")
    parser.add_argument("--parameters", default="dmsp-40-1000", help="preset")
    parser.add_argument("--target", type=float, help="contraction at the end in m [default: that of the preset]")
    arguments = parser.parse_args()
    print("| values are exchanged | input derivatives | largest stable step | "
          + " | ".join(f"error at {1e3 * step:g} ms" for step in SHOWN) + " |")
    print("|---|---|---|" + "---|" * len(SHOWN))
    with tempfile.TemporaryDirectory() as folder:
        systems = [export(arguments.sinew, arguments.parameters, arguments.target, mass, Path(folder))
                   for mass in MASSES]
        motion = end_of_motion(systems[0])
        for name, how, derivatives in MASTERS:
            errors = measure(systems, motion, how, derivatives)
            stable = [step for step, error in errors.items() if error < np.inf]
            largest = f"{1e3 * max(stable):g} ms{' or more' if len(stable) == len(STEPS) else ''}" if stable else "none"
            shown = (f"{1e3 * errors[step]:.2f} mm" if step in stable else "unstable" for step in SHOWN)
            print(f"| {name} | {'on' if derivatives else 'off'} | {largest} | {' | '.join(shown)} |", flush=True)


if __name__ == "__main__":
    main()
