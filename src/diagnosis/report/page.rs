//! `report.html`: one file that opens offline, for a person.

use super::curves::{compared, most_samples, over_time};
use super::exposure::{Exposed, Residuals, SEEN};
use super::{Made, display_unit, gain, headline, pictures, which_samples};
use crate::diagnosis::links::Variable;
use crate::diagnosis::{Cause, Diagnosis, FittedParameter, Ranked, SignalErrors, Verdict};
use crate::effects::Effects;
use crate::measurement::{Recording, Signal};
use crate::package::{render, short};
use crate::parameters::Parameters;
use crate::simulation::{OUTPUTS, Replay};
use minijinja::{Value, context};
use serde_json::json;
use std::f64::consts::TAU;

/// The page; `replays` are those of each recording by the nominal and by the extended model, `files` those that lie beside it.
pub fn html(
    diagnosis: &Diagnosis,
    nominal: &Parameters,
    recordings: &[Recording],
    replays: &[[Replay; 2]],
    files: &[Made],
) -> String {
    let residuals = Residuals::new(diagnosis, nominal, recordings);
    let exposed = residuals.exposed(diagnosis);
    let most = most_samples(recordings.len());
    let models = if diagnosis.extended == *nominal { 1 } else { 2 };
    let (mut curves, mut of_recordings, mut static_plots) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (recording, replays)) in recordings.iter().zip(replays).enumerate() {
        let signals = compared(recording, &replays[0]);
        let own = diagnosis.held_out.iter().find(|part| part.recording == recording.name());
        let held_out = own.map(|part| part.from).filter(|_| !diagnosis.saw_all);
        curves.push(json!({
            "held_out_from": held_out,
            "signals": signals.iter().map(|s| over_time(diagnosis, recording, *s, replays, most)).collect::<Vec<_>>(),
            "dots": residuals.dots(index, &exposed),
        }));
        of_recordings.push(recording_context(recording, &signals, held_out, most));
        static_plots.extend(pictures::time_plots(recording, &replays[..models]));
    }
    let data = json!({ "axes": residuals.axes(diagnosis), "recordings": curves });
    let causes = diagnosis.causes.iter().zip(&exposed);
    // A sound muscle needs no picture of what is wrong with it.
    let unknown = diagnosis.causes.is_empty() && diagnosis.verdict != Verdict::Nominal;
    let page = context! {
        verdict => verdict_word(diagnosis.verdict),
        headline => headline(diagnosis),
        gain => gain(diagnosis),
        which_samples => which_samples(diagnosis),
        notes => notes(diagnosis, recordings),
        files => files.iter().map(|(file, _)| context! { name => file.name, purpose => file.purpose }).collect::<Vec<_>>(),
        causes => causes.map(|(cause, exposed)| cause_context(cause, *exposed, &residuals)).collect::<Vec<_>>(),
        unknown,
        shows => exposed[0].filter(|_| unknown).map(|exposed| exposed_context(exposed, &residuals)),
        signals => diagnosis.signals.iter().map(errors_context).collect::<Vec<_>>(),
        recordings => of_recordings,
        variables => residuals.variables.iter().map(|variable| variable.label().0).collect::<Vec<_>>(),
        links => residuals.links.iter().map(|(link, exposure)| context! {
            title => link.title(), meaning => link.meaning(), share => percent(exposure.share), clear => exposure.share > SEEN,
            variable => residuals.position(exposure.variable), on => exposure.variable.label().0,
        }).collect::<Vec<_>>(),
        ranking => ranking(diagnosis),
        remaining => diagnosis.remaining.iter().map(|left| context! {
            signal => words(left.signal), on => left.on.clone(), share => percent(left.share),
        }).collect::<Vec<_>>(),
        corrections => parameter_rows(&diagnosis.corrections),
        next => next_measurements(diagnosis, recordings),
        static_plots,
        style => concat!(include_str!("vendor/uPlot.min.css"), include_str!("page.css")),
        library => include_str!("vendor/uPlot.iife.min.js"),
        script => include_str!("page.js"),
        data => inside_script(&data),
        version => env!("CARGO_PKG_VERSION"),
    };
    render("report.html", include_str!("page.html"), &page)
}

