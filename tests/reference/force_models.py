"""Every force model of the thesis in an implementation of its own, and the coefficients that the thesis does not print.

Where a model follows from a volume or an energy, only these are written down here, and differentiated by a complex
step: F = -p dV/dL + dE/dL. The product has the derivatives worked out by hand.

    python force_models.py             writes force_models.csv
    python force_models.py --identify  fits again, on the forces of the virtual-area model (the measurements behind it
                                       were never published), and compares with the coefficients that are committed
"""

import argparse
import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from improved_mckibben import reconstructed_points
from muscles import IMPROVED_1000, IMPROVED_290, LONG_REST_LENGTH, VIRTUAL_AREA_1000, VIRTUAL_AREA_290, mckibben
from muscles import static_force as affine_force

PI = np.pi
TINY = 1e-30
PRESSURES = np.array([0.0, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.5, 2.5, 4.0, 6.0]) * 1e5
STRAINS = np.array([-0.02, 0.0, 0.01, 0.05, 0.1, 0.15, 0.2, 0.25])
VELOCITIES = np.array([0.0, -4e-4, 2e-3])


def slope(function, at):
    """Derivative by a complex step, exact to rounding."""
    return np.imag(function(at + 1j * TINY)) / TINY


@dataclass(frozen=True)
class Model:
    """Braid: rest length, and length and turns of the thread."""

    rest_length: float

    @property
    def thread(self):
        return mckibben(self.rest_length).thread_length

    @property
    def turns(self):
        return mckibben(self.rest_length).turns

    def diameter(self, length):
        return np.sqrt(self.thread**2 - length**2) / (PI * self.turns)

    @property
    def rest_diameter(self):
        return self.diameter(self.rest_length)

    @property
    def section(self):
        return PI * self.rest_diameter**2 / 4

    def volume(self, length):
        return PI / 4 * self.diameter(length) ** 2 * length

    def energy(self, length):
        return 0.0 * length

    def static_force(self, p, x):
        length = self.rest_length - x
        return -p * slope(self.volume, length) + slope(self.energy, length)

    def force(self, p, x, v):
        return self.static_force(p, x)


@dataclass(frozen=True)
class McKibben(Model):
    pass


@dataclass(frozen=True)
class Affine(Model):
    """A model that muscles.py has."""

    muscle: object = None

    def static_force(self, p, x):
        return affine_force(self.muscle, p, x)


@dataclass(frozen=True)
class VirtualArea(Affine):
    pass


@dataclass(frozen=True)
class ImprovedMcKibben(Affine):
    pass


@dataclass(frozen=True)
class TonduLopez(Model):
    alpha: float = 8.3095
    beta: float = 3.7698

    def k(self, p):
        return 1.0

    def q(self, p):
        return 1.0

    def static_force(self, p, x):
        cosine = np.maximum(1 - self.k(p) * x / self.rest_length, 0)  # by the one at rest: threads never turn back
        return self.section * self.q(p) * p * (self.alpha * cosine**2 - self.beta)


@dataclass(frozen=True)
class TonduLopezK(TonduLopez):
    k_0: float = 1.0
    k_per_pressure: float = 0.0

    def k(self, p):
        return self.k_0 + self.k_per_pressure * p


@dataclass(frozen=True)
class TonduLopezFriction(TonduLopezK):
    friction: float = 1e-3
    smoothing_velocity: float = 1e-3

    def force(self, p, x, v):
        # Rhombi in which the threads touch, by those at rest: as sin 2 theta_0 / sin 2 theta.
        rest_angle = np.arccos(self.rest_length / self.thread)
        angle = np.arccos((1 - self.k(p) * x / self.rest_length) * np.cos(rest_angle))
        contact = PI * self.rest_diameter * self.rest_length * np.sin(2 * rest_angle) / np.sin(2 * angle)
        return self.static_force(p, x) - self.friction * contact * p * np.tanh(v / self.smoothing_velocity)


@dataclass(frozen=True)
class TonduLopezKq(TonduLopez):
    low_k: float = 12.3268
    low_q: float = 1.2838
    high_k: float = 3.3077
    high_q: float = 1.3320

    def k(self, p):
        return 1 / np.interp(p, [0.5e5, 1e5], [1 / self.low_k, 1 / self.high_k])

    def q(self, p):
        return np.interp(p, [0.5e5, 1e5], [self.low_q, self.high_q])


