//! The published measurements in `data/real`: signs, units and sizes as a calculation by hand finds them.

use sinew::diagnosis::{DEFAULT_TOLERANCE, diagnose};
use sinew::measurement::Signal::{Contraction, Force, GaugePressure};
use sinew::measurement::{Recording, Signal};
use sinew::parameters::Parameters;
use sinew::quality::notes;
use sinew::simulation::{replay, rms_difference};
use std::path::{Path, PathBuf};

fn real(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/real").join(name)
}

fn load(recording: &str, parameters: &str) -> (Recording, Parameters) {
    let parameters = Parameters::load(&real(parameters).display().to_string()).unwrap();
    (Recording::read(&real(recording), &[]).unwrap(), parameters)
}

/// Measured less simulated.
fn residual(recording: &Recording, parameters: &Parameters, signal: Signal) -> Vec<f64> {
    let replay = replay(parameters, recording).unwrap();
    recording.get(signal).unwrap().iter().zip(replay.get(signal).unwrap()).map(|(m, s)| m - s).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Half the difference of the force residual between shortening and lengthening, N, in the middle of the strokes.
fn half_width(name: &str, parameters: &str) -> f64 {
    let (recording, parameters) = load(&format!("cylinder/{name}.csv"), parameters);
    let contraction = recording.get(Contraction).unwrap();
    let residual = residual(&recording, &parameters, Force);
    let (mut lengthens, mut shortens) = (Vec::new(), Vec::new());
    for k in 4..contraction.len() - 4 {
        let velocity = (contraction[k + 4] - contraction[k - 4]) / (recording.time[k + 4] - recording.time[k - 4]);
        if (0.010..0.035).contains(&contraction[k]) && velocity.abs() > 2e-3 && recording.time[k] > 3.0 {
            if velocity > 0.0 { shortens.push(residual[k]) } else { lengthens.push(residual[k]) }
        }
    }
    (mean(&lengthens) - mean(&shortens)) / 2.0
}

#[test]
fn a_cylinder_pulls_less_when_its_chamber_grows_by_what_a_hand_calculation_gives() {
    for (name, parameters, by_hand) in [
        ("circle_1bar", "cylinder/cylinder_25.toml", 3.97),
        ("circle_3bar", "cylinder/cylinder_25.toml", 5.55),
        ("circle_5bar", "cylinder/cylinder_25.toml", 7.12),
        ("circle_7bar", "cylinder/cylinder_25.toml", 7.95),
        ("nap310_5bar", "cylinder/cylinder_25.toml", 5.15),
        ("x_ring257_7bar", "cylinder/cylinder_25_7.toml", 15.81),
        ("kidney_lc_3bar", "cylinder/cylinder_25.toml", 8.58),
    ] {
        let found = half_width(name, parameters);
        assert!((found - by_hand).abs() < 0.1, "{name}: {found} N, by hand {by_hand} N");
    }
}

#[test]
fn the_nominal_pressure_of_a_shut_chamber_stays() {
    for name in ["aluminium", "prusa", "formlabs", "ultimaker_006", "ultimaker_015", "ultimaker_020"] {
        let (recording, parameters) = load(&format!("chamber/{name}.csv"), "chamber/shut.toml");
        let replay = replay(&parameters, &recording).unwrap();
        let nominal = replay.get(GaugePressure).unwrap();
        assert!(nominal.iter().all(|pressure| (pressure - nominal[0]).abs() < 1.0), "{name}");
        let measured = recording.get(GaugePressure).unwrap();
        assert!(measured[measured.len() - 1] < measured[0], "{name} leaks");
    }
}

#[test]
fn an_ideal_muscle_is_far_too_strong_for_the_static_maps() {
    for (name, by_hand) in [("dmsp_20_300", 236.0), ("dmsp_10_250", 94.0)] {
        let (recording, parameters) = load(&format!("map/{name}.csv"), &format!("map/{name}.toml"));
        let replay = replay(&parameters, &recording).unwrap();
        let rms = rms_difference(recording.get(Force).unwrap(), replay.get(Force).unwrap()).unwrap();
        assert!((rms - by_hand).abs() < 1.0, "{name}: {rms} N");
    }
}

#[test]
fn only_gaps_constant_inputs_and_static_maps_are_noted() {
    let expected = [
        "in time, the longest of",
        "`command` is constant",
        "`contraction` is 0 mm throughout",
        "`contraction` leaps by",
    ];
    for (folder, parameters) in
        [("cylinder", "cylinder/cylinder_25.toml"), ("chamber", "chamber/shut.toml"), ("map", "map/dmsp_20_300.toml")]
    {
        for entry in std::fs::read_dir(real(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "csv") {
                let name = format!("{folder}/{}", path.file_name().unwrap().to_string_lossy());
                let (recording, parameters) = load(&name, parameters);
                for note in notes(&[recording], &parameters).unwrap() {
                    assert!(expected.iter().any(|known| note.contains(known)), "{note}");
                }
            }
        }
    }
}

#[test]
fn a_wrong_muscle_is_not_taken_for_a_wrong_unit() {
    let (recording, _) = load("cylinder/kidney_lc_1bar.csv", "cylinder/cylinder_25.toml");
    let found = notes(&[recording], &Parameters::default()).unwrap();
    assert!(found.iter().all(|note| note.contains("in time")), "{found:?}");
}

/// The one cause that is named in recordings, with the values of its parameters.
fn only_cause(recordings: &[String], parameters: &str) -> (&'static str, Vec<(&'static str, f64)>) {
    let (recordings, parameters): (Vec<_>, Vec<_>) = recordings.iter().map(|name| load(name, parameters)).unzip();
    let found = diagnose(&parameters[0], &recordings, DEFAULT_TOLERANCE, &|_| ()).unwrap();
    assert!(found.causes.len() == 1, "{}: {:?}, {:?}", recordings[0].name(), found.verdict, found.causes);
    let cause = &found.causes[0];
    assert!(cause.alternatives.is_empty(), "{}: {:?}", recordings[0].name(), cause.alternatives);
    (cause.effect, cause.parameters.iter().map(|parameter| (parameter.name, parameter.value)).collect())
}

