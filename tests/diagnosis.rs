//! The diagnosis on recordings made by an independent program (`data/generate.py`), and on spoilt ones.

use sinew::diagnosis::report::FILES;
use sinew::diagnosis::{DEFAULT_TOLERANCE, Diagnosis, Verdict, diagnose};
use sinew::measurement::Signal::{Command, Contraction, Force, GaugePressure};
use sinew::measurement::{Between, Recording, numbered};
use sinew::parameters::Parameters;
use sinew::simulation::{replay, slopes};
use std::path::Path;

/// A shipped recording, every cell changed by a function of its row, its column's name and its text.
fn recording(name: &str, change: impl Fn(usize, &str, &str) -> String) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(&path).unwrap();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&rows[0]).unwrap();
    for (k, row) in rows[1..].iter().enumerate() {
        let columns = rows[0].iter().map(|header| header.split(' ').next().unwrap());
        writer.write_record(row.iter().zip(columns).map(|(cell, column)| change(k, column, cell))).unwrap();
    }
    Recording::parse(&writer.into_inner().unwrap(), &path, &[]).unwrap()
}

fn as_it_is(name: &str) -> Recording {
    recording(name, |_, _, cell| cell.to_owned())
}

/// A shipped recording with something added to a column that depends on the row, in the column's unit.
fn with_added(name: &str, to: &str, added: impl Fn(usize) -> f64) -> Recording {
    recording(name, |row, column, cell| match cell.parse::<f64>() {
        Ok(value) if column == to => (value + added(row)).to_string(),
        _ => cell.to_owned(),
    })
}

fn diagnosis_of(recordings: &[Recording]) -> Diagnosis {
    diagnose(&Parameters::default(), recordings, DEFAULT_TOLERANCE, &|_| ()).unwrap()
}

fn causes(found: &Diagnosis) -> Vec<&str> {
    found.causes.iter().map(|cause| cause.effect).collect()
}

#[test]
fn nothing_is_wrong_where_nothing_is() {
    for name in ["nominal_40kg.csv", "prescribed_motion.csv"] {
        let found = diagnosis_of(&[as_it_is(name)]);
        assert_eq!((found.verdict, causes(&found)), (Verdict::Nominal, vec![]), "{name}");
    }
}

/// Five levels of a command in turn, one each two seconds and a bit, and ramps between them in the second half.
fn stairs_and_ramps(time: f64) -> f64 {
    let level = |step: f64| [1.6, 2.0, 1.8, 2.4, 2.1][step.rem_euclid(5.0) as usize];
    let (step, after) = ((time / 2.2).floor(), time / 2.2 % 1.0);
    if time < 13.0 { level(step) } else { level(step) + (level(step + 1.0) - level(step)) * (2.0 * after).min(1.0) }
}

/// A sound muscle at 50 samples a second with noise, from a gauge pressure in bar on, whose command goes so between its samples.
fn sound_muscle(between: Between, start: f64) -> Recording {
    muscle(&Parameters::default(), stairs_and_ramps, between, start)
}

/// The same of another muscle and with another command.
fn muscle(truth: &Parameters, command: fn(f64) -> f64, between: Between, start: f64) -> Recording {
    Recording::parse(muscle_as_text(truth, command, between, start).as_bytes(), Path::new("muscle.csv"), &[]).unwrap()
}

/// The same as a CSV file.
fn muscle_as_text(truth: &Parameters, command: fn(f64) -> f64, between: Between, start: f64) -> String {
    let text = |shown: &dyn Fn(usize) -> String| {
        let row = |k: usize| format!("{:.2},{:.5},{},40\n", 0.02 * k as f64, command(0.02 * k as f64), shown(k));
        let header = "time [s],command [V],gauge_pressure [bar],contraction [mm],load_mass [kg]\n".to_owned();
        (0..1300).fold(header, |text, k| text + &row(k))
    };
    let inputs = text(&|_| format!("{start},100"));
    let inputs = Recording::parse(inputs.as_bytes(), Path::new("inputs.csv"), &[]).unwrap().going(between);
    let truth = replay(truth, &inputs).unwrap();
    let [pressure, contraction] = [GaugePressure, Contraction].map(|signal| truth.get(signal).unwrap());
    let noise = |k: usize, by: f64| ((k * k) as f64 * by).sin() + ((k * k) as f64 * 1.7 * by).cos();
    text(&|k| {
        let bar = 1e-5 * pressure[k] + 0.003 * noise(k, 0.71);
        format!("{bar:.4},{:.3}", 1e3 * contraction[k] + 0.05 * noise(k, 0.37))
    })
}

