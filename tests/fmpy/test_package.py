"""The FMU files: valid by every checker at hand, complete, and the same bytes every time."""

import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from support import MODELS, ROOT, run

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


def contents(path):
    """Files of a zip by name."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def test_fmpy_finds_nothing_wrong(fmu):
    assert validate_fmu(str(fmu.path)) == []


def test_fmutool_finds_nothing_wrong(fmu):
    done = run("fmutool", "-input", fmu.path, "-check")
    said = done.stdout + done.stderr
    assert "seems to be compliant with FMI-2.0" in said, said
    assert "No semantic error against the FMI-2 standard" in said, said


def test_description_follows_the_schema(fmu):
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    description = etree.fromstring(contents(fmu.path)["modelDescription.xml"])
    assert schema.validate(description), schema.error_log


def test_committed_description_is_the_exported_one(fmu):
    committed = ROOT / "modelDescription" / f"{fmu.description.modelName}.xml"
    assert committed.read_bytes() == contents(fmu.path)["modelDescription.xml"]


def test_everything_is_in_it(fmu):
    files = contents(fmu.path)
    library = f"binaries/linux64/{fmu.description.coSimulation.modelIdentifier}.so"
    fixed = {"modelDescription.xml", library, "documentation/index.html", "model.png", "resources/parameters.toml"}
    assert fixed <= files.keys()
    assert files[library].startswith(b"\x7fELF")
    assert files["model.png"].startswith(b"\x89PNG")
    assert fmu.description.modelName in files["documentation/index.html"].decode()
    licences = [name for name in files if name.startswith("documentation/licenses/") and files[name].strip()]
    assert licences


def test_documentation_names_every_variable(fmu):
    page = contents(fmu.path)["documentation/index.html"].decode()
    assert [name for name in fmu.variables if name not in page] == []


@pytest.mark.parametrize("preset", ["dmsp-40-1000", "dmsp-40-290/improved-mckibben/thesis"])
def test_same_input_same_bytes(sinew, tmp_path, preset):
    for folder in ("first", "second"):
        run(sinew, "export", "--parameters", preset, "--out", tmp_path / folder)
    for model in MODELS:
        first, second = (tmp_path / folder / f"{model}.fmu" for folder in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()


def test_start_values_are_those_of_the_parameters(export):
    starts = {"load.mass": 33.25, "friction_hysteresis.half_width": 41.2, "valve.bandwidth": 2.5}
    fmu = export(parameters=starts)["PneumaticMuscle"]
    assert {name: float(fmu.variables[name].start) for name in starts} == starts
    assert 'half_width = 41.2' in contents(fmu.path)["resources/parameters.toml"].decode()


def test_exported_parameters_do_not_change_the_guid(export):
    """The nominal and the extended FMU are the same binary."""
    extended = export(parameters={"load.mass": 33.25})
    assert {m: f.description.guid for m, f in export().items()} == {m: f.description.guid for m, f in extended.items()}


def test_guids_differ_between_models(export):
    assert len({fmu.description.guid for fmu in export().values()}) == len(MODELS)
