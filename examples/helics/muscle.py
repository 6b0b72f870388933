"""The process of the muscle: PneumaticMuscle.fmu as a HELICS federate. `run.py` starts it."""

import argparse

import helics
from federate import advance, federate, fmu


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fmu", help="PneumaticMuscle.fmu")
    parser.add_argument("--pressure", type=float, required=True, help="gauge pressure at the start in Pa")
    parser.add_argument("--broker", default="localhost", help="address of the broker")
    parser.add_argument("--step-size", type=float, default=1e-3, help="in s")
    parser.add_argument("--steps", type=int, default=6000)
    parser.add_argument("--out", default="muscle.csv", help="course of the contraction")
    arguments = parser.parse_args()
    with fmu(arguments.fmu) as muscle, federate("muscle", arguments.broker, arguments.step_size) as instance:
        publication = helics.helicsFederateRegisterGlobalPublication(
            instance, "measured.contraction", helics.HELICS_DATA_TYPE_DOUBLE, "m")
        command = helics.helicsFederateRegisterSubscription(instance, "command", "V")
        muscle.set("initial.gauge_pressure", arguments.pressure)
        rows = []

        def publish():
            rows.append(muscle.get("measured.contraction"))
            helics.helicsPublicationPublishDouble(publication, rows[-1])

        def step(time):
            muscle.set("valve.command", helics.helicsInputGetDouble(command))
            muscle.slave.doStep(time, arguments.step_size)

        helics.helicsFederateEnterInitializingMode(instance)
        publish()  # the controller starts with it
        helics.helicsFederateEnterExecutingMode(instance)
        muscle.slave.exitInitializationMode()
        advance(instance, arguments.step_size, arguments.steps, step, publish)
    with open(arguments.out, "w") as file:
        file.write("time [s],contraction [m]\n")
        file.writelines(f"{k * arguments.step_size!r},{value!r}\n" for k, value in enumerate(rows))


if __name__ == "__main__":
    main()