/// JSON that nothing inside can end the `<script>` around, and that is JavaScript as well.
fn inside_script(data: &serde_json::Value) -> String {
    data.to_string().replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}

fn verdict_word(verdict: Verdict) -> String {
    json!(verdict).as_str().unwrap_or_default().replace('_', " ")
}

fn words(signal: Signal) -> String {
    signal.name().replace('_', " ")
}

fn percent(share: f64) -> String {
    format!("{} %", minus(&format!("{:.0}", 100.0 * share)))
}

fn notes(diagnosis: &Diagnosis, recordings: &[Recording]) -> Vec<String> {
    let of_files = recordings.iter().flat_map(|r| r.notes.iter().map(move |note| format!("{}: {note}", r.name())));
    diagnosis.notes.iter().cloned().chain(of_files).collect()
}

fn recording_context(recording: &Recording, signals: &[Signal], held_out: Option<f64>, most: usize) -> Value {
    let time = &recording.time;
    let samples = time.len();
    context! {
        name => recording.name(),
        mass => recording.load_mass().map(short),
        samples,
        duration => format!("{:.1}", time[samples - 1] - time[0]),
        signals => signals.iter().map(|signal| words(*signal)).collect::<Vec<_>>(),
        thinned => (samples > most).then_some(most),
        held_out => held_out.map(|from| format!("from {from:.1} s")),
    }
}

fn cause_context(cause: &Cause, exposed: Option<Exposed>, residuals: &Residuals) -> Value {
    let alternative = |name: &&'static str| context! { name => *name, meaning => meaning(name) };
    context! {
        effect => cause.effect,
        meaning => meaning(cause.effect),
        sentence => cause.sentence.clone(),
        parameters => parameter_rows(&cause.parameters),
        alternatives => cause.alternatives.iter().map(alternative).collect::<Vec<_>>(),
        experiment => cause.experiment,
        exposed => exposed.map(|exposed| exposed_context(exposed, residuals)),
    }
}

fn exposed_context(exposed: Exposed, residuals: &Residuals) -> Value {
    let (link, variable): (_, Variable) = (residuals.links[exposed.link].0, residuals.variables[exposed.variable]);
    context! {
        link => exposed.link, variable => exposed.variable,
        title => link.title(), meaning => link.meaning(), on => variable.label().0,
    }
}

/// What an effect is, in one line.
fn meaning(effect: &str) -> &'static str {
    Effects::description(effect).map_or("", |known| known.meaning)
}

fn errors_context(errors: &SignalErrors) -> Value {
    let (unit, size) = display_unit(errors.signal);
    let largest = errors.nominal_rms.max(errors.extended_rms).max(errors.noise_rms);
    let shown = |rms: f64| context! { text => three_digits(rms / size), width => width(rms / largest) };
    context! {
        name => words(errors.signal), unit,
        nominal => shown(errors.nominal_rms), extended => shown(errors.extended_rms), noise => shown(errors.noise_rms),
    }
}

fn ranking(diagnosis: &Diagnosis) -> Vec<Value> {
    let row = |ranked: &Ranked| {
        context! {
            effect => ranked.effect, meaning => meaning(ranked.effect),
            named => diagnosis.causes.iter().any(|cause| cause.effect == ranked.effect),
            explained => percent(ranked.explained), width => width(ranked.explained),
            evidence => minus(&format!("{:.0}", ranked.evidence)),
        }
    };
    diagnosis.ranking.iter().map(row).collect()
}

/// Length of a bar in percent of the longest.
fn width(share: f64) -> String {
    format!("{:.1}", if share.is_finite() { 100.0 * share.clamp(0.0, 1.0) } else { 0.0 })
}

fn parameter_rows(all: &[FittedParameter]) -> Vec<Value> {
    let row = |p: &FittedParameter| {
        let (unit, size) = parameter_unit(p);
        let text = |value: f64| rounded_to(value / size, (p.high - p.low) / size);
        context! {
            name => p.name, description => Parameters::default().find(p.name).map(|(variable, _)| variable.description),
            value => text(p.value), low => text(p.low), high => text(p.high), unit,
        }
    };
    all.iter().map(row).collect()
}

