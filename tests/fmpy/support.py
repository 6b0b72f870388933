"""What the tests share: the tool, its FMUs by variable name, recordings, small numerics."""

import csv
import os
import subprocess
import sys
import tempfile
from ctypes import byref
from functools import cached_property
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
REFERENCE = ROOT / "tests" / "reference"
EXAMPLES = ROOT / "examples"
MODELS = ("PneumaticMuscle", "PneumaticActuator", "PidFeedForward", "ReferenceTrajectory")

# Tools of this Python environment (fmutool, cargo-zigbuild) are found without activating it.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
# The muscle models of the reference programs, which share no code with the product.
sys.path.insert(0, str(REFERENCE))
sys.path.insert(0, str(EXAMPLES))

__all__ = ["FMICallException"]


def run(*command, **options):
    """Runs a command to its end; a failure shows what it printed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command} gave {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done


def write_parameters(path, parameters, preset="dmsp-40-1000"):
    """A parameter file with values by full name; the base is a preset."""
    lines = [f'preset = "{preset}"'] + [f"{name} = {value!r}" for name, value in parameters.items()]
    path.write_text("\n".join(lines) + "\n")
    return path


def read_csv(path):
    """Columns of a CSV file by name without unit, missing samples as NaN."""
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    names = [name.split(" [")[0] for name in header]
    table = np.array([[float(cell) if cell.strip() else np.nan for cell in row] for row in rows])
    return dict(zip(names, table.T, strict=True))


class Fmu:
    """An FMU, unpacked."""

    def __init__(self, path):
        self.path = Path(path)
        self.description = fmpy.read_model_description(str(path))
        self.variables = {variable.name: variable for variable in self.description.modelVariables}

    @cached_property
    def folder(self):
        """Where it is unpacked: a new place each time, because a loaded library must not be written over."""
        self._temporary = tempfile.TemporaryDirectory()
        return fmpy.extract(str(self.path), unzipdir=self._temporary.name)

    def names(self, causality):
        return [name for name, variable in self.variables.items() if variable.causality == causality]

    def is_real(self, name):
        return self.variables[name].type == "Real"

    def references(self, names):
        return [self.variables[name].valueReference for name in names]

    def unknowns(self, section):
        """Dependencies by name of each unknown in `outputs` or `initialUnknowns`."""
        entries = getattr(self.description, section)
        return {entry.variable.name: [known.name for known in entry.dependencies] for entry in entries}


class Log(list):
    """What an FMU told its host: (status, category, message)."""

    # FMPy gives the messages of all FMUs to the logger that was made last: it has to live as long as the process.
    _all = []

    def __init__(self):
        super().__init__()
        self._all.append(self)
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = fmi2CallbackLoggerTYPE(self._take)
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        addLoggerProxy(byref(self.callbacks))

    def _take(self, _component, _instance_name, status, category, message):
        self.append((status, category.decode(), message.decode()))


class Instance:
    """An instance of an FMU in step mode, variables by name; `start` is set before the initialisation."""

    def __init__(self, fmu, start=None, initialize=True):
        description = fmu.description
        self.fmu, self.time, self.log = fmu, 0.0, Log()
        self.slave = FMU2Slave(guid=description.guid, unzipDirectory=fmu.folder,
                               modelIdentifier=description.coSimulation.modelIdentifier)
        self.slave.instantiate(callbacks=self.log.callbacks)
        self.set(start or {})
        if initialize:
            self.initialize()

    def initialize(self):
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, values):
        for name, value in values.items():
            setter = self.slave.setReal if self.fmu.is_real(name) else self.slave.setInteger
            setter(self.fmu.references([name]), [value])

    def set_slopes(self, slopes):
        """First derivatives of inputs, for the next step."""
        self.slave.setRealInputDerivatives(self.fmu.references(slopes), [1] * len(slopes), slopes.values())

    def get(self, *names):
        return np.array(self.slave.getReal(self.fmu.references(names)))

    def output_derivatives(self, *names):
        return np.array(self.slave.getRealOutputDerivatives(self.fmu.references(names), [1] * len(names)))

    def derivative(self, output, known):
        """Partial derivative of an output by one known variable."""
        output_reference, known_reference = self.fmu.references([output]), self.fmu.references([known])
        return self.slave.getDirectionalDerivative(output_reference, known_reference, [1.0])[0]

    def step(self, duration):
        self.slave.doStep(self.time, duration)
        self.time += duration

    def free(self):
        """Frees the instance and unloads the library, which must not hurt the others."""
        self.slave.freeInstance()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.free()


def follow(instance, times, commands, names, steps_between=lambda duration: [duration]):
    """Drives the valve command linearly between samples; outputs at the samples, of shape (n_samples, n_names).

    `steps_between` divides the time between two samples into communication steps.
    """
    table = [instance.get(*names)]
    for start, duration, command, slope in zip(times[:-1], np.diff(times), commands[:-1],
                                               np.diff(commands) / np.diff(times), strict=True):
        instance.time, since = start, 0.0
        for step in steps_between(duration):
            instance.set({"valve.command": command + slope * since})
            instance.set_slopes({"valve.command": slope})
            instance.step(step)
            since += step
        table.append(instance.get(*names))
    return np.array(table)
