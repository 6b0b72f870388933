//! What `sinew plan` proposes for effects that some recordings cannot tell apart.

use sinew::diagnosis::DEFAULT_TOLERANCE;
use sinew::diagnosis::plan::{self, ENOUGH, Limits, Need, Plan, Task, files};
use sinew::measurement::{Recording, Signal};
use sinew::parameters::Parameters;
use sinew::simulation::replay;
use std::path::Path;

fn limits(load_masses: &[f64]) -> Limits {
    Limits { most_pressure: 4e5, most_contraction: Some(0.2), load_masses: load_masses.to_vec(), duration: 40.0 }
}

fn planned(effects: &[&str], sensors: &[Signal], limits: &Limits) -> Plan {
    let names: Vec<String> = effects.iter().map(|name| (*name).to_owned()).collect();
    let task = Task::of_effects(&names, sensors, &Parameters::default()).unwrap();
    let found = plan::plan(&task, &Parameters::default(), DEFAULT_TOLERANCE, limits, &|_| ()).unwrap();
    println!("{}\n{:#?}", found.sentence(), found.compared);
    found
}

#[test]
fn a_wrong_load_and_a_wrong_force_take_a_second_load() {
    let pair = ["payload_mass", "force_gain"];
    let sensors = [Signal::GaugePressure, Signal::Contraction];
    let one = planned(&pair, &sensors, &limits(&[20.0]));
    assert!(one.needs.iter().any(|need| matches!(need, Need::Load(_))), "{:?}", one.needs);
    let two = planned(&pair, &sensors, &limits(&[20.0, 40.0]));
    assert!(two.needs.is_empty() && two.confused().next().is_none());
    let masses: Vec<_> = two.runs.iter().filter_map(|run| run.place.load_mass()).collect();
    assert_eq!(masses, [20.0, 40.0]);
}

#[test]
fn a_late_valve_and_a_late_sensor_take_a_pressure_sensor() {
    let found =
        planned(&["valve_dead_time", "contraction_sensor_delay"], &[Signal::Contraction], &limits(&[20.0, 40.0]));
    assert_eq!(found.needs, [Need::Sensor(Signal::GaugePressure)]);
    assert!(found.pairs[0].lambda > ENOUGH);
}

#[test]
fn two_gains_of_the_pressure_take_another_sensor_or_a_reference() {
    let found = planned(&["valve_gain", "pressure_sensor_gain"], &[Signal::GaugePressure], &limits(&[20.0, 40.0]));
    let asks = found.needs.iter().any(|need| matches!(need, Need::Sensor(_)));
    assert!(asks || found.sentence().contains("a reference"), "{}", found.sentence());
}

#[test]
fn a_plan_respects_the_limits_and_reads_back() {
    let limits = limits(&[20.0, 40.0]);
    let found = planned(&["friction_hysteresis", "viscous_damping"], &[Signal::Contraction], &limits);
    assert!(found.confused().next().is_none());
    let written = files(&found, &Parameters::default(), Path::new("out"));
    for run in &found.runs {
        let (_, bytes) = written.iter().find(|(path, _)| path.ends_with(&run.file)).unwrap();
        // As the rig completes it: with what the sensor showed.
        let text = String::from_utf8(bytes.clone()).unwrap();
        let filled: Vec<String> = text
            .lines()
            .enumerate()
            .map(|(k, line)| format!("{line},{}", if k == 0 { "force [N]" } else { "1" }))
            .collect();
        let recording = Recording::parse(filled.join("\n").as_bytes(), Path::new("plan.csv"), &[]).unwrap();
        assert!(recording.notes.is_empty() && recording.time.windows(2).all(|t| (t[1] - t[0] - 0.01).abs() < 1e-9));
        for rival in &found.rivals {
            let shown = replay(&rival.model, &recording).unwrap();
            let largest = |signal| shown.get(signal).unwrap().iter().copied().fold(f64::MIN, f64::max);
            assert!(largest(Signal::GaugePressure) <= 1.005 * limits.most_pressure);
            assert!(run.place.load_mass().is_none() || largest(Signal::Contraction) <= 1.005 * 0.2);
        }
    }
}

#[test]
fn a_sensor_that_is_named_twice_counts_once() {
    let names = ["payload_mass", "force_gain"].map(str::to_owned);
    let of = |sensors: &[Signal]| Task::of_effects(&names, sensors, &Parameters::default()).unwrap().sensors;
    assert_eq!(of(&[Signal::Force, Signal::Contraction, Signal::Force]), of(&[Signal::Contraction, Signal::Force]));
}

#[test]
fn limits_that_leave_nothing_are_refused_with_a_sentence() {
    let task = Task::of_effects(&["creep".to_owned(), "leakage".to_owned()], &[Signal::Force], &Parameters::default());
    let limits = Limits { most_pressure: 1e4, ..limits(&[80.0]) };
    let refused = plan::plan(&task.unwrap(), &Parameters::default(), DEFAULT_TOLERANCE, &limits, &|_| ()).unwrap_err();
    assert!(refused.to_string().contains("the limits leave no experiment"), "{refused}");
}

