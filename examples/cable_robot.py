"""A planar robot whose platform hangs in four cables, each pulled by a pneumatic muscle (four PneumaticActuator FMUs).

    sinew export --out fmus
    python cable_robot.py fmus/PneumaticActuator.fmu --out cable_robot.png

Needs fmpy, numpy, scipy and matplotlib (pip). Muscle and cable lie in one line between a corner of the frame and one of
the platform. FMPy steps the FMUs; the platform itself (three degrees of freedom) is integrated here by velocity Verlet.
The valves get the pressures at which the platform would rest on a given path: no feedback.
"""

import argparse
import tempfile
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from scipy.optimize import root

GRAVITY = 9.81  # m/s2
FRAME = np.array([[-1.5, 1.2], [1.5, 1.2], [1.5, -1.2], [-1.5, -1.2]])  # m
PLATFORM = np.array([[-0.2, -0.15], [0.2, -0.15], [0.2, 0.15], [-0.2, 0.15]])  # m; crossed: upper cables end below
MASS = np.array([20.0, 20.0, 0.6])  # kg, kg, kg m2
WEIGHT = np.array([0.0, MASS[1] * GRAVITY, 0.0])  # N, N, N m
MEAN_TENSION = 400.0  # N, chosen: the tensions of four cables are free but for one number
MIDDLE = np.zeros(3)  # pose: x m, y m, angle rad


def geometry(pose):
    """Lengths of muscle and cable in m, and the matrix that makes their tensions a wrench, of shape (3, 4).

    By virtual work its transpose makes a velocity of the platform the rates at which the lengths shrink.
    """
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    arms = PLATFORM @ np.array([[cosine, sine], [-sine, cosine]])
    ways = FRAME - (pose[:2] + arms)
    lengths = np.linalg.norm(ways, axis=1)
    pulls = ways / lengths[:, None]
    return lengths, np.vstack([pulls.T, arms[:, 0] * pulls[:, 1] - arms[:, 1] * pulls[:, 0]])


class Muscles:
    """The four FMUs, one after the other in every array."""

    def __init__(self, path, folder):
        description = fmpy.read_model_description(str(path))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        unpacked = fmpy.extract(str(path), str(folder))
        self.slaves = [FMU2Slave(guid=description.guid, unzipDirectory=unpacked, instanceName=f"muscle{k}",
                                 modelIdentifier=description.coSimulation.modelIdentifier) for k in range(len(FRAME))]
        for slave in self.slaves:
            slave.instantiate()
        starts = {variable.name: variable.start for variable in description.modelVariables}
        self.rest_length, self.gain, self.bandwidth = (
            float(starts[name]) for name in ("muscle.rest_length", "valve.gain", "valve.bandwidth"))
        self.area = np.array([float(starts[f"virtual_area.area_{k}"]) for k in range(2)])
        self.elastic = np.array([float(starts[f"virtual_area.elastic_{k}"]) for k in range(4)])
        # The cables are as long as it takes for muscles contracted by a tenth of their length in the middle.
        self.cable_lengths = geometry(MIDDLE)[0] - 0.9 * self.rest_length

    def contractions(self, pose):
        return self.rest_length + self.cable_lengths - geometry(pose)[0]

    def static_force(self, gauge_pressure, contraction):
        """Thesis eq. 4.5, written down once more: what the FMU pulls at rest, in N."""
        powers = contraction ** np.arange(4)[:, None]
        return gauge_pressure * (self.area @ powers[:2]) + self.elastic @ powers

    def pressures(self, pose):
        """Gauge pressures in Pa at which the platform rests in a pose, with the mean tension that was chosen."""
        matrix = geometry(pose)[1]
        tensions = np.linalg.pinv(matrix) @ WEIGHT
        balanced = np.linalg.svd(matrix)[2][-1]  # tensions that together do nothing
        tensions += (MEAN_TENSION - tensions.mean()) / balanced.mean() * balanced
        contraction = self.contractions(pose)
        at_ambient = self.static_force(0.0, contraction)
        return (tensions - at_ambient) / (self.static_force(1.0, contraction) - at_ambient)

    def equilibrium(self, gauge_pressures, guess=MIDDLE):
        """Pose in which the platform rests at given pressures, by scipy."""
        def surplus(pose):
            return geometry(pose)[1] @ self.static_force(gauge_pressures, self.contractions(pose)) - WEIGHT
        pose = root(surplus, guess).x
        if np.abs(surplus(pose)).max() > 1e-6:
            raise ValueError(f"no pose was found in which the platform rests at {gauge_pressures} Pa")
        return pose

    def set(self, name, values):
        for slave, value in zip(self.slaves, values, strict=True):
            slave.setReal([self.references[name]], [value])

    def get(self, name):
        return np.array([slave.getReal([self.references[name]])[0] for slave in self.slaves])

    def move(self, pose, velocity):
        """Tells the muscles where their ends are; forces in N."""
        self.set("muscle.contraction", self.contractions(pose))
        self.set("muscle.contraction_velocity", geometry(pose)[1].T @ velocity)
        return self.get("muscle.force")

    def start(self, pose):
        """Initialises the muscles at rest in a pose; may be called again."""
        for slave in self.slaves:
            slave.reset()
        self.set("initial.gauge_pressure", self.pressures(pose))
        for slave in self.slaves:
            slave.setupExperiment()
            slave.enterInitializationMode()
        self.move(pose, np.zeros(3))
        for slave in self.slaves:
            slave.exitInitializationMode()

    def free(self):
        for slave in self.slaves:
            slave.freeInstance()


