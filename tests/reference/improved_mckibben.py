"""Re-identifies the rubber modulus of the improved McKibben model on the virtual-area forces of both muscles.

The modulus enters linearly, so this is linear least squares and has one answer. The thesis' own cubics do not
reproduce the thesis' own forces; these do. The forces are reconstructed from the identified virtual-area model:
the measurements behind it were never published.
"""

from dataclasses import replace

import numpy as np

from muscles import IMPROVED_1000, IMPROVED_290, VIRTUAL_AREA_1000, VIRTUAL_AREA_290, mckibben, static_force

PRESSURES = np.arange(1.0, 4.51, 0.5) * 1e5
FORCE_RANGE = 90.0, 820.0
CONTRACTION_COUNT = 40


def reconstructed_points(muscle, contraction_end):
    grid = np.meshgrid(PRESSURES, np.linspace(0.0, contraction_end, CONTRACTION_COUNT), indexing="ij")
    pressure, x = (axis.ravel() for axis in grid)
    force = static_force(muscle, pressure, x)
    inside = (force > FORCE_RANGE[0]) & (force < FORCE_RANGE[1])
    return pressure[inside], x[inside], force[inside]


def identify(rest_length, pressure, x, force):
    """Modulus coefficients, highest power first, and the condition number of the column-scaled problem."""
    plain = mckibben(rest_length)
    design = plain.elastic_force_per_modulus(x)[:, None] * np.vander(1 - x / rest_length, 4)
    scale = np.linalg.norm(design, axis=0)  # powers of a ratio near one are nearly parallel: spare the solver the rest
    solution = np.linalg.lstsq(design / scale, force - pressure * plain.area(x), rcond=None)[0]
    return solution / scale, np.linalg.cond(design / scale)


def rms_error(muscle, pressure, x, force):
    return np.sqrt(np.mean((static_force(muscle, pressure, x) - force) ** 2))


def report(name, virtual_area, committed, contraction_end):
    points = reconstructed_points(virtual_area, contraction_end)
    coefficients, condition = identify(committed.rest_length, *points)
    fitted = mckibben(committed.rest_length, tuple(coefficients))
    rounded = replace(fitted, modulus_coefficients=tuple(float(f"{c:.4g}") for c in coefficients))
    ratios = np.linspace(0.75, 1.0, 6)

    print(f"{name}: rest length {committed.rest_length:.10g} m, {committed.turns:.10g} turns, "
          f"thread {committed.thread_length:.10g} m")
    print(f"  {CONTRACTION_COUNT} contractions 0 ... {contraction_end} m x {len(PRESSURES)} pressures, "
          f"{len(points[0])} points kept, condition number {condition:.3g}")
    print("  C3 ... C0 [Pa]   ", ", ".join(f"{c:.9e}" for c in coefficients))
    print("  modulus [MPa]    ", ", ".join(f"{np.polyval(coefficients, r) / 1e6:.3f} at {r:.2f}" for r in ratios))
    print(f"  rms [N]           improved {rms_error(fitted, *points):.3f}, to four digits "
          f"{rms_error(rounded, *points):.3f}, plain {rms_error(mckibben(committed.rest_length), *points):.3f}")
    drift = np.max(np.abs(coefficients / committed.modulus_coefficients - 1))
    print(f"  committed coefficients agree to {drift:.1e}")


def main():
    report("DMSP-40-1000", VIRTUAL_AREA_1000, IMPROVED_1000, contraction_end=0.24)
    report("DMSP-40-290", VIRTUAL_AREA_290, IMPROVED_290, contraction_end=0.071)


if __name__ == "__main__":
    main()
