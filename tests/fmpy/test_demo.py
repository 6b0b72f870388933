"""The demonstration: it finds the dry friction in the recording that ships, and the extended FMU is the better one."""

import csv
import json
import re

import numpy as np
import pytest

from support import ROOT, Fmu, Instance, follow, read_csv, run


@pytest.fixture(scope="module")
def folder(sinew, tmp_path_factory):
    """Where the demonstration put its diagnosis."""
    out = tmp_path_factory.mktemp("demo") / "out"
    run(sinew, "demo", "--out", out, cwd=tmp_path_factory.mktemp("elsewhere"))
    (found,) = out.rglob("diagnosis.json")
    return found.parent


@pytest.fixture(scope="module")
def diagnosis(folder):
    return json.loads((folder / "diagnosis.json").read_text())


def test_names_dry_friction_and_nothing_else(diagnosis):
    assert diagnosis["verdict"] in ("explained", "partly_explained")
    assert [cause["effect"] for cause in diagnosis["causes"]] == ["friction_hysteresis"]


def test_says_how_much(diagnosis):
    """The recording was made with 12.67 N per bar of gauge pressure."""
    (cause,) = diagnosis["causes"]
    assert cause["sentence"].endswith(".") and "\n" not in cause["sentence"]
    assert cause["parameters"]
    for name, parameter in cause["parameters"].items():
        assert name.startswith("friction_hysteresis.")
        assert parameter["low"] <= parameter["value"] <= parameter["high"]
        assert parameter["unit"]
    values = {name.split(".")[1]: parameter["value"] for name, parameter in cause["parameters"].items()}
    at_three_bar = values.get("half_width", 0.0) + 3e5 * values.get("half_width_per_pressure", 0.0)
    assert at_three_bar == pytest.approx(38.0, rel=0.2)


def test_gains_on_samples_that_the_fit_never_saw(diagnosis, note):
    note(f"demo: {diagnosis['verdict']}, improvement {diagnosis['improvement']:.3f} on {diagnosis['held_out']}")
    assert diagnosis["improvement"] > 0.5
    assert diagnosis["held_out"]
    for signal in diagnosis["signals"].values():
        assert signal["unit"] and signal["noise_rms"] > 0.0
    assert diagnosis["signals"]["contraction"]["extended_rms"] < diagnosis["signals"]["contraction"]["nominal_rms"]


def test_everything_is_beside_the_diagnosis(folder):
    for name in ("report.html", "extended.toml", "PneumaticMuscle.fmu", "simulated.csv"):
        assert (folder / name).stat().st_size > 0, name


def test_report_opens_offline(folder):
    """One file: plots inside, nothing loaded from elsewhere."""
    page = (folder / "report.html").read_text()
    assert "friction_hysteresis" in page or "ry friction" in page
    assert "<svg" in page
    assert not [word for word in ("<link", "<script src", 'src="http', "@import") if word in page]


def test_extended_parameters_export_the_extended_fmu(folder, sinew, tmp_path):
    run(sinew, "export", "--parameters", folder / "extended.toml", "--out", tmp_path)
    exported = (tmp_path / "PneumaticMuscle.fmu").read_bytes()
    assert exported == (folder / "PneumaticMuscle.fmu").read_bytes()


def replay_error(fmu, recording):
    """Root mean square of the contraction's residual in m, recording replayed through the FMU."""
    start = {"load.mass": recording["load_mass"][0], "initial.gauge_pressure": 1e5 * recording["command"][0]}
    with Instance(fmu, start) as instance:
        simulated = follow(instance, recording["time"], recording["command"], ["muscle.contraction"])[:, 0]
    residual = 1e-3 * recording["contraction"] - simulated  # recorded in mm
    return np.sqrt(np.nanmean(residual**2))


