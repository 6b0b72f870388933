"""Runs ClosedLoop.ssp with FMPy and draws what came out.

    sinew export --out fmus
    python fmpy_closed_loop.py fmus/ClosedLoop.ssp --out closed_loop.png

Needs fmpy, numpy and matplotlib (pip). `simulate` is a Jacobi master: all FMUs step at once, then they exchange values.
It initialises the FMUs with the values of their connections, as libcosim and ecos do. FMPy's own `simulate_ssp` does
not: it gives every input 0 for the first step, here a valve that is shut for a moment.
"""

import argparse
import tempfile
from contextlib import ExitStack
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.ssd import find_components, get_connections, read_ssd

NAMES = ("reference.setpoint", "muscle.measured.contraction", "muscle.muscle.gauge_pressure", "controller.command")


class Component:
    """An FMU of the system, its variables by name."""

    def __init__(self, name, path, folder):
        description = fmpy.read_model_description(str(path))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.slave = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path), str(folder / name)),
                               modelIdentifier=description.coSimulation.modelIdentifier, instanceName=name)
        self.slave.instantiate()
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()

    def get(self, variable):
        return self.slave.getReal([self.references[variable]])[0]

    def set(self, variable, value):
        self.slave.setReal([self.references[variable]], [value])

    def derivative(self, variable):
        return self.slave.getRealOutputDerivatives([self.references[variable]], [1])[0]

    def set_derivative(self, variable, value):
        self.slave.setRealInputDerivatives([self.references[variable]], [1], [value])


def exchange(components, connections, derivatives=False):
    """Reads all outputs that are connected, then sets the inputs; also their derivatives, where they are wanted."""
    values = [components[source].get(output) for source, output, _, _ in connections]
    slopes = [components[source].derivative(output) if derivatives else 0.0 for source, output, _, _ in connections]
    for (_, _, sink, variable), value, slope in zip(connections, values, slopes, strict=True):
        components[sink].set(variable, value)
        if derivatives:
            components[sink].set_derivative(variable, slope)


def exchange_in_order(components, connections, derivatives=False):
    """One connection after the other: a command is read when the controller has what was measured just now."""
    for connection in connections:
        exchange(components, [connection], derivatives)


def simulate(ssp, step_size, stop_time, names=NAMES, derivatives=False, exchange=exchange):
    """Courses of `component.variable` by name, and `time`, in SI; each an array of shape (n_steps + 1,).

    With `derivatives`, an input goes on during a step as the output did at its beginning (fmi2SetRealInputDerivatives)
    instead of staying where it is.
    """
    system = read_ssd(str(ssp)).system
    connections = [(source.parent.name, source.name, sink.parent.name, sink.name)
                   for source, sink in get_connections(system)]
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        fmpy.extract(str(ssp), str(folder / "system"))
        components = {}
        for component in find_components(system):
            components[component.name] = Component(component.name, folder / "system" / component.source, folder)
            stack.callback(components[component.name].slave.freeInstance)
        for _ in components:  # as far as a value can go from FMU to FMU
            exchange(components, connections)
        for component in components.values():
            component.slave.exitInitializationMode()

        def record():
            return [components[component].get(variable)
                    for component, variable in (name.split(".", 1) for name in names)]

        times = step_size * np.arange(round(stop_time / step_size) + 1)
        rows = [record()]
        for time in times[:-1]:
            exchange(components, connections, derivatives)
            for component in components.values():
                component.slave.doStep(time, step_size)
            rows.append(record())
        return {"time": times} | dict(zip(names, np.array(rows).T, strict=True))


def draw(course, path):
    """Contraction and its setpoint, the error between them, and the pressure."""
    import matplotlib
    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, (motion, error, pressure) = pyplot.subplots(3, sharex=True, figsize=(7, 7), layout="constrained")
    setpoint, contraction = course["reference.setpoint"], course["muscle.measured.contraction"]
    motion.plot(course["time"], 1e3 * setpoint, "--", label="setpoint")
    motion.plot(course["time"], 1e3 * contraction, label="measured")
    motion.set_ylabel("contraction [mm]")
    motion.legend()
    error.plot(course["time"], 1e3 * (setpoint - contraction))
    error.set_ylabel("control error [mm]")
    pressure.plot(course["time"], 1e-5 * course["muscle.muscle.gauge_pressure"])
    pressure.set_ylabel("gauge pressure [bar]")
    pressure.set_xlabel("time [s]")
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ssp", type=Path)
    parser.add_argument("--step-size", type=float, default=1e-3, help="communication step in s")
    parser.add_argument("--stop-time", type=float, default=8.0, help="in s")
    parser.add_argument("--derivatives", action="store_true", help="give the FMUs the derivatives of their inputs")
    parser.add_argument("--out", type=Path, default=Path("closed_loop.png"), help="plot")
    arguments = parser.parse_args()
    course = simulate(arguments.ssp, arguments.step_size, arguments.stop_time, derivatives=arguments.derivatives)
    error = course["reference.setpoint"] - course["muscle.measured.contraction"]
    draw(course, arguments.out)
    print(f"largest control error {1e3 * np.abs(error).max():.3f} mm, at the end {1e3 * error[-1]:.4f} mm; "
          f"see {arguments.out}")


if __name__ == "__main__":
    main()
