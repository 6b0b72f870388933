"""The closed loop as a system of FMUs: valid, and it runs in FMPy."""

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from lxml import etree

from support import run

SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureDescription.xsd"


@pytest.fixture(scope="module")
def system(sinew, tmp_path_factory):
    folder = tmp_path_factory.mktemp("system")
    run(sinew, "export", "--out", folder)
    return folder / "ClosedLoop.ssp"


def test_description_follows_the_schema(system):
    with zipfile.ZipFile(system) as archive:
        description = etree.fromstring(archive.read("SystemStructure.ssd"))
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    assert schema.validate(description), schema.error_log


def test_the_loop_follows_its_reference(system):
    result = simulate_ssp(str(system), stop_time=8.0, step_size=1e-3)
    error = result["reference.setpoint"] - result["muscle.measured.contraction"]
    assert result["reference.setpoint"][-1] == pytest.approx(0.15)
    assert np.abs(error).max() < 1e-3, "the load must start at rest on the reference and stay near it"
    assert abs(error[-1]) < 1e-5
