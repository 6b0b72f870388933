"""The library that runs on old systems: built with zig as linker, it needs no glibc newer than 2.17."""

import re

import numpy as np
import pytest
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

from support import ROOT, TARGET, Instance, run

OLDEST_GLIBC = (2, 17)
TRIPLE = "x86_64-unknown-linux-gnu"


@pytest.fixture(scope="session")
def library():
    version = ".".join(map(str, OLDEST_GLIBC))
    run("cargo", "zigbuild", "--package", "sinew-fmu", "--lib", "--profile", "fmu", "--target", f"{TRIPLE}.{version}",
        cwd=ROOT)
    return TARGET / TRIPLE / "fmu" / "libsinew_fmu.so"


def needed_versions(path):
    """Versions of symbols that a library needs, as `GLIBC_2.14`."""
    with open(path, "rb") as file:
        sections = [s for s in ELFFile(file).iter_sections() if isinstance(s, GNUVerNeedSection)]
        return {need.name for section in sections for _, needs in section.iter_versions() for need in needs}


def needed_libraries(path):
    with open(path, "rb") as file:
        tags = ELFFile(file).get_section_by_name(".dynamic").iter_tags()
        return {tag.needed for tag in tags if tag.entry.d_tag == "DT_NEEDED"}


def test_needs_no_newer_glibc(library, note):
    versions = [re.fullmatch(r"GLIBC_(\d+)\.(\d+)(\.\d+)?", name) for name in needed_versions(library)]
    versions = [(int(match[1]), int(match[2])) for match in versions if match]
    note("portable library: newest symbol needed is of glibc {}.{}".format(*max(versions)))
    assert max(versions) <= OLDEST_GLIBC


def test_needs_only_the_c_library(library):
    assert needed_libraries(library) <= {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "libgcc_s.so.1",
                                         "librt.so.1", "ld-linux-x86-64.so.2"}


def test_is_small(library, note):
    note(f"portable library: {library.stat().st_size / 2**20:.2f} MiB")
    assert library.stat().st_size < 2 * 2**20


def test_is_stripped(library):
    with open(library, "rb") as file:
        assert ELFFile(file).get_section_by_name(".symtab") is None


@pytest.mark.parametrize("model", ["PneumaticMuscle", "PidFeedForward"])
def test_gives_the_same_numbers(export, library, model):
    fmus = export(), export(options=("--library", f"linux64={library}"))
    assert fmus[1][model].path.stat().st_size > 0
    tables = [simulate(which[model]) for which in fmus]
    # Not to the last bit: the mathematical functions may come from different libraries.
    assert (np.abs(tables[1] - tables[0]).max(axis=0) <= 1e-9 * np.abs(tables[0]).max(axis=0)).all()


def simulate(fmu):
    with Instance(fmu, {"load.mass": 40.0, "initial.gauge_pressure": 2e5}) as instance:
        table = []
        for step in range(1000):
            instance.set({name: 0.01 * step for name in fmu.names("input")[:1]})
            instance.step(1e-3)
            table.append(instance.get(*fmu.names("output")))
    return np.array(table)
