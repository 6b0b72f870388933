"""The process of the controller: two FMUs, its setpoint among them, as one HELICS federate. `run.py` starts it."""

import argparse

import helics
from federate import advance, federate, fmu

TRAJECTORY = ("setpoint", "setpoint_velocity", "setpoint_acceleration")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reference", help="ReferenceTrajectory.fmu")
    parser.add_argument("controller", help="PidFeedForward.fmu")
    parser.add_argument("--pressure", type=float, required=True, help="gauge pressure at the start in Pa")
    parser.add_argument("--broker", default="localhost", help="address of the broker")
    parser.add_argument("--step-size", type=float, default=1e-3, help="in s")
    parser.add_argument("--steps", type=int, default=6000)
    arguments = parser.parse_args()
    with (fmu(arguments.reference) as reference, fmu(arguments.controller) as controller,
          federate("controller", arguments.broker, arguments.step_size) as instance):
        publication = helics.helicsFederateRegisterGlobalPublication(
            instance, "command", helics.HELICS_DATA_TYPE_DOUBLE, "V")
        contraction = helics.helicsFederateRegisterSubscription(instance, "measured.contraction", "m")
        controller.set("initial.gauge_pressure", arguments.pressure)

        def take_inputs(setpoints):
            for name, value in zip(TRAJECTORY, setpoints, strict=True):
                controller.set(name, value)
            controller.set("measured_contraction", helics.helicsInputGetDouble(contraction))

        def publish():
            helics.helicsPublicationPublishDouble(publication, controller.get("command"))

        def step(time):
            take_inputs([reference.get(name) for name in TRAJECTORY])
            for part in (reference, controller):
                part.slave.doStep(time, arguments.step_size)

        helics.helicsFederateEnterInitializingMode(instance)
        helics.helicsFederateEnterExecutingMode(instance)
        take_inputs([reference.get(name) for name in TRAJECTORY])
        for part in (reference, controller):
            part.slave.exitInitializationMode()
        publish()
        advance(instance, arguments.step_size, arguments.steps, step, publish)


if __name__ == "__main__":
    main()