/// Unit for people of a parameter, and its size in SI.
fn parameter_unit(parameter: &FittedParameter) -> (String, f64) {
    let largest = parameter.value.abs().max(parameter.high.abs());
    let (unit, size) = match parameter.unit {
        "m" => ("mm", 1e-3),
        "m/s" => ("mm/s", 1e-3),
        "N/Pa" => ("N/bar", 1e-5),
        "m2" => ("cm²", 1e-4),
        "s" if largest < 1.0 => ("ms", 1e-3),
        "Pa" => ("bar", 1e5),
        "Pa/s" => ("bar/s", 1e5),
        "Pa/V" => ("bar/V", 1e5),
        "rad/s" => ("Hz", TAU),
        "1" => ("", 1.0),
        other => (other, 1.0),
    };
    (unit.replace('.', " "), size)
}

/// A value to as many decimals as an interval around it deserves: two significant digits of its width.
fn rounded_to(value: f64, interval: f64) -> String {
    if !(interval > 0.0 && interval.is_finite()) {
        return minus(&short(value));
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let decimals = (1.0 - interval.log10().floor()).clamp(0.0, 9.0) as usize;
    minus(&format!("{value:.decimals$}"))
}

/// A number with a true minus sign, and none on zero.
fn minus(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
        _ => number.replace('-', "−"),
    }
}

fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