#[test]
fn a_command_that_changes_at_its_samples_is_no_cause() {
    // A program that sets the command and logs it, or holds it: with straight lines between samples it would come 10 ms too early.
    for between in [Between::Jumps, Between::Held] {
        let found = diagnosis_of(&[sound_muscle(between, stairs_and_ramps(0.0))]);
        assert_eq!((found.verdict, causes(&found), found.between), (Verdict::Nominal, vec![], between));
    }
}

fn waves(time: f64) -> f64 {
    2.0 + 0.25 * (1.1 * time).sin() + 0.15 * (2.9 * time + 1.0).sin() + 0.06 * (5.3 * time).sin()
}

#[test]
fn a_held_command_is_no_late_valve() {
    // Waves that are held come half a sampling interval, 10 ms, late. Where the valve lags by a trifle itself, a dead time along straight lines
    // explains that a little better, but has not the odds for a cause.
    let mut truth = Parameters::default();
    truth.effects.valve_dead_time.delay = 2e-3;
    let found = diagnosis_of(&[muscle(&truth, waves, Between::Held, waves(0.0))]);
    assert_eq!((found.verdict, causes(&found), found.between), (Verdict::Nominal, vec![], Between::Held));
}

#[test]
fn a_held_command_is_no_late_valve_beside_a_cause() {
    // The same, but then there would be two causes.
    let mut truth = Parameters::default();
    truth.effects.payload_mass.additional_mass = 4.0;
    let found = diagnosis_of(&[muscle(&truth, waves, Between::Held, waves(0.0))]);
    assert_eq!((found.causes.len(), found.between), (1, Between::Held), "{:?}", causes(&found));
    // A cable that stretches under the one load there is shifts the contraction, too.
    let cause = &found.causes[0];
    assert!(cause.effect == "payload_mass" || cause.alternatives.contains(&"payload_mass"), "{cause:?}");
}

#[test]
fn a_second_cause_is_found_that_shapes_of_the_first_one_could_stand_for() {
    let mut truth = Parameters::default();
    (truth.effects.creep.spectrum_amplitude, truth.effects.creep.spectrum_exponent) = (0.2, 0.3);
    truth.effects.end_effects.excess = 0.13;
    let found = diagnosis_of(&[muscle(&truth, stairs_and_ramps, Between::Lines, stairs_and_ramps(0.0))]);
    assert_eq!(causes(&found), ["creep", "end_effects"]);
}

#[test]
fn a_recording_that_begins_while_the_pressure_still_rises_is_no_cause() {
    let found = diagnosis_of(&[sound_muscle(Between::Lines, 1.0)]);
    assert_eq!((found.verdict, causes(&found), found.between), (Verdict::Nominal, vec![], Between::Lines));
    for signal in &found.signals {
        assert!(signal.extended_rms < 1.5 * signal.noise_rms, "{signal:?}");
    }
}

#[test]
fn a_recording_that_is_cut_out_of_a_longer_one_is_no_cause() {
    // From where the load swings on; every fiftieth of a second a reading.
    let whole = muscle_as_text(&Parameters::default(), stairs_and_ramps, Between::Lines, stairs_and_ramps(0.0));
    let mut rows = whole.lines();
    let header = rows.next().unwrap();
    let cut: String = rows.skip(155).map(|row| format!("{row}\n")).collect();
    let recording = Recording::parse(format!("{header}\n{cut}").as_bytes(), Path::new("cut.csv"), &[]).unwrap();
    let found = diagnosis_of(&[recording]);
    assert_eq!((found.verdict, causes(&found)), (Verdict::Nominal, vec![]));
    for signal in &found.signals {
        assert!(signal.extended_rms < 1.5 * signal.noise_rms, "{signal:?}");
    }
}

#[test]
fn a_gap_while_the_command_moves_is_no_cause() {
    // Where the command went in 1.8 s that are lost nobody knows: a straight line there is up to 0.37 V off, and the load swings long after.
    let whole = muscle_as_text(&Parameters::default(), waves, Between::Lines, waves(0.0));
    let rows = whole.lines().enumerate().filter(|(row, _)| !(600..690).contains(row));
    let text: String = rows.map(|(_, row)| format!("{row}\n")).collect();
    let found = diagnosis_of(&[Recording::parse(text.as_bytes(), Path::new("gap.csv"), &[]).unwrap()]);
    assert_eq!((found.verdict, causes(&found)), (Verdict::Nominal, vec![]));
    for signal in &found.signals {
        assert!(signal.extended_rms < 1.5 * signal.noise_rms, "{signal:?}");
    }
}

#[test]
fn a_pressure_that_tells_the_start_only_roughly_is_no_cause() {
    // Rounded as coarsely it starts 15 mbar too low: the load swings by 0.6 mm before it is where the valve has it.
    let rounded = |steps: f64| (steps / 0.045).round() * 0.045;
    let coarse = recording("nominal_40kg.csv", |_, column, cell| match cell.parse::<f64>() {
        Ok(value) if column == "gauge_pressure" => format!("{:.3}", rounded(value)),
        _ => cell.to_owned(),
    });
    let found = diagnosis_of(&[coarse]);
    assert_eq!((found.verdict, causes(&found)), (Verdict::Nominal, vec![]));
}

