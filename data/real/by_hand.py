"""What a calculation by hand finds in these recordings, to hold beside a diagnosis. Needs numpy.

    python by_hand.py
"""

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
# mm; the kidney has the area of a circle of 25 mm.
BORE = {"circle": 25.0, "nap310": 25.0, "x_ring257": 25.7, "kidney_lc": 25.0}
MIDDLE = (10.0, 35.0)  # mm, of a stroke, away from the reversals
MOVING = 2.0  # mm/s
SETTLED = 3.0  # s
ATMOSPHERE = 1.013  # bar
LEVELS = np.array([6.0, 4.5, 3.0, 2.0, 1.3, 0.8, 0.5, 0.3])  # bar, between which the rate of a fast leak is taken


def table(path):
    return np.genfromtxt(path, delimiter=",", skip_header=1).T


def area(seal):
    """Newtons per bar."""
    return np.pi / 4 * BORE[seal] ** 2 / 10


def one_pressure(path):
    """Mean pressure in bar, half the difference of the force in N between the directions, the same less the ideal
    piston's force at the measured pressure, and the mean residual in N."""
    time, contraction, bar, newton = table(path)
    velocity = np.convolve(np.gradient(contraction, time), np.ones(9) / 9, "same")
    residual = newton - area(path.stem.rsplit("_", 1)[0]) * bar
    middle = (contraction > MIDDLE[0]) & (contraction < MIDDLE[1]) & (time > SETTLED)
    grows, shrinks = middle & (velocity > MOVING), middle & (velocity < -MOVING)
    directions = [(bar[way].mean(), newton[way].mean(), residual[way].mean()) for way in (shrinks, grows)]
    (bar_in, force_in, in_), (bar_out, force_out, out) = directions
    return (bar_in + bar_out) / 2, (force_in - force_out) / 2, (in_ - out) / 2, (in_ + out) / 2


def friction():
    print("Friction: half the difference of the force between the directions")
    for seal in BORE:
        rows = [(path, *one_pressure(path)) for path in sorted(HERE.glob(f"cylinder/{seal}_*bar.csv"))]
        for path, bar, raw, half, mean in rows:
            print(f"  {path.stem:16} {bar:.2f} bar", end=" ")
            print(f"raw {raw:5.2f} N, less piston {half:5.2f} N, mean residual {mean:5.2f} N")
        bars, _, halves, means = np.array([row[1:] for row in rows]).T
        slope, offset = np.polyfit(bars, halves, 1)
        force = means + area(seal) * bars
        measured_area = np.sum(force * bars) / np.sum(bars**2)
        print(f"  {seal}: half width = {offset:.2f} N + {slope:.3f} N/bar;", end=" ")
        print(f"area {10 * measured_area:.1f} mm2, {measured_area / area(seal):.4f} of nominal")


def leakage():
    print("Leakage: straight line through the logarithm of the pressure")
    for path in sorted(HERE.glob("chamber/*.csv")):
        time, _, _, bar = table(path)
        spans = [(0, 99)] if bar[-1] > 1 else [(3, 7), (1, 3), (0.3, 1)]
        for low, high in spans:
            there = (bar > low) & (bar < high)
            gauge, absolute = (-np.polyfit(time[there], np.log(bar[there] + p), 1)[0] for p in (0, ATMOSPHERE))
            print(f"  {path.stem:14} {bar[there][0]:.2f} to {bar[there][-1]:.2f} bar:", end=" ")
            print(f"{gauge:.3e} /s of gauge ({6000 * gauge:.3f} %/min), {absolute:.3e} /s of absolute pressure")
        if bar[-1] < 1:
            times = [time[np.argmax(bar < level)] for level in LEVELS]
            rates = -np.diff(LEVELS) / np.diff(times)
            exponent, logarithm = np.polyfit(np.log(LEVELS[:-1] + np.diff(LEVELS) / 2), np.log(rates), 1)
            print(f"  {path.stem:14} rate = {np.exp(logarithm):.4f} bar/s (p/bar)^{exponent:.2f}")


def maps():
    print("Static maps against the ideal McKibben muscle: force = area p + rest at every length, muscle not slack")
    for name, bore, rest in [("dmsp_20_300", 20.0, 296.0), ("dmsp_10_250", 10.0, 250.0)]:
        _, contraction, bar, newton = table(HERE / f"map/{name}.csv")
        angle = np.radians(25.7)
        thread = rest / np.cos(angle)
        turns = thread * np.sin(angle) / np.pi / bore
        ideal = (3 * (rest - contraction) ** 2 - thread**2) / (4 * np.pi * turns**2) / 10  # N/bar
        error = newton - ideal * bar
        rms = np.sqrt(np.mean(error**2))
        print(f"  {name}: plain McKibben {rms:.0f} N rms of {newton.max():.0f} N full scale")
        for x in np.unique(contraction):
            here = contraction == x
            if here.sum() > 3:
                slope, offset = np.polyfit(bar[here], newton[here], 1)
                off = np.std(newton[here] - slope * bar[here])
                print(f"    {x / rest:6.1%} short: area {slope / ideal[here][0]:.2f} of McKibben's,", end=" ")
                print(f"rest {offset:5.0f} N, pulls from {-offset / slope:.2f} bar;", end=" ")
                print(f"{here.sum() // 2} points, {off:.1f} N off")


if __name__ == "__main__":
    friction()
    leakage()
    maps()
