"""Turns published measurements into recordings.

    git clone https://github.com/EvaZillen/3D-printed-pneumatic-actuator zillen
    git -C zillen checkout 6e0bcb4633bd53b2a8544cdbd497c4c06539afc7
    python convert.py zillen          # writes cylinder/*.csv and chamber/*.csv; needs numpy
    python convert.py                 # writes map/*.csv alone, from published/

A characteristic without a length becomes that of a muscle of 1 m.
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
FRICTION = "results_pneumatic-actuator/data/friction"
LEAKAGE = "appendix_compressed-air_chamber/data"
SEALS = ["Circle", "NAP310", "X-ring257", "Kidney_lc"]
PRESSURES = [1, 3, 5, 7]  # bar
CHAMBERS = ["Aluminium", "Prusa", "Formlabs", "Ultimaker_006", "Ultimaker_015", "Ultimaker_020"]
ZERO_OF_CONTRACTION = 40.0  # mm on the laser: the piston is pushed in as far as in any recording, and a little further
THINNING = 2  # every second sample
VALVE_SHUT = 6.0  # s; the supply is still connected at the start of each file, until 5.1 s where it shows
VALVE_GAIN = 1.0  # bar/V, that of the default parameters
HIGHEST_FORCE = {"festo_dmsp_40": 6000, "festo_dmsp_20": 1500}  # N, of the catalogue
POINT_LASTS = 1.0  # s, on the made-up time axis of a static map


def write(path, header, formats, columns):
    """One line per row; NaN becomes an empty cell."""
    with open(path, "w") as file:
        file.write(header + "\n")
        for row in zip(*columns, strict=True):
            cells = ["" if np.isnan(value) else format(value, f) for value, f in zip(row, formats, strict=True)]
            file.write(",".join(cells) + "\n")


def stroke(source, target):
    """Piston driven to and fro by a machine.

    The laser shows how far the piston is pushed in. The chamber of a muscle grows when it shortens, hence the sign.
    """
    table = np.loadtxt(source)[::THINNING]
    milliseconds, laser, bar, newton = table[:, [0, 4, 5, 6]].T
    columns = [milliseconds / 1e3, ZERO_OF_CONTRACTION - laser, bar, newton]
    write(target, "time [s],contraction [mm],gauge_pressure [bar],force [N]", [".3f"] * 4, columns)


def number(text):
    """The times of these files carry points between thousands: 1.003.000 is 1003.000."""
    whole, _, decimals = text.rpartition(".")
    return float(whole.replace(".", "") + "." + decimals)


def leak(source, target):
    """Pressure of a closed chamber from when its valve is shut; the command would hold the pressure of that moment."""
    rows = [line.split(";")[:3] for line in source.read_text().splitlines() if line.strip()]
    seconds, bar = np.array([[number(cells[0]) / 1e3, number(cells[2])] for cells in rows]).T
    seconds, bar = seconds[seconds >= VALVE_SHUT], bar[seconds >= VALVE_SHUT]
    command = np.full(len(bar), round(bar[:5].mean() / VALVE_GAIN, 3))
    columns = [seconds, command, np.zeros(len(bar)), bar]
    write(target, "time [s],command [V],contraction [mm],gauge_pressure [bar]", [".3f", ".3f", ".0f", ".3f"], columns)


def static_map(source, target):
    """A map of static forces on a time axis that never was: pressure after pressure, there and back in contraction.

    Both branches are the same by construction, so that nothing in it looks like friction; a point is there twice and is
    worth one.
    A force of zero stands for a slack muscle, which hangs in its clamps and shows nothing: those points are left out.
    """
    pascal, length, _, newton = np.genfromtxt(source, delimiter=",", skip_header=1).T
    order = []
    for pressure in np.unique(pascal):
        rows = np.flatnonzero((pascal == pressure) & (newton > 0))
        there = rows[np.argsort(-length[rows])]
        order.extend([*there, *there[::-1]])
    contraction = 1e3 * (length.max() - length[order])
    columns = [POINT_LASTS * np.arange(len(order)), contraction, pascal[order] / 1e5, newton[order]]
    write(target, "time [s],contraction [mm],gauge_pressure [bar],force [N]", [".0f", ".1f", ".5f", ".1f"], columns)


def characteristic(source, target):
    """FESTO's characteristic over the ratio of contraction, curve after curve, as a muscle of 1 m.

    Forces beyond what the catalogue allows, and those of a slack muscle, are extrapolations of the tool and left out.
    """
    kilopascal, ratio, newton = np.genfromtxt(source, delimiter=",", skip_header=1).T
    shown = (newton > 0) & (newton <= HIGHEST_FORCE[source.name.split("_sizing")[0]])
    order = np.flatnonzero(shown)[np.lexsort((ratio[shown], kilopascal[shown]))]
    columns = [POINT_LASTS * np.arange(len(order)), 1e3 * ratio[order], kilopascal[order] / 100, newton[order]]
    write(target, "time [s],contraction [mm],gauge_pressure [bar],force [N]", [".0f", ".1f", ".2f", ".1f"], columns)


def main(zillen=None):
    for name in HIGHEST_FORCE:
        characteristic(HERE / f"published/{name}_sizing_tool.csv", HERE / f"map/{name}.csv")
    for name in ["dmsp_20_300", "dmsp_10_250"]:
        static_map(HERE / f"published/martens_boblan_{name}.csv", HERE / f"map/{name}.csv")
    if zillen:
        for name in (f"{seal}_{bar}bar" for seal in SEALS for bar in PRESSURES):
            stroke(Path(zillen, FRICTION, f"{name}.csv"), HERE / f"cylinder/{name.lower().replace('-', '_')}.csv")
        for name in CHAMBERS:
            leak(Path(zillen, LEAKAGE, f"{name}.csv"), HERE / f"chamber/{name.lower()}.csv")


if __name__ == "__main__":
    main(*sys.argv[1:])