#[test]
fn measured_seals_come_out_as_friction() {
    let seals = [
        ("circle", "cylinder/cylinder_25.toml"),
        ("nap310", "cylinder/cylinder_25.toml"),
        ("x_ring257", "cylinder/cylinder_25_7.toml"),
        ("kidney_lc", "cylinder/cylinder_25.toml"),
    ];
    for (seal, parameters) in seals {
        let names = [1, 5, 7, 3].map(|bar| format!("cylinder/{seal}_{bar}bar.csv"));
        assert_eq!(only_cause(&names, parameters).0, "friction_hysteresis", "{seal}");
    }
}

/// Gauge pressure in Pa in the chambers whose leak is slow: 7.3 to 7.8 bar, falling by one per cent at most.
const IN_CHAMBERS: f64 = 7.6e5;

#[test]
fn measured_chambers_come_out_as_leaks_with_the_rate_of_a_hand_calculation() {
    // by_hand.py; where the leak is not laminar it has no rate that holds at all pressures.
    let rates = [("aluminium", 3.04e-5), ("formlabs", 3.37e-5), ("prusa", 1.27e-4), ("ultimaker_006", 5.70e-5)];
    for (chamber, by_hand) in rates {
        let (effect, parameters) = only_cause(&[format!("chamber/{chamber}.csv")], "chamber/shut.toml");
        assert_eq!(effect, "leakage", "{chamber}");
        let value = |wanted: &str, default| parameters.iter().find(|(n, _)| *n == wanted).map_or(default, |(_, v)| *v);
        // Over one per cent of the pressure no form can be told from another, but what is lost can.
        let above = IN_CHAMBERS - value("leakage.opening_pressure", 0.0);
        let shape = (above / 2e5).powf(value("leakage.exponent", 1.0) - 1.0) * above / IN_CHAMBERS;
        let rate = value("leakage.rate", 0.0) * shape;
        assert_eq!(value("leakage.choked_share", 0.0), 0.0, "{chamber}");
        assert!((rate / by_hand - 1.0).abs() < 0.02, "{chamber}: {rate} 1/s, by hand {by_hand} 1/s");
    }
    for chamber in ["ultimaker_015", "ultimaker_020"] {
        assert_eq!(only_cause(&[format!("chamber/{chamber}.csv")], "chamber/shut.toml").0, "leakage", "{chamber}");
    }
}