#[test]
fn limits_without_sense_are_refused_by_option() {
    let usual = || limits(&[20.0, 40.0]);
    let cases = [
        (Limits { most_pressure: 1e9, ..usual() }, "`--most-pressure` is 1000000000 Pa, allowed is 0 to 2000000 Pa"),
        (Limits { most_pressure: f64::NAN, ..usual() }, "`--most-pressure` is NaN Pa"),
        (Limits { most_contraction: Some(5.0), ..usual() }, "`--most-contraction` is 5 m, allowed is 0.0098"),
        (Limits { most_contraction: Some(-0.1), ..usual() }, "`--most-contraction` is -0.1 m"),
        (Limits { duration: f64::INFINITY, ..usual() }, "`--duration` is inf s, allowed is 1 to 3600 s"),
        (limits(&[20.0, 0.0]), "`--load-mass` is 0 kg, allowed is 0.001 to 100000 kg"),
        (limits(&[20.0, 40.0, 20.0]), "--load-mass: 20 kg stands there twice"),
        (limits(&[]), "--load-mass: give at least one load"),
    ];
    let sensors = [Signal::Contraction];
    let task = Task::of_effects(&["creep".to_owned(), "leakage".to_owned()], &sensors, &Parameters::default()).unwrap();
    for (limits, expected) in cases {
        let refused = plan::plan(&task, &Parameters::default(), DEFAULT_TOLERANCE, &limits, &|_| ()).unwrap_err();
        assert!(refused.to_string().starts_with(expected), "{refused} should start with {expected}");
    }
}

/// What is said of a diagnosis in which a value was changed.
fn refusal(change: impl Fn(&mut serde_json::Value)) -> String {
    let mut diagnosis = serde_json::json!({
        "verdict": "explained", "tolerance": 0.03, "signals": { "contraction": { "noise_rms": 1e-4 } },
        "causes": [{ "effect": "creep", "alternatives": ["leakage"], "parameters": {}, "rivals": { "leakage": { "leakage.rate": 0.1 } } }],
    });
    change(&mut diagnosis);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diagnosis.json");
    std::fs::write(folder.path().join("extended.toml"), "").unwrap();
    std::fs::write(&path, format!("\u{feff}{diagnosis}")).unwrap();
    let said =
        Task::of_diagnosis(&path, &Parameters::default()).map_or_else(|error| error.to_string(), |_| String::new());
    said.replace(&path.display().to_string(), "FILE")
}

#[test]
fn a_diagnosis_that_does_not_fit_is_refused_by_file_and_key() {
    use serde_json::{Value, json};
    assert_eq!(refusal(|_| ()), "");
    let cases: [(&str, Value, &str); 12] = [
        ("/tolerance", json!(-1), "`tolerance`: a share between 0 and 1 belongs here, not -1"),
        ("/tolerance", json!(1e9), "`tolerance`: a share"),
        ("/tolerance", json!("x"), "`tolerance`: a number belongs here, not \"x\""),
        ("/verdict", json!("foo"), "`verdict`: there is no verdict \"foo\""),
        ("/causes", Value::Null, "`causes`: a list belongs here, not nothing"),
        ("/causes", json!("friction"), "`causes`: a list belongs here"),
        ("/causes/0/effect", json!("nope"), "`causes[0].effect`: there is no effect `nope`"),
        ("/causes/0/alternatives/0", json!("nope"), "`causes[0].alternatives`: there is no effect `nope`"),
        ("/causes/0/rivals/leakage/leakage.rate", Value::Null, "`causes[0].rivals.leakage.leakage.rate`: a number"),
        (
            "/causes/0/rivals/leakage/leakage.rate",
            json!(-1e9),
            "`causes[0].rivals.leakage.leakage.rate`: `leakage.rate` is",
        ),
        ("/signals/contraction/noise_rms", json!(0), "`signals.contraction.noise_rms`: a number above 0"),
        ("/signals/contraction/noise_rms", json!("x"), "`signals.contraction.noise_rms`: a number belongs"),
    ];
    for (place, value, expected) in cases {
        let said = refusal(|diagnosis| *diagnosis.pointer_mut(place).unwrap() = value.clone());
        assert!(said.starts_with(&format!("FILE: {expected}")), "{said} should start with {expected}");
    }
}

#[test]
fn an_earlier_plan_goes_but_not_what_was_recorded_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, header: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("{header}\n")).unwrap();
        path
    };
    let unplayed = write("plan-1.csv", "time [s],command [V],load_mass [kg]");
    let shown = write("plan-1-command.svg", "<svg/>");
    write("plan-2.csv", "time [s],command [V],load_mass [kg],force [N]");
    write("plan-2-command.svg", "<svg/>");
    write("plan-3.csv", "mine");
    let kept = write("plan.csv", "time [s],command [V],load_mass [kg]");
    let mut found = plan::outdated(folder.path(), &[(kept, Vec::new())]);
    found.sort();
    assert_eq!(found, [shown, unplayed]);
}