#[test]
fn friction_is_found_with_its_size() {
    // The generator rubs with 12.67 N/bar in five Maxwell elements, the model with one of Dahl's.
    for names in [&["dry_friction_20kg.csv", "dry_friction_60kg.csv"][..], &["dry_friction_20kg.csv"]] {
        let recordings = numbered(names.iter().map(|name| as_it_is(name)).collect());
        let found = diagnosis_of(&recordings);
        assert_eq!(causes(&found), ["friction_hysteresis"], "{names:?}");
        let value = |name: &str| found.extended.get(&format!("friction_hysteresis.{name}")).unwrap();
        let at_two_bar = value("half_width") + 2e5 * value("half_width_per_pressure");
        assert!((at_two_bar - 25.3).abs() < 2.5, "{at_two_bar} N");
        assert!(found.improvement > 0.8, "{}", found.improvement);
    }
}

#[test]
fn friction_is_found_from_pressure_and_force_alone() {
    // Without a command the measured pressure is the input: the chain is cut there.
    use sinew::measurement::Signal::GaugePressure;
    let whole = as_it_is("dry_friction_20kg.csv");
    let [p, x, f] = [GaugePressure, Contraction, Force].map(|signal| whole.bridged(signal).unwrap());
    let mut text = "time [s],gauge_pressure [Pa],contraction [m],force [N]\n".to_owned();
    (0..p.len()).for_each(|k| text += &format!("{},{},{},{}\n", whole.time[k], p[k], x[k], f[k]));
    let cut = Recording::parse(text.as_bytes(), Path::new("cut.csv"), &[]).unwrap();
    assert_eq!(causes(&diagnosis_of(&[cut])), ["friction_hysteresis"]);
}

#[test]
fn a_shifted_position_sensor_is_found_in_hanging_and_prescribed_motion() {
    for name in ["nominal_40kg.csv", "prescribed_motion.csv"] {
        let found = diagnosis_of(&[with_added(name, "contraction", |_| 20.0)]);
        assert_eq!(causes(&found), ["contraction_sensor_offset"], "{name}");
        // With one load a shift is in part what an area within the tolerance does, too.
        let offset = &found.causes[0].parameters[0];
        assert!((offset.value - 0.02).abs() < 2.5e-3, "{name}: {offset:?}");
    }
}

#[test]
fn a_cause_in_no_library_that_is_known_by_its_course_gets_no_name_of_another() {
    // A measuring wheel that loses a share of the way whenever the load comes down faster than 25 mm/s. A muscle that warms up
    // explains almost all of it, as an offset of the force sensor does of the other one; where it is 0.2 %, the error is small enough to be none.
    let whole = as_it_is("nominal_40kg.csv");
    let way = whole.bridged(Contraction).unwrap();
    let velocity = slopes(&whole.time, &way);
    let mut moved = vec![0.0];
    for k in 1..way.len() {
        let slips = velocity[k] < -25e-3;
        moved.push(moved[k - 1] + if slips { velocity[k] * (whole.time[k] - whole.time[k - 1]) } else { 0.0 });
    }
    let slipping = |share: f64| with_added("nominal_40kg.csv", "contraction", |k| -1e3 * share * moved[k]);
    // The line of the command talks into the amplifier of the force sensor.
    let command = whole.bridged(Command).unwrap();
    let talking = with_added("nominal_40kg.csv", "force", |k| 2.0 * command[k]);
    for (spoilt, signal, on) in [
        (slipping(0.004), Contraction, "way moved down"),
        (slipping(0.002), Contraction, "way moved down"),
        (talking, Force, "the command"),
    ] {
        let found = diagnosis_of(&[spoilt]);
        assert_eq!((found.verdict, causes(&found)), (Verdict::Unexplained, vec![]), "{on}");
        let first = &found.remaining[0];
        assert!(first.signal == signal && first.on.contains(on) && first.share > 0.9, "{first:?}");
    }
}

#[test]
fn a_zero_that_is_set_anew_in_each_recording_is_one_cause() {
    let shifted = |name: &str, millimetres: f64| with_added(name, "contraction", |_| millimetres);
    let found =
        diagnosis_of(&numbered(vec![shifted("nominal_40kg.csv", 12.0), shifted("prescribed_motion.csv", -6.0)]));
    assert_eq!((found.verdict, causes(&found)), (Verdict::Explained, vec!["contraction_sensor_offset"]));
    let value = |name: &str| found.extended.get(&format!("contraction_sensor_offset.{name}")).unwrap();
    assert!((value("offset") - 12e-3).abs() < 2.5e-3, "{} m", value("offset"));
    assert!((value("second") + 18e-3).abs() < 2.5e-3, "{} m", value("second"));
    assert!(found.causes[0].sentence.contains("in the second recording"), "{}", found.causes[0].sentence);
}

