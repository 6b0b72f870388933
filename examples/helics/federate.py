"""What the two processes of the closed loop share: an FMU, and the exchange of its signals through HELICS."""

import tempfile
from contextlib import contextmanager

import fmpy
import helics
from fmpy.fmi2 import FMU2Slave


class Fmu:
    """An FMU in initialization mode, variables by name."""

    def __init__(self, path, folder):
        description = fmpy.read_model_description(str(path))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.slave = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path), folder),
                               modelIdentifier=description.coSimulation.modelIdentifier, instanceName="fmu")
        self.slave.instantiate()
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()

    def get(self, name):
        return self.slave.getReal([self.references[name]])[0]

    def set(self, name, value):
        self.slave.setReal([self.references[name]], [value])


@contextmanager
def fmu(path):
    """An FMU, unpacked for as long as it is needed."""
    with tempfile.TemporaryDirectory() as folder:
        instance = Fmu(path, folder)
        try:
            yield instance
        finally:
            instance.slave.freeInstance()


@contextmanager
def federate(name, broker, step_size):
    """A federate with the given communication step in s that has not been initialised yet."""
    info = helics.helicsCreateFederateInfo()
    helics.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
    helics.helicsFederateInfoSetCoreInitString(info, f"--federates=1 --broker_address={broker} --loglevel=error")
    helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_PERIOD, step_size)
    instance = helics.helicsCreateValueFederate(name, info)
    try:
        yield instance
    finally:
        helics.helicsFederateDisconnect(instance)
        helics.helicsFederateDestroy(instance)


def advance(instance, step_size, steps, step, publish):
    """Does the steps.

    What was published at the beginning of a step arrives when the time of its end is granted. So a federate does its
    step when its end is granted, with what was published at its beginning: all step at once, as in a Jacobi master.
    """
    for k in range(steps):
        end = (k + 1) * step_size
        granted = helics.helicsFederateRequestTime(instance, end)
        if abs(granted - end) > 1e-9:
            raise RuntimeError(f"HELICS granted {granted} s instead of {end} s: has the other federate ended?")
        step(k * step_size)
        publish()
