"""The closed loop in two processes, which may run on different machines: a HELICS broker between muscle and controller.

    sinew export --out fmus
    python helics/run.py fmus --out muscle.csv

Needs fmpy and helics (pip). On two machines: `helics_broker --federates=2` on one, and `muscle.py` and `controller.py`,
each with `--broker ADDRESS` and the `--pressure` that is printed here, where they belong.
"""

import argparse
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import helics

HERE = Path(__file__).parent


def start_pressure(ssp):
    """Gauge pressure in Pa at which the load rests where the reference starts, from ClosedLoop.ssp."""
    with zipfile.ZipFile(ssp) as archive:
        system = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    name = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
    (parameter, *_) = (node for node in system.iter(f"{name}Parameter") if node.get("name") == "initial.gauge_pressure")
    return float(parameter.find(f"{name}Real").get("value"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fmus", type=Path, help="folder that sinew export wrote")
    parser.add_argument("--step-size", type=float, default=1e-3, help="in s")
    parser.add_argument("--steps", type=int, default=6000)
    parser.add_argument("--out", default="muscle.csv", help="course of the contraction")
    arguments = parser.parse_args()
    pressure = start_pressure(arguments.fmus / "ClosedLoop.ssp")
    common = ["--pressure", repr(pressure), "--step-size", repr(arguments.step_size), "--steps", str(arguments.steps)]
    broker = helics.helicsCreateBroker("zmq", "", "--federates=2 --loglevel=error")
    processes = [subprocess.Popen([sys.executable, str(HERE / program), *options, *common]) for program, options in (
        ("muscle.py", [str(arguments.fmus / "PneumaticMuscle.fmu"), "--out", arguments.out]),
        ("controller.py", [str(arguments.fmus / f"{name}.fmu") for name in ("ReferenceTrajectory", "PidFeedForward")]))]
    while any(process.poll() is None for process in processes):
        if any(process.poll() for process in processes):  # one has failed: the other would wait for it for ever
            for process in processes:
                process.terminate()
        time.sleep(0.02)
    failed = any(process.returncode for process in processes)
    helics.helicsBrokerDisconnect(broker)
    helics.helicsCloseLibrary()
    if failed:
        sys.exit("a federate has failed; its messages are above")
    print(f"started at {pressure:.1f} Pa; see {arguments.out}")


if __name__ == "__main__":
    main()