#[test]
fn a_stuck_sensor_does_not_hide_what_the_others_show() {
    let stuck =
        recording(
            "dry_friction_20kg.csv",
            |_, column, cell| {
                if column == "force" { "196.2".to_owned() } else { cell.to_owned() }
            },
        );
    let found = diagnosis_of(&[stuck]);
    assert_eq!(causes(&found), ["friction_hysteresis"]);
    assert!(found.improvement.is_finite() && found.signals.len() == 2);
}

#[test]
fn signals_of_different_recordings_are_all_judged() {
    let only = |name: &str, keep: &'static str| {
        recording(name, move |_, column, cell| {
            let output = ["gauge_pressure", "contraction", "force"].contains(&column);
            if output && column != keep { String::new() } else { cell.to_owned() }
        })
    };
    let found =
        diagnosis_of(&[only("dry_friction_20kg.csv", "contraction"), only("dry_friction_60kg.csv", "gauge_pressure")]);
    assert_ne!(found.verdict, Verdict::Nominal);
    assert!(found.signals.iter().all(|errors| errors.nominal_rms > 0.0));
}

#[test]
fn outputs_that_end_early_are_refused_with_a_sentence() {
    let silent = recording("dry_friction_20kg.csv", |k, column, cell| {
        let output = ["gauge_pressure", "contraction", "force"].contains(&column);
        if output && k > 2000 { String::new() } else { cell.to_owned() }
    });
    let refused = diagnose(&Parameters::default(), &[silent], DEFAULT_TOLERANCE, &|_| ()).unwrap_err();
    assert!(refused.to_string().contains("reaches to the end of the recording"), "{refused}");
}

#[test]
fn fifty_samples_are_diagnosed_and_fewer_are_refused() {
    let whole = muscle_as_text(&Parameters::default(), stairs_and_ramps, Between::Lines, stairs_and_ramps(0.0));
    let first = |samples: usize| {
        let text: String = whole.lines().take(1 + samples).map(|row| format!("{row}\n")).collect();
        let recording = Recording::parse(text.as_bytes(), Path::new("short.csv"), &[]).unwrap();
        diagnose(&Parameters::default(), &[recording], DEFAULT_TOLERANCE, &|_| ())
    };
    assert_eq!(first(50).unwrap().verdict, Verdict::Nominal);
    let refused = first(49).unwrap_err().to_string();
    assert!(refused.contains("at least 50 samples"), "{refused}");
}

#[test]
fn a_nominal_model_without_damping_is_no_trouble() {
    let mut nominal = Parameters::default();
    nominal.muscle.damping = 0.0;
    let found = diagnose(&nominal, &[as_it_is("dry_friction_20kg.csv")], DEFAULT_TOLERANCE, &|_| ()).unwrap();
    assert!(found.improvement.is_finite());
    let damping = found.extended.get("viscous_damping.contraction").unwrap();
    assert!(damping == 0.0 || (damping - 200.0).abs() > 1e-6, "the start value is no result");
}

#[test]
fn an_unknown_cause_gets_a_correction_and_no_name() {
    // A rubber stop inside the muscle: from 95 mm of contraction on it pushes back with 40 N/mm.
    let stopped = spoilt_force("prescribed_motion.csv", |contraction| -40.0 * (contraction - 95.0).max(0.0));
    let found = diagnosis_of(std::slice::from_ref(&stopped));
    assert_eq!((found.verdict, causes(&found)), (Verdict::Unexplained, vec![]));
    let correction = found.correction.as_ref().unwrap();
    assert!(correction.improvement > 0.6, "{correction:?}");
    assert_eq!((correction.acts_on, correction.variables[0]), ("force", "contraction"));
    let folder = Path::new("out");
    let files = sinew::diagnosis::report::files(&found, &Parameters::default(), &[stopped], &[], folder).unwrap();
    let written: Vec<_> = files.iter().map(|(path, _)| path.clone()).collect();
    assert_eq!(written, FILES.map(|file| folder.join(file.name)));
    assert!(files.iter().all(|(_, bytes)| !bytes.is_empty()));
    assert!(found.extended.unknown_cause.is_neutral());
}

/// A shipped recording with a force in N added that depends on the contraction in mm.
fn spoilt_force(name: &str, added: impl Fn(f64) -> f64) -> Recording {
    let contraction = as_it_is(name).bridged(Contraction).unwrap();
    with_added(name, "force", |row| added(1e3 * contraction[row]))
}