/// What to measure next, most useful first.
fn next_measurements(diagnosis: &Diagnosis, recordings: &[Recording]) -> Vec<String> {
    let ambiguous = diagnosis.causes.iter().filter(|cause| !cause.alternatives.is_empty());
    let mut next: Vec<String> = ambiguous
        .map(|cause| format!("To tell {} from {}: {}.", cause.effect, cause.alternatives.join(", "), cause.experiment))
        .collect();
    let measured = |signal: Signal| recordings.iter().any(|recording| recording.get(signal).is_some());
    let missing: Vec<String> = OUTPUTS.into_iter().filter(|s| !measured(*s)).map(words).collect();
    if !missing.is_empty() {
        next.push(format!(
            "Record {} as well: links of the chain can then be judged one by one, and more causes told apart.",
            missing.join(" and ")
        ));
    }
    if next.is_empty() && !measured(Signal::LoadMass) && diagnosis.verdict != Verdict::Nominal {
        next.push("Record the muscle with a hanging load too: it shows what belongs to the load.".to_owned());
    }
    let sure = diagnosis.causes.iter().filter(|cause| cause.alternatives.is_empty());
    next.extend(sure.map(|cause| format!("To confirm {} by itself: {}.", cause.effect, cause.experiment)));
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::{HeldOut, Remaining};
    use crate::measurement::Between;
    use crate::simulation::replay;

    #[test]
    fn nothing_in_the_data_ends_the_script() {
        let nasty = "</script><!-- <script> \u{2028}\u{2029} & \" '";
        let text = inside_script(&json!({ "name": nasty }));
        assert!(!text.contains(['<', '\u{2028}', '\u{2029}']), "{text}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap()["name"], nasty);
    }

    /// A diagnosis that holds everything the page can show.
    fn everything(verdict: Verdict, causes: Vec<Cause>) -> Diagnosis {
        let correction = FittedParameter { name: "muscle.area_scale", value: 1.01, low: 1.0, high: 1.02, unit: "1" };
        Diagnosis {
            correction: None,
            verdict,
            tolerance: 0.03,
            causes,
            signals: vec![SignalErrors { signal: Signal::Force, nominal_rms: 20.0, extended_rms: 2.0, noise_rms: 1.0 }],
            improvement: 0.9,
            held_out: vec![HeldOut { recording: "<i>.csv".to_owned(), from: 6.0 }],
            saw_all: false,
            ranking: vec![Ranked { effect: "creep", explained: -0.001, evidence: -3.2, parameters: Vec::new() }],
            extended: Parameters::default(),
            between: Between::Lines,
            corrections: vec![correction],
            notes: vec!["<b>bold</b>".to_owned()],
            remaining: vec![Remaining {
                signal: Signal::Force,
                on: "speed & pressure".to_owned(),
                share: 0.43,
                is_known: false,
            }],
        }
    }

    fn page_of(diagnosis: &Diagnosis) -> String {
        let wave = |k: usize| (0.1 * k as f64).sin();
        let rows =
            (0..100).map(|k| format!("{},2e5,{},{}\n", 0.1 * k as f64, 80.0 + 20.0 * wave(k), 900.0 + 200.0 * wave(k)));
        let text = format!("time [s],gauge_pressure [Pa],contraction [mm],force [N]\n{}", rows.collect::<String>());
        let recording = Recording::parse(text.as_bytes(), std::path::Path::new("<i>.csv"), &[]).unwrap();
        let replays = [[&Parameters::default(), &diagnosis.extended].map(|model| replay(model, &recording).unwrap())];
        html(diagnosis, &Parameters::default(), &[recording], &replays, &[])
    }

    #[test]
    fn page_tells_alternatives_what_is_left_and_what_to_measure() {
        let cause = Cause {
            rivals: Vec::new(),
            effect: "payload_mass",
            sentence: "The load is 2 kg heavier.".to_owned(),
            parameters: Vec::new(),
            alternatives: vec!["valve_lag"],
            experiment: "a second load",
        };
        let page = page_of(&everything(Verdict::Ambiguous, vec![cause]));
        for words in [
            "This data cannot tell <code>payload_mass</code> from",
            "An experiment that can: a second load.",
            "To tell payload_mass from valve_lag: a second load.",
            "Of what is left in force, 43 % goes with speed &amp; pressure.",
            "&lt;b&gt;bold&lt;",
            "Held out from the fits: from 6.0 s",
            "<td class=\"n\">0 %</td><td class=\"n\">−3</td>",
        ] {
            assert!(page.contains(words), "{words}");
        }
        assert!(!page.contains("<b>") && !page.contains("<i>"));
    }

    #[test]
    fn page_says_where_the_fit_had_to_see_all_samples() {
        let unseen = everything(Verdict::Explained, Vec::new());
        let page = page_of(&Diagnosis { saw_all: true, ..unseen.clone() });
        assert!(page.contains("that the fit had to see") && !page.contains("Held out from the fits"));
        assert!(!page.contains("that no fit saw") && page_of(&unseen).contains("that no fit saw"));
    }

    #[test]
    fn page_of_an_unknown_cause_shows_where_it_is_seen() {
        let seen = "Where the error shows best";
        assert!(page_of(&everything(Verdict::Unexplained, Vec::new())).contains(seen));
        assert!(!page_of(&everything(Verdict::Nominal, Vec::new())).contains(seen));
    }

    #[test]
    fn parameters_are_in_units_for_people() {
        let parameter = |name, value: f64, unit| {
            let half = 0.02 * value.abs();
            FittedParameter { name, value, low: value - half, high: value + half, unit }
        };
        let shown = |parameter: &FittedParameter| {
            let (unit, size) = parameter_unit(parameter);
            format!("{} {unit}", rounded_to(parameter.value / size, (parameter.high - parameter.low) / size))
        };
        assert_eq!(shown(&parameter("friction_hysteresis.half_width_per_pressure", 1.267e-4, "N/Pa")), "12.67 N/bar");
        assert_eq!(shown(&parameter("valve_lag.time_constant", 0.05, "s")), "50.0 ms");
        assert_eq!(shown(&parameter("viscous_damping.contraction", -41.3, "N.s/m")), "−41.3 N s/m");
    }

    #[test]
    fn digits_follow_the_interval() {
        assert_eq!(rounded_to(12.3456, 0.4), "12.35");
        assert_eq!(rounded_to(1234.5, 300.0), "1234");
        assert_eq!(rounded_to(0.5, 0.0), "0.5");
        assert_eq!(rounded_to(-0.0004, 0.1), "0.00");
        assert_eq!(three_digits(0.012_345), "0.0123");
    }
}