@dataclass(frozen=True)
class FrustumEnds(Model):
    end_length: float = 0.04
    end_diameter: float = 0.04

    def parts(self, middle):
        """Length and volume of the muscle whose middle has this length."""
        height = lambda diameter: np.sqrt(self.end_length**2 - (diameter - self.end_diameter) ** 2 / 4)
        share = 1 - 2 * height(self.rest_diameter) / self.rest_length
        diameter = np.sqrt((share * self.thread) ** 2 - middle**2) / (PI * share * self.turns)
        cone = PI / 12 * height(diameter) * (diameter**2 + diameter * self.end_diameter + self.end_diameter**2)
        return middle + 2 * height(diameter), PI / 4 * diameter**2 * middle + 2 * cone

    def volume(self, length):
        """The middle by bisection; then a complex Newton step carries the imaginary part."""
        low, high = np.zeros_like(length.real), length.real
        for _ in range(200):
            half = (low + high) / 2
            short = self.parts(half)[0] < length.real
            low, high = np.where(short, half, low), np.where(short, high, half)
        middle = low + 0j
        middle = middle - (self.parts(middle)[0] - length) / slope(lambda m: self.parts(m)[0], middle)
        return self.parts(middle)[1]


@dataclass(frozen=True)
class RoundedEnds(Model):
    end_diameter: float = 0.04

    def volume(self, length):
        angle = np.arccos(length / self.thread)
        beyond = (self.diameter(length) - self.end_diameter) / 2
        sphere = beyond / (2 * np.sin(angle) ** 2)
        ends = 2 * PI * beyond**3 / np.tan(angle)
        caps = 2 * PI / 3 * (3 * sphere - beyond) * beyond**2
        return super().volume(length) - (ends - caps)


@dataclass(frozen=True)
class VariableDiameter(Model):
    end_diameter: float = 0.04

    def volume(self, length):
        """Simpson's rule, exact for the square of a parabola up to the fourth degree with five points (Boole)."""
        middle = self.diameter(length)
        radius = lambda z: (middle - (middle - self.end_diameter) * z**2) / 2
        weights = np.array([7, 32, 12, 32, 7]) / 90
        return PI * length * sum(w * radius(z) ** 2 for w, z in zip(weights, (-1, -0.5, 0, 0.5, 1)))


@dataclass(frozen=True)
class MooneyRivlin(Model):
    c10: float = 1e5
    c01: float = 1e5
    membrane_thickness: float = 1e-3

    def energy(self, length):
        along, around = length / self.rest_length, self.diameter(length) / self.rest_diameter
        through = 1 / (along * around)
        first = along**2 + around**2 + through**2
        second = along**-2 + around**-2 + through**-2
        bladder = PI * self.rest_diameter * self.rest_length * self.membrane_thickness
        return bladder * (self.c10 * (first - 3) + self.c01 * (second - 3))


@dataclass(frozen=True)
class Spring(Model):
    low_c: tuple = ()
    high_c: tuple = ()
    low_u: tuple = (0.0, 0.0, 0.0)
    high_u: tuple = (0.0, 0.0, 0.0)

    def one(self, c, u, p, x):
        stretch = np.polyval(u[::-1], p) - x
        return (c[0] + c[1] * stretch**2 + c[2] * p * stretch + c[3] * p**2) * stretch

    def static_force(self, p, x):
        t = np.clip((p - 0.8e5) / 0.4e5, 0, 1)
        weight = 3 * t**2 - 2 * t**3
        return (1 - weight) * self.one(self.low_c, self.low_u, p, x) + weight * self.one(self.high_c, self.high_u, p, x)


@dataclass(frozen=True)
class ThreeElement(Model):
    contraction_force: float = 0.0
    contraction_area: float = 0.0
    stiffness: float = 0.0
    stiffness_per_pressure: float = 0.0
    inflation_damping: float = 80.0
    deflation_damping: float = 80.0

    def static_force(self, p, x):
        contraction = self.contraction_force + self.contraction_area * p
        return contraction - (self.stiffness + self.stiffness_per_pressure * p) * x

    def force(self, p, x, v):
        return self.static_force(p, x) - np.where(v > 0, self.inflation_damping, self.deflation_damping) * v


