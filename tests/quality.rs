//! What is said of recordings that are spoilt in one way each, and that nothing is said of sound ones.

use sinew::Result;
use sinew::measurement::Recording;
use sinew::parameters::Parameters;
use sinew::quality::{notes, notes_on_units};
use std::path::Path;

const HANGING: &str = "nominal_40kg.csv";
const DRIVEN: &str = "prescribed_motion.csv";

/// A shipped recording with headers renamed and every number changed by a function of its row, its column's name, its
/// time and its value; NaN empties a cell.
fn recording(name: &str, renamed: &[(&str, &str)], change: impl Fn(usize, &str, f64, f64) -> f64) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(&path).unwrap();
    let rows: Vec<_> = reader.records().map(std::result::Result::unwrap).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let headers =
        rows[0].iter().map(|header| renamed.iter().find(|(old, _)| *old == header).map_or(header, |(_, new)| *new));
    writer.write_record(headers).unwrap();
    for (k, row) in rows[1..].iter().enumerate() {
        let time: f64 = row[0].parse().unwrap();
        let cells = row.iter().zip(&rows[0]).map(|(cell, header)| match cell.parse::<f64>() {
            Ok(value) => change(k, header.split(' ').next().unwrap(), time, value).to_string(),
            Err(_) => cell.to_owned(),
        });
        writer.write_record(cells).unwrap();
    }
    Recording::parse(&writer.into_inner().unwrap(), &path, &[]).unwrap()
}

fn as_it_is(name: &str) -> Recording {
    recording(name, &[], |_, _, _, value| value)
}

/// A recording of which one column is changed by its time and value.
fn spoilt(name: &str, column: &str, change: impl Fn(f64, f64) -> f64) -> Recording {
    recording(name, &[], |_, own, time, value| if own == column { change(time, value) } else { value })
}

fn found(recordings: &[Recording]) -> Result<Vec<String>> {
    notes(recordings, &Parameters::default())
}

/// The one note on a recording.
fn note(recording: Recording) -> String {
    let notes = found(&[recording]).unwrap();
    assert_eq!(notes.len(), 1, "{notes:?}");
    notes[0].clone()
}

fn assert_says(text: &str, parts: &[&str]) {
    parts.iter().for_each(|part| assert!(text.contains(part), "`{text}` should contain `{part}`"));
}

#[test]
fn nothing_is_said_of_sound_recordings() {
    let names = ["dry_friction_20kg.csv", "dry_friction_60kg.csv", HANGING, DRIVEN];
    assert_eq!(found(&names.map(as_it_is)).unwrap(), Vec::<String>::new());
}

#[test]
fn contradictory_units_are_refused_with_the_likely_one() {
    // Column as shipped, what the header says in its place, and what must be proposed.
    let cases = [
        (HANGING, "gauge_pressure [bar]", "gauge_pressure [Pa]", "looks like bar"),
        (HANGING, "gauge_pressure [bar]", "gauge_pressure [mbar]", "looks like bar"),
        (HANGING, "contraction [mm]", "contraction [m]", "looks like mm"),
        (HANGING, "command [V]", "command [mV]", "looks like V"),
        (HANGING, "force [N]", "force [kN]", "looks like N"),
        (DRIVEN, "contraction [mm]", "contraction [m]", "looks like mm"),
        (DRIVEN, "gauge_pressure [bar]", "gauge_pressure [Pa]", "looks like bar"),
        (DRIVEN, "command [V]", "command [mV]", "looks like V"),
        (DRIVEN, "force [N]", "force [kN]", "looks like N"),
    ];
    for (name, header, wrong, proposal) in cases {
        let refused = found(&[recording(name, &[(header, wrong)], |_, _, _, value| value)]).unwrap_err().to_string();
        assert_says(&refused, &[name, &format!("`{wrong}`"), proposal, &format!("write `{header}`")]);
        let of_units =
            notes_on_units(&[recording(name, &[(header, wrong)], |_, _, _, value| value)], &Parameters::default());
        assert_eq!(of_units.unwrap_err().to_string(), refused);
    }
    // The other way round: numbers of a smaller unit under the header of a larger one.
    for (name, column, factor, proposal) in [
        (HANGING, "gauge_pressure", 1e5, "looks like Pa"),
        (DRIVEN, "gauge_pressure", 1e3, "looks like mbar"),
        (HANGING, "contraction", 1e-3, "looks like m:"),
        (HANGING, "command", 1e3, "looks like mV"),
        (HANGING, "force", 1e-3, "looks like kN"),
        (DRIVEN, "force", 1e-3, "looks like kN"),
        (DRIVEN, "command", 1e3, "looks like mV"),
    ] {
        let refused = found(&[spoilt(name, column, |_, value| factor * value)]).unwrap_err().to_string();
        assert_says(&refused, &[name, column, proposal]);
    }
    let grams = found(&[spoilt(HANGING, "load_mass", |_, kg| 1e3 * kg)]).unwrap_err().to_string();
    assert_says(&grams, &["`load_mass [kg]` is 40000 kg", "the muscle lifts"]);
}