@pytest.mark.parametrize("mass", [20, 60])
def test_extended_fmu_is_nearer_to_the_recording(folder, muscle, note, mass):
    recording = read_csv(ROOT / "data" / f"dry_friction_{mass}kg.csv")
    nominal = replay_error(muscle, recording)
    extended = replay_error(Fmu(folder / "PneumaticMuscle.fmu"), recording)
    note(f"replay of dry_friction_{mass}kg.csv: {1e3 * nominal:.2f} mm nominal, {1e3 * extended:.2f} mm extended")
    assert extended < 0.7 * nominal


OUTPUTS = ("gauge_pressure", "contraction", "force")


@pytest.mark.parametrize("mass", [20, 60])
def test_tool_and_fmu_simulate_alike(folder, muscle, mass):
    """What the report shows of the nominal and of the extended model is what the two FMUs do."""
    recording = read_csv(ROOT / "data" / f"dry_friction_{mass}kg.csv")
    for model, fmu in (("nominal", muscle), ("extended", Fmu(folder / "PneumaticMuscle.fmu"))):
        shown = columns_of(folder / "simulated.csv", f"dry_friction_{mass}kg.csv", model)
        start = {"load.mass": recording["load_mass"][0], "initial.gauge_pressure": shown[0, 0]}
        with Instance(fmu, start) as instance:
            names = [f"measured.{name}" for name in OUTPUTS]
            simulated = follow(instance, recording["time"], recording["command"], names)
        assert simulated.shape == shown.shape
        assert (np.abs(simulated - shown).max(axis=0) <= 1e-6 * np.abs(shown).max(axis=0)).all()


def test_replay_through_the_extended_fmu_gives_the_reported_error(folder):
    """On the samples that no fit saw, which the answer names."""
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    squares = {name: [] for name in OUTPUTS}
    for part in diagnosis["held_out"].split(", "):
        name, start = re.fullmatch(r"(.*) from (.*) s", part).groups()
        recording = read_csv(ROOT / "data" / name)
        shown = columns_of(folder / "simulated.csv", name, "extended")
        with Instance(Fmu(folder / "PneumaticMuscle.fmu"),
                      {"load.mass": recording["load_mass"][0], "initial.gauge_pressure": shown[0, 0]}) as instance:
            names = [f"measured.{output}" for output in OUTPUTS]
            simulated = follow(instance, recording["time"], recording["command"], names)
        unseen = recording["time"] >= float(start)
        for k, (output, unit) in enumerate(zip(OUTPUTS, (1e5, 1e-3, 1.0), strict=True)):  # recorded in bar, mm, N
            squares[output].append(((unit * recording[output] - simulated[:, k]) ** 2)[unseen])
    for output in OUTPUTS:
        error = np.sqrt(np.nanmean(np.concatenate(squares[output])))
        assert error == pytest.approx(diagnosis["signals"][output]["extended_rms"], rel=0.01), output


def columns_of(path, recording, model):
    """Simulated signals of one recording, of shape (n_samples, n_outputs)."""
    units = dict(gauge_pressure="Pa", contraction="m", force="N")
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["recording"] == recording]
    return np.array([[float(row[f"{model}_{name} [{units[name]}]"]) for name in OUTPUTS] for row in rows])


def test_recording_says_friction_to_the_diagnosis_too(sinew, tmp_path):
    """The demonstration does nothing that `sinew diagnose` does not."""
    recordings = [ROOT / "data" / f"dry_friction_{mass}kg.csv" for mass in (20, 60)]
    run(sinew, "diagnose", *recordings, "--out", tmp_path / "out")
    diagnosis = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert [cause["effect"] for cause in diagnosis["causes"]] == ["friction_hysteresis"]


def test_nothing_is_wrong_with_the_nominal_recording(sinew, tmp_path):
    run(sinew, "diagnose", ROOT / "data" / "nominal_40kg.csv", "--out", tmp_path / "out")
    diagnosis = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert (diagnosis["verdict"], diagnosis["causes"]) == ("nominal", [])