# Tables 4.1 and 4.2, C0 to C3; C1 goes with the square of the stretch.
SPRING_1000 = {"low_c": (2.3983e4, 8.0126e5, -0.9883, -1.4085e-6), "high_c": (5.2159e3, -5.2663e4, 0.0138, 4.0050e-8)}
SPRING_290 = {"low_c": (8.5370e4, 1.2782e8, -32.6762, -5.1038e-6), "high_c": (1.0784e4, -5.8944e5, 1.4412, 1.0624e-7)}


def muscle(rest_length, virtual_area, improved, spring, identified):
    """All models of one muscle by name."""
    models = {
        "virtual-area": VirtualArea(rest_length, virtual_area),
        "improved-mckibben": ImprovedMcKibben(rest_length, improved),
        "mckibben": McKibben(rest_length),
        "tondu-lopez": TonduLopez(rest_length),
        "tondu-lopez-k": TonduLopezK(rest_length),
        "tondu-lopez-kq": TonduLopezKq(rest_length),
        "tondu-lopez-friction": TonduLopezFriction(rest_length),
        "frustum-ends": FrustumEnds(rest_length),
        "rounded-ends": RoundedEnds(rest_length),
        "variable-diameter": VariableDiameter(rest_length),
        "mooney-rivlin": MooneyRivlin(rest_length),
        "spring": Spring(rest_length, **spring),
        "three-element": ThreeElement(rest_length),
    }
    return {name: replace(model, **identified.get(name, {})) for name, model in models.items()}


# What --identify finds, to the digits that are kept in the presets.
IDENTIFIED_1000 = {
    "tondu-lopez-k": {"k_0": 1.65727, "k_per_pressure": -1.6328e-6},
    "tondu-lopez-friction": {"k_0": 1.65727, "k_per_pressure": -1.6328e-6},
    "variable-diameter": {"end_diameter": 0.0603676},
    "mooney-rivlin": {"c10": 235722.0, "c01": 1269800.0},
    "spring": {"low_u": (-0.00598192, -1.14302e-07, 1.11892e-11), "high_u": (0.0150575, 1.29831e-06, -1.58341e-12)},
    "three-element": {"contraction_force": -160.552, "contraction_area": 0.00758401, "stiffness": 2596.2,
                      "stiffness_per_pressure": 0.0180555},
}
IDENTIFIED_290 = {
    "tondu-lopez-k": {"k_0": 1.9412, "k_per_pressure": -1.66779e-6},
    "tondu-lopez-friction": {"k_0": 1.9412, "k_per_pressure": -1.66779e-6},
    "tondu-lopez-kq": {"low_k": 36.596, "low_q": 0.26217, "high_k": 4.3184, "high_q": 0.93884},
    "variable-diameter": {"end_diameter": 0.0960857},
    "mooney-rivlin": {"c10": 1492150.0, "c01": 94973.0},
    "spring": {"low_u": (-0.00525511, -1.23573e-07, 4.03679e-12), "high_u": (0.00551096, 3.26265e-07, -3.93289e-13)},
    "three-element": {"contraction_force": -546.515, "contraction_area": 0.0100422, "stiffness": 6862.2,
                      "stiffness_per_pressure": 0.109099},
}


def muscles():
    return {
        "dmsp-40-1000": muscle(LONG_REST_LENGTH, VIRTUAL_AREA_1000, IMPROVED_1000, SPRING_1000, IDENTIFIED_1000),
        "dmsp-40-290": muscle(0.290, VIRTUAL_AREA_290, IMPROVED_290, SPRING_290, IDENTIFIED_290),
    }


FREE = {
    "tondu-lopez-k": {"k_0": 1.6, "k_per_pressure": -1.6e-6},
    "variable-diameter": {"end_diameter": 0.06},
    "mooney-rivlin": {"c10": 1e6, "c01": 1e6},
    "three-element": {"contraction_force": -300.0, "contraction_area": 8e-3, "stiffness": 5e3,
                      "stiffness_per_pressure": 0.05},
    "spring": {"low_u": None, "high_u": None},
}