#[test]
fn a_contradiction_below_a_hundred_is_a_note() {
    let psi = spoilt(HANGING, "gauge_pressure", |_, bar| 14.5 * bar);
    assert_says(&note(psi), &["`gauge_pressure [bar]` reaches", "looks like psi"]);
    let centimetres = spoilt(HANGING, "contraction", |_, mm| 0.1 * mm);
    assert_says(&note(centimetres), &["`contraction [mm]` moves by", "looks like cm"]);
}

#[test]
fn a_contraction_that_is_a_length_is_noticed() {
    let length = spoilt(HANGING, "contraction", |_, mm| 980.0 - mm);
    assert!(found(&[length]).unwrap().iter().any(|note| note.contains("positive when shorter")));
    let push = spoilt(DRIVEN, "force", |_, newton| -newton);
    assert_says(&note(push), &["the pull of the muscle is positive"]);
}

#[test]
fn a_force_that_is_negative_throughout_is_noticed() {
    for (name, column) in [(HANGING, "force"), (DRIVEN, "force")] {
        let pushes = spoilt(name, column, |_, newton| -newton.abs() - 1.0);
        let said = ["`force [N]` is negative throughout", "the pull of the muscle is positive", "change the sign"];
        assert_says(&note(pushes), &said);
    }
}

#[test]
fn milliseconds_that_are_called_seconds_are_refused() {
    for name in [HANGING, DRIVEN, "dry_friction_20kg.csv"] {
        let refused = found(&[spoilt(name, "time", |time, _| 1e3 * time)]).unwrap_err().to_string();
        assert_says(&refused, &[name, "and the valve answers within 0.06366 s; it looks like ms: write `time [ms]`"]);
    }
    // A plant that is honestly slow, and one that is sampled slowly.
    let slow = spoilt(HANGING, "time", |time, _| 30.0 * time);
    assert!(!found(&[slow]).unwrap().iter().any(|note| note.contains("`time")));
}

#[test]
fn constant_columns_are_noticed() {
    assert_says(&note(spoilt(DRIVEN, "command", |_, _| 2.0)), &["`command` is constant"]);
    let pulse = spoilt(DRIVEN, "command", |time, _| if (3.0..3.5).contains(&time) { 4.0 } else { 2.0 });
    assert!(!found(&[pulse]).unwrap().iter().any(|note| note.contains("is constant")));
    assert_says(&note(spoilt(HANGING, "force", |_, _| 392.4)), &["`force` is 392.4 N throughout", "says nothing"]);
    let held = spoilt(DRIVEN, "contraction", |_, _| 80.0);
    assert!(found(&[held]).unwrap().iter().any(|note| note.contains("`contraction` is 80 mm throughout")));
}

#[test]
fn a_clipped_sensor_is_named_with_level_and_share() {
    let clipped = spoilt(HANGING, "contraction", |_, mm| mm.min(120.0));
    assert_says(&note(clipped), &["`contraction [mm]` stays at exactly 120 mm, its largest value", " %)", "clipped"]);
    let clipped = spoilt(DRIVEN, "force", |_, newton| newton.max(1000.0));
    assert_says(&note(clipped), &["`force [N]` stays at exactly 1000 N, its smallest value", "clipped"]);
    let clipped = spoilt(HANGING, "gauge_pressure", |_, bar| bar.min(2.0));
    assert_says(&note(clipped), &["`gauge_pressure [bar]` stays at exactly 2 bar", "unless the supply ends there"]);
}

