"""Builds the tool and exports its FMUs once for all tests."""

import os
import sysconfig
from pathlib import Path

import pytest

from support import MODELS, ROOT, TARGET, Fmu, run, write_parameters

NOTES = pytest.StashKey()


@pytest.fixture(scope="session")
def note(request):
    """Takes a measured number or table, to be shown when all tests have run."""
    return request.config.stash.setdefault(NOTES, []).append


def pytest_terminal_summary(terminalreporter, config):
    if notes := config.stash.get(NOTES, []):
        terminalreporter.section("measured")
        terminalreporter.write("\n".join(notes) + "\n")


@pytest.fixture(scope="session")
def sinew():
    """Path of the `sinew` command, freshly built."""
    try:
        run("cargo", "build", "--release", cwd=ROOT)
    except AssertionError as problem:
        pytest.exit(str(problem), returncode=1)  # once, not for each test
    return TARGET / "release" / "sinew"


class Exporter:
    """Exports FMUs, each set of parameters once."""

    def __init__(self, sinew, folder):
        self.sinew, self.folder, self.fmus = sinew, folder, {}

    def __call__(self, preset="dmsp-40-1000", parameters=None, options=()):
        """The four FMUs of a preset, changed by parameters, by name."""
        key = repr((preset, parameters, options))
        if key not in self.fmus:
            folder = self.folder / str(len(self.fmus))
            folder.mkdir()
            source = write_parameters(folder / "parameters.toml", parameters, preset) if parameters else preset
            run(self.sinew, "export", "--parameters", source, "--out", folder / "fmus", *options)
            self.fmus[key] = {model: Fmu(folder / "fmus" / f"{model}.fmu") for model in MODELS}
        return self.fmus[key]


@pytest.fixture(scope="session")
def export(sinew, tmp_path_factory):
    return Exporter(sinew, tmp_path_factory.mktemp("exported"))


@pytest.fixture(scope="session", params=MODELS)
def fmu(request, export):
    """Each FMU of the default preset in turn."""
    return export()[request.param]


@pytest.fixture(scope="session")
def muscle(export):
    return export()["PneumaticMuscle"]


@pytest.fixture(scope="session")
def cargo_of_importer():
    """Runs cargo on the program in tests/importer, with the libclang of this Python environment."""
    include = run("gcc", "-print-file-name=include").stdout.strip()  # the wheel of libclang has no headers of its own
    environment = os.environ | {
        "LIBCLANG_PATH": str(Path(sysconfig.get_paths()["purelib"]) / "clang" / "native"),
        "BINDGEN_EXTRA_CLANG_ARGS": f"-I{include}",
        "CARGO_TARGET_DIR": str(TARGET / "importer"),
    }

    def cargo(command, *options):
        run("cargo", command, "--locked", *options, cwd=ROOT / "tests" / "importer", env=environment)
    return cargo


@pytest.fixture(scope="session")
def importer(cargo_of_importer):
    """Path of the importer in Rust, freshly built."""
    cargo_of_importer("build")
    return TARGET / "importer" / "debug" / "importer"