def set_values(model, names, values):
    """The model with its free values; a tuple takes three."""
    changes, values = {}, list(values)
    for name in names:
        if isinstance(getattr(model, name), tuple):
            changes[name] = tuple(values[:3])
            values = values[3:]
        else:
            changes[name] = values.pop(0)
    return replace(model, **changes)


def identify(model, start, pressure, x, force):
    names = list(start)
    parabola = [0.05 * model.rest_length, 6e-7 * model.rest_length, -6e-13 * model.rest_length]
    first = [number for value in start.values() for number in (parabola if value is None else [value])]
    scale = np.abs(first)
    misses = lambda values: set_values(model, names, values * scale).force(pressure, x, 0.0) - force
    fit = least_squares(misses, np.array(first) / scale, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    rounded = set_values(model, names, [float(f"{value:.6g}") for value in fit.x * scale])
    return rounded, names


def rms(values):
    return np.sqrt(np.mean(values**2))


def report(name, rest_length, reach):
    models = muscles()[name]
    points = reconstructed_points(models["virtual-area"].muscle, reach)
    for which, model in models.items():
        pressure, x, force = points
        if which in FREE:
            if which == "spring":  # the low range has a say, too
                grid = np.meshgrid(np.arange(0.25e5, 4.51e5, 0.25e5), np.linspace(-0.03 * rest_length, reach, 60))
                pressure, x = (axis.ravel() for axis in grid)
                force = models["virtual-area"].force(pressure, x, 0.0)
                inside = (force > 90) & (force < 820)
                pressure, x, force = pressure[inside], x[inside], force[inside]
            fitted, names = identify(model, FREE[which], pressure, x, force)
            for free in names:
                found, kept = np.atleast_1d(getattr(fitted, free)), np.atleast_1d(getattr(model, free))
                agree = np.allclose(found, kept, rtol=2e-5, atol=0)
                print(f"{name}/{which}: {free} = {getattr(fitted, free)!r}", "" if agree else "NOT AS COMMITTED")
            if which == "spring":
                print(f"    rms {rms(fitted.force(pressure, x, 0.0) - force):.1f} N from 0.25 bar")
            model = fitted
        pressure, x, force = points
        print(f"{name}/{which}: rms {rms(model.force(pressure, x, 0.0) - force):.1f} N")
    # The two points of k and q (eqs. 4.22 and 4.23).
    model, law = models["tondu-lopez-kq"], models["virtual-area"].muscle
    for pressure in 0.5e5, 1e5:
        grid = np.linspace(0, reach, 200_001)
        stroke = grid[np.argmax(affine_force(law, pressure, grid) <= 0)]
        q = 4 * affine_force(law, pressure, 0.0) / (PI * model.rest_diameter**2 * pressure * (model.alpha - model.beta))
        k = rest_length / stroke * (1 - np.sqrt(model.beta / model.alpha))
        print(f"{name}/tondu-lopez-kq at {pressure:g} Pa: k = {k:.5g}, q = {q:.5g}")


def write():
    with open(Path(__file__).with_suffix(".csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["preset", "pressure [Pa]", "contraction [m]", "velocity [m/s]", "force [N]"])
        for name, models in muscles().items():
            for which, model in models.items():
                for number, p in enumerate(PRESSURES):
                    for strain in STRAINS:
                        v = VELOCITIES[(number + int(1000 * strain)) % len(VELOCITIES)]
                        x = float(f"{strain * model.rest_length:.9g}")
                        force = float(np.real(model.force(p, x, v)))
                        assert np.isfinite(force), (which, p, x)
                        out.writerow([f"{name}/{which}", f"{p:g}", f"{x:.9g}", f"{v:g}", f"{force:.15g}"])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--identify", action="store_true", help="fit again and compare")
    if arguments.parse_args().identify:
        report("dmsp-40-1000", LONG_REST_LENGTH, 0.24)
        report("dmsp-40-290", 0.290, 0.071)
    write()


if __name__ == "__main__":
    main()