#[test]
fn a_sensor_that_sticks_for_a_while_is_noticed() {
    let stuck = spoilt(HANGING, "contraction", |time, mm| if (8.0..25.0).contains(&time) { 95.5 } else { mm });
    assert_says(&note(stuck), &["`contraction [mm]` shows 95.5 mm without change from 8", "stuck"]);
}

#[test]
fn gaps_are_named() {
    let path = Path::new("gap.csv");
    let text = |skip: &dyn Fn(f64) -> bool, lost: &dyn Fn(f64) -> bool| {
        let sound = as_it_is(DRIVEN);
        use sinew::measurement::Signal::{Command, Contraction, Force};
        let [u, x, f] = [Command, Contraction, Force].map(|signal| sound.bridged(signal).unwrap());
        let mut text = "time [s],command [V],contraction [m],force [N]\n".to_owned();
        for (k, time) in sound.time.iter().enumerate().filter(|(_, time)| !skip(**time)) {
            let force = if lost(*time) { String::new() } else { f[k].to_string() };
            text += &format!("{time},{},{},{force}\n", u[k], x[k]);
        }
        Recording::parse(text.as_bytes(), path, &[]).unwrap()
    };
    let never = |_: f64| false;
    let rows = text(&|time| (10.0..12.0).contains(&time), &never);
    assert_says(&note(rows), &["gap.csv: 1 gap in time, the longest of 2", "at 9.98"]);
    let cells = text(&never, &|time| (10.0..12.0).contains(&time));
    assert_says(&note(cells), &["`force` is missing from 9.98", "to 12"]);
    let most = text(&never, &|time| time > 10.0);
    assert_says(&note(most), &["`force` is missing in 77 % of the rows"]);
    // 4 s of every 5 s at a twentieth of the rate.
    let uneven = spoilt_times(|k| k % 400 < 320 && k % 20 != 0);
    assert!(found(&[uneven]).unwrap().iter().any(|note| note.contains("sampling is uneven")));
    let slow = spoilt_times(|k| k % 8 != 0);
    assert_says(&note(slow), &["samples are 0.1", "dead time and resonance cannot be judged"]);
}

/// The recording with prescribed motion without the rows for which a function of their number says so.
fn spoilt_times(drop: impl Fn(usize) -> bool) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(DRIVEN);
    let text = std::fs::read_to_string(&path).unwrap();
    let kept: Vec<&str> = text.lines().enumerate().filter(|(k, _)| *k == 0 || !drop(k - 1)).map(|(_, l)| l).collect();
    Recording::parse(kept.join("\n").as_bytes(), &path, &[]).unwrap()
}

#[test]
fn a_static_map_is_no_course_of_time() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/real/map/dmsp_20_300.csv");
    let found = found(&[Recording::read(&path, &[]).unwrap()]).unwrap();
    assert!(matches!(&found[..], [note] if note.contains("`contraction` leaps by 24 % of its range")), "{found:?}");
}

#[test]
fn copied_and_computed_columns_are_noticed() {
    let whole = as_it_is(HANGING);
    use sinew::measurement::Signal::{Command, GaugePressure};
    let [u, p] = [Command, GaugePressure].map(|signal| whole.bridged(signal).unwrap());
    let mut text = "time [s],command [V],gauge_pressure [Pa],contraction [m],load_mass [kg]\n".to_owned();
    (0..p.len()).for_each(|k| {
        text += &format!("{},{},{},{:.5},40\n", whole.time[k], u[k], p[k], 7e-7 * p[k] + 0.01);
    });
    let computed = Recording::parse(text.as_bytes(), Path::new("computed.csv"), &[]).unwrap();
    assert_says(&note(computed), &["`contraction` is `gauge_pressure` times 7e-7 plus 0.01", "adds nothing"]);

    let copy = spoilt(HANGING, "contraction", |_, mm| 1.1 * mm);
    let notes = found(&[as_it_is(HANGING), copy]).unwrap();
    assert!(
        matches!(&notes[..], [one] if one.contains("`gauge_pressure`, `contraction`, `force` equals that of")),
        "{notes:?}"
    );
}

#[test]
fn simulated_data_is_recognised() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/nominal_ramps_20kg.csv");
    let notes = found(&[Recording::read(&path, &[]).unwrap()]).unwrap();
    for signal in ["gauge_pressure", "contraction"] {
        assert!(notes.iter().any(|n| n.contains(&format!("`{signal}` has no noise"))), "{notes:?}");
    }
}
