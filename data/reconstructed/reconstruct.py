"""Isotonic points of the thesis' two muscles, reconstructed from its virtual-area models: nothing here was measured.

    python reconstruct.py       # writes the CSV files beside it; needs scipy

The thesis measured isotonic curves of DMSP-40-1000 and DMSP-40-290 and prints what it identified from them, force =
pressure x A + b, A and b polynomials of the contraction (eqs. 4.6 to 4.11). The contraction at a pressure and a load
solves that equation. The models were made from 0.5 bar on; below, and for the scatter and the hysteresis of a real
muscle, they hold nothing.
"""

from pathlib import Path

from scipy.optimize import brentq

GRAVITY = 9.81
MASSES = range(10, 90, 10)  # kg
PRESSURES = [0.5 * k for k in range(1, 10)]  # bar
POINT_LASTS = 1.0  # s, on a made-up time axis
MUSCLES = {  # rest length in m; A and b by rising powers of the contraction in m: m2 and N
    "dmsp_40_1000": (0.980101476, [0.0091, -0.0266], [-113.29, -8808.9, 5.2111e4, -1.0067e5]),
    "dmsp_40_290": (0.29, [0.0106, -0.1213], [-443.99, -2.9035e4, 7.3168e5, -6.19051e6]),
}


def polynomial(coefficients, x):
    return sum(c * x**k for k, c in enumerate(coefficients))


def main():
    for name, (rest, area, elastic) in MUSCLES.items():
        rows = ["time [s],contraction [mm],gauge_pressure [bar],force [N],origin"]
        for mass in MASSES:
            force = mass * GRAVITY
            for bar in PRESSURES:
                def lack(x, bar=bar, force=force, area=area, elastic=elastic):
                    return 1e5 * bar * polynomial(area, x) + polynomial(elastic, x) - force

                # Up to 10 % longer and 25 % shorter than at rest, where the root is unique.
                if lack(-0.1 * rest) < 0 or lack(0.25 * rest) > 0:
                    continue
                x = brentq(lack, -0.1 * rest, 0.25 * rest, xtol=1e-12)
                rows.append(f"{POINT_LASTS * (len(rows) - 1):.0f},{1e3 * x:.4f},{bar:.2f},{force:.2f},reconstructed")
        Path(__file__).with_name(f"{name}_reconstructed.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
