"""Static force models of the two muscles, written from the equations and sharing nothing with the product.

Every model is affine in gauge pressure: force = pressure * area(x) + elastic_force(x),
with x the contraction in metres, positive when shorter. SI throughout.
"""

from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81
BRAID_ANGLE = np.radians(25.7)
LONG_TURNS, LONG_THREAD = 3.5, 1.0877
LONG_REST_LENGTH = LONG_THREAD * np.cos(BRAID_ANGLE)
WALL_THICKNESS = 1e-3  # only modulus * thickness can be identified from forces; this choice fixes the modulus


@dataclass(frozen=True)
class VirtualArea:
    """Thesis equations 4.6 to 4.11; polynomials in x, highest power first."""

    area_coefficients: tuple
    elastic_coefficients: tuple

    def area(self, x):
        return np.polyval(self.area_coefficients, x)

    def elastic_force(self, x):
        return np.polyval(self.elastic_coefficients, x)


@dataclass(frozen=True)
class ImprovedMcKibben:
    """Thesis equation 4.17 with its signs corrected; modulus is a cubic in L/L0, highest power first."""

    turns: float
    thread_length: float
    rest_length: float
    modulus_coefficients: tuple = (0.0, 0.0, 0.0, 0.0)  # zero: the plain McKibben muscle

    def diameter(self, length):
        return np.sqrt(self.thread_length**2 - length**2) / (self.turns * np.pi)

    def area(self, x):
        length = self.rest_length - x
        return (3 * length**2 - self.thread_length**2) / (4 * np.pi * self.turns**2)

    def elastic_force_per_modulus(self, x):
        length = self.rest_length - x
        diameter, rest_diameter = self.diameter(length), self.diameter(self.rest_length)
        axial_strain = length / self.rest_length - 1
        hoop_strain = diameter / rest_diameter - 1
        axial = axial_strain * WALL_THICKNESS * np.pi * diameter
        hoop = hoop_strain * 2 * WALL_THICKNESS * length**2 / (diameter * self.turns**2 * np.pi**2)
        return axial - hoop

    def elastic_force(self, x):
        modulus = np.polyval(self.modulus_coefficients, 1 - x / self.rest_length)
        return modulus * self.elastic_force_per_modulus(x)


def mckibben(rest_length, modulus_coefficients=(0.0, 0.0, 0.0, 0.0)):
    """Turns and thread length scale with the rest length, so that the braid angle is the same for all lengths."""
    return ImprovedMcKibben(
        turns=LONG_TURNS * rest_length / LONG_REST_LENGTH,
        thread_length=rest_length / np.cos(BRAID_ANGLE),
        rest_length=rest_length,
        modulus_coefficients=modulus_coefficients,
    )


def static_force(muscle, pressure, x):
    return pressure * muscle.area(x) + muscle.elastic_force(x)


VIRTUAL_AREA_1000 = VirtualArea((-0.0266, 0.0091), (-1.0067e5, 5.2111e4, -8.8089e3, -113.29))
VIRTUAL_AREA_290 = VirtualArea((-0.1213, 0.0106), (-6.19051e6, 7.3168e5, -2.9035e4, -443.99))

# From improved_mckibben.py.
IMPROVED_1000 = mckibben(LONG_REST_LENGTH, (6.596738589e08, -1.551987184e09, 1.227953001e09, -3.213932084e08))
IMPROVED_290 = mckibben(0.290, (1.656554055e09, -3.860547250e09, 2.972571812e09, -7.467044110e08))