def simulate(muscles, command_at, duration, step_size=2e-3, start=MIDDLE):
    """Moves the platform from rest; `command_at` gives the four commands in V at a time in s.

    Returns courses by name, each of shape (n_steps + 1, …): times, poses, tensions, pressures, and `energy` in J:
    kinetic and potential energy of the platform less the work of the muscles, which must stay what it was.
    """
    muscles.start(start)
    pose, velocity = start.copy(), np.zeros(3)
    tensions, contractions, work = muscles.move(pose, velocity), muscles.contractions(pose), 0.0
    times, rows = step_size * np.arange(round(duration / step_size) + 1), []
    for time in times:
        energy = 0.5 * MASS @ velocity**2 + WEIGHT @ pose - work
        rows.append((pose, tensions, muscles.get("muscle.gauge_pressure"), energy))
        acceleration = (geometry(pose)[1] @ tensions - WEIGHT) / MASS
        muscles.set("valve.command", command_at(time))
        for slave in muscles.slaves:
            slave.doStep(time, step_size)
        pose = pose + step_size * velocity + 0.5 * step_size**2 * acceleration
        pull = muscles.move(pose, velocity + step_size * acceleration)
        after = (geometry(pose)[1] @ pull - WEIGHT) / MASS
        velocity = velocity + 0.5 * step_size * (acceleration + after)
        before, tensions = tensions, muscles.move(pose, velocity)
        shorter, contractions = muscles.contractions(pose) - contractions, muscles.contractions(pose)
        work += 0.5 * (before + tensions) @ shorter
    names = ("poses", "tensions", "pressures", "energy")
    return {"times": times} | dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))


def path(time):
    """Where the platform should be: from the middle once around a circle while it turns to and fro, then still."""
    share = np.clip(time / 6.0, 0.0, 1.0)
    share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    turn = 2.0 * np.pi * share
    return np.array([0.05 * np.sin(turn), 0.05 * (1.0 - np.cos(turn)), 0.06 * np.sin(turn)])


def draw(course, muscles, file):
    import matplotlib
    matplotlib.use("agg")
    from matplotlib import pyplot

    wanted = np.array([path(time) for time in course["times"]])
    figure, ((robot, plane), (tension, error)) = pyplot.subplots(2, 2, figsize=(10, 8), layout="constrained")
    turned = course["poses"][len(wanted) // 4]
    cosine, sine = np.cos(turned[2]), np.sin(turned[2])
    corners = turned[:2] + PLATFORM @ np.array([[cosine, sine], [-sine, cosine]])
    lengths = muscles.cable_lengths
    robot.add_patch(pyplot.Polygon(FRAME, fill=False, color="0.6"))
    robot.add_patch(pyplot.Polygon(corners, color="0.8"))
    for k, (anchor, corner) in enumerate(zip(FRAME, corners, strict=True)):
        joint = corner + (anchor - corner) * lengths[k] / np.linalg.norm(anchor - corner)
        robot.plot(*np.array([anchor, joint]).T, color=f"C{k}", linewidth=5, solid_capstyle="butt")
        robot.plot(*np.array([joint, corner]).T, color=f"C{k}", linewidth=1)
        tension.plot(course["times"], course["tensions"][:, k], color=f"C{k}")
    robot.set(aspect="equal", title="muscles (thick) and cables", xlabel="x [m]", ylabel="y [m]")
    plane.plot(*(1e3 * wanted[:, :2]).T, "--", label="wanted")
    plane.plot(*(1e3 * course["poses"][:, :2]).T, label="simulated")
    plane.set(aspect="equal", title="path of the platform", xlabel="x [mm]", ylabel="y [mm]")
    plane.legend(loc="center")
    tension.set(title="tension", xlabel="time [s]", ylabel="tension [N]")
    difference = course["poses"] - wanted
    error.plot(course["times"], 1e3 * difference, label=["x [mm]", "y [mm]", "angle [mrad]"])
    error.set(title="simulated minus wanted", xlabel="time [s]")
    error.legend()
    figure.savefig(file, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fmu", type=Path, help="PneumaticActuator.fmu")
    parser.add_argument("--out", type=Path, default=Path("cable_robot.png"), help="plot")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        muscles = Muscles(arguments.fmu, folder)

        def command_at(time):  # a valve lags by the inverse of its bandwidth: it is asked for what will be wanted then
            return muscles.pressures(path(time + 1.0 / muscles.bandwidth)) / muscles.gain

        course = simulate(muscles, command_at, 8.0)
        draw(course, muscles, arguments.out)
        error = course["poses"] - np.array([path(time) for time in course["times"]])
        at_rest = muscles.equilibrium(muscles.gain * command_at(8.0))
        energy = course["energy"] - course["energy"][0]
        print(f"farthest from the path {1e3 * np.linalg.norm(error[:, :2], axis=1).max():.2f} mm; at the end "
              f"{1e6 * np.linalg.norm((course['poses'][-1] - at_rest)[:2]):.3f} um from the static solution; tensions "
              f"{course['tensions'].min():.0f} to {course['tensions'].max():.0f} N; energy kept within "
              f"{np.abs(energy).max():.1e} J; see {arguments.out}")
        muscles.free()


if __name__ == "__main__":
    main()
