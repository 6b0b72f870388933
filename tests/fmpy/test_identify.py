"""Identified parameters export and simulate; the report of a comparison opens and draws in a browser."""

import json

import pytest
from fmpy import simulate_fmu

from support import ROOT, run
from test_report import Browser

MAPS = ROOT / "data" / "real" / "map"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.mark.parametrize("model", ["virtual-area", "improved-mckibben", "mooney-rivlin"])
def test_identified_parameters_export_and_simulate(sinew, tmp_path, model):
    name = "dmsp_20_300"
    given = MAPS / f"{name}.toml"
    run(sinew, "identify", MAPS / f"{name}.csv", "--parameters", given, "--model", model, "--out", tmp_path)
    found = json.loads((tmp_path / "identification.json").read_text())
    assert found["model"] == model and found["errors"]["all"]["rms"] < 0.05 * 1654
    run(sinew, "export", "--parameters", tmp_path / "parameters.toml", "--out", tmp_path / "fmus")
    # Points at rest tell no damping: the file says none, and a load would swing for ever.
    result = simulate_fmu(str(tmp_path / "fmus" / "PneumaticMuscle.fmu"), stop_time=10.0,
                          start_values={"valve.command": 4.0, "initial.gauge_pressure": 2e5, "muscle.damping": 80.0},
                          output=["muscle.contraction", "muscle.force"])
    # At the end the load hangs still: the muscle pulls its weight.
    mass = next(float(line.split()[2]) for line in (tmp_path / "parameters.toml").read_text().splitlines()
                if line.startswith("mass = "))
    assert result["muscle.force"][-1] == pytest.approx(9.81 * mass, rel=1e-3)


def test_replay_with_identified_parameters(sinew, tmp_path):
    recording = ROOT / "data" / "prescribed_motion.csv"
    run(sinew, "identify", recording, "--out", tmp_path / "found")
    answer = run(sinew, "simulate", recording, "--parameters", tmp_path / "found" / "parameters.toml", "--out",
                 tmp_path / "replay", "--json")
    errors = {row["signal"]: row["rms"] for row in json.loads(answer.stdout)["errors"]}
    assert errors["force"] < 10


def test_report_of_a_comparison(sinew, tmp_path, browser):
    run(sinew, "compare", "--muscle", f"{MAPS}/dmsp_20_300.toml={MAPS}/dmsp_20_300.csv", "--muscle",
        f"dmsp-40-1000={ROOT}/data/reconstructed/dmsp_40_1000_reconstructed.csv", "--out", tmp_path)
    browser.open(tmp_path / "report.html")
    assert browser.problems == []
    shown = "[...document.querySelectorAll('[data-figure]')].filter(f => !f.hidden)"
    figures = browser.evaluate(f"{shown}.map(f => f.dataset.figure)")
    # The map has no loads that were held, the reconstructed muscle has.
    assert figures.count("isometric") == 2 and figures.count("isotonic") == 1
    assert browser.evaluate(f"{shown}.every(f => f.querySelector('canvas').width > 0)")
    assert browser.evaluate("document.body.innerText.includes('(reconstructed)')")
    before = browser.evaluate("document.querySelector('[data-plot=residual] canvas').toDataURL()")
    browser.evaluate("(() => { const s = document.querySelector('select'); s.value = '5'; s.onchange(); })()")
    browser.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert browser.evaluate("document.querySelector('[data-plot=residual] canvas').toDataURL()") != before
    assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth")
