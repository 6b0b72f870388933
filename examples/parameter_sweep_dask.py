"""Simulates a muscle with many combinations of load and valve on all cores, or on many machines.

    sinew export --out fmus
    python parameter_sweep_dask.py fmus/PneumaticMuscle.fmu --out sweep.csv
    python parameter_sweep_dask.py fmus/PneumaticMuscle.fmu --out sweep.csv --scheduler tcp://host:8786

Needs fmpy, numpy and distributed (pip). Every worker loads the FMU once and makes one instance, which fmi2Reset brings
back to its beginning for each case. A worker that is lost is replaced, and what it had not delivered is done anew. The
results are those of `--serial`, bit for bit and in the same order.
"""

import argparse
import csv
import itertools
import tempfile
from pathlib import Path

import fmpy
import numpy as np
from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
from fmpy.fmi2 import FMU2Slave

STEP_SIZE, DURATION = 1e-3, 8.0  # s
START_PRESSURE = 1.5e5  # Pa
COMMAND = 2.5  # V, from 1.5 V on
MASSES = np.linspace(20.0, 80.0, 7)  # kg
BANDWIDTHS = 2.0 * np.pi * np.array([1.0, 2.5, 5.0, 10.0])  # rad/s
CASES = [{"load.mass": float(mass), "valve.bandwidth": float(bandwidth)}
         for mass, bandwidth in itertools.product(MASSES, BANDWIDTHS)]


class Muscle(WorkerPlugin):
    """One instance of the FMU; Dask sets one up on every worker, also on those that come later."""

    name = "muscle"

    def __init__(self, fmu):
        self.fmu = fmu  # its bytes: workers on other machines do not see our files

    def setup(self, worker=None):
        self.folder = tempfile.TemporaryDirectory()
        path = Path(self.folder.name) / "model.fmu"
        path.write_bytes(self.fmu)
        description = fmpy.read_model_description(str(path))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.slave = FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path), self.folder.name),
                               modelIdentifier=description.coSimulation.modelIdentifier, instanceName="muscle")
        self.slave.instantiate()

    def teardown(self, worker=None):
        self.slave.freeInstance()
        self.folder.cleanup()

    def set(self, values):
        self.slave.setReal([self.references[name] for name in values], list(values.values()))

    def simulate(self, case):
        """Contraction after a step of the command: how far it goes in m, how far beyond, when it stays within 2 %."""
        self.slave.reset()
        self.set({"initial.gauge_pressure": START_PRESSURE, "valve.command": COMMAND, **case})
        self.slave.setupExperiment()
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        reference = [self.references["muscle.contraction"]]
        contraction = self.slave.getReal(reference)
        times = STEP_SIZE * np.arange(round(DURATION / STEP_SIZE))
        for time in times:
            self.slave.doStep(time, STEP_SIZE)
            contraction += self.slave.getReal(reference)
        moved = np.array(contraction) - contraction[0]
        outside = np.flatnonzero(np.abs(moved - moved[-1]) > 0.02 * abs(moved[-1]))
        return {"way [m]": float(moved[-1]), "overshoot [m]": float(moved.max() - moved[-1]),
                "settling_time [s]": float(STEP_SIZE * (outside[-1] + 1))}


def simulate_here(case):
    """Runs on a worker."""
    return get_worker().plugins["muscle"].simulate(case)


def sweep(client, fmu, cases, on_result=lambda done: None):
    """Results of the cases, in their order; `on_result` is told how many there are."""
    client.register_plugin(Muscle(fmu))
    futures = {client.submit(simulate_here, case, pure=False): place for place, case in enumerate(cases)}
    results = {}
    for future, result in as_completed(futures, with_results=True):
        results[futures[future]] = result
        future.release()  # it has been delivered: a worker that is lost now takes nothing along
        on_result(len(results))
    return [results[place] for place in range(len(cases))]


def sweep_serially(fmu, cases):
    """The same without Dask."""
    muscle = Muscle(fmu)
    muscle.setup()
    try:
        return [muscle.simulate(case) for case in cases]
    finally:
        muscle.teardown()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fmu", type=Path, help="PneumaticMuscle.fmu")
    parser.add_argument("--out", type=Path, default=Path("sweep.csv"), help="table")
    parser.add_argument("--workers", type=int, help="processes on this machine; as many as it has cores if not given")
    parser.add_argument("--scheduler", help="address of a running Dask scheduler")
    parser.add_argument("--serial", action="store_true", help="one case after the other, without Dask")
    arguments = parser.parse_args()
    fmu = arguments.fmu.read_bytes()
    if arguments.serial:
        results = sweep_serially(fmu, CASES)
    elif arguments.scheduler:
        with Client(arguments.scheduler) as client:
            client.upload_file(__file__)
            results = sweep(client, fmu, CASES)
    else:
        with LocalCluster(n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None) as cluster:
            with Client(cluster) as client:
                results = sweep(client, fmu, CASES)
    with arguments.out.open("w", newline="") as file:
        rows = [case | result for case, result in zip(CASES, results, strict=True)]
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    slowest = max(rows, key=lambda row: row["settling_time [s]"])
    print(f"{len(rows)} cases; the slowest settles after {slowest['settling_time [s]']:.3f} s, "
          f"with {slowest['load.mass']:g} kg and {slowest['valve.bandwidth']:.2f} rad/s; see {arguments.out}")


if __name__ == "__main__":
    main()
