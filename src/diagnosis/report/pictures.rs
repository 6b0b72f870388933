//! Plots as SVG: for `sinew simulate`, and for a report that is read without JavaScript.

use super::display_unit;
use crate::Result;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::{OUTPUTS, replay, replay_muscle};

/// Measured against simulated over time, and the residual over the contraction, as SVG.
///
/// # Errors
/// Errors of the simulation.
pub fn recording_plots(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Vec<String>> {
    let mut plots = time_plots(nominal, extended, recording)?;
    plots.extend(residual_plot(nominal, extended, recording)?);
    Ok(plots)
}

/// Measured against simulated over time for every signal, as SVG.
///
/// # Errors
/// Errors of the simulation.
pub fn time_plots(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Vec<String>> {
    let (before, after) = (replay(nominal, recording)?, replay(extended, recording)?);
    let name = recording.name();
    let mut plots = Vec::new();
    for signal in OUTPUTS {
        let (Some(measured), Some(before), Some(after)) =
            (recording.get(signal), before.get(signal), after.get(signal))
        else {
            continue;
        };
        let (unit, size) = display_unit(signal);
        let shown = |values: &[f64]| values.iter().map(|value| value / size).collect::<Vec<_>>();
        let (measured, before, after) = (shown(measured), shown(before), shown(after));
        let curve = |label, y, color| Curve { label, x: &recording.time, y, color };
        let mut curves = vec![curve("measured", measured.as_slice(), 0), curve("nominal", before.as_slice(), 1)];
        if nominal != extended {
            curves.push(curve("extended", after.as_slice(), 2));
        }
        let label = format!("{} [{unit}]", signal.name().replace('_', " "));
        plots.push(plot(&format!("{name}: {}", signal.name().replace('_', " ")), "time [s]", &label, &curves));
    }
    Ok(plots)
}

/// The residual over the contraction: of the force, with the chain cut at the measured pressure and contraction, where
/// these were measured; else of the contraction.
///
/// # Errors
/// Errors of the simulation.
pub fn residual_plot(nominal: &Parameters, extended: &Parameters, recording: &Recording) -> Result<Option<String>> {
    let Some(contraction) = recording.get(Signal::Contraction) else { return Ok(None) };
    let cut = recording.get(Signal::GaugePressure).is_some() && recording.get(Signal::Force).is_some();
    let signal = if cut { Signal::Force } else { Signal::Contraction };
    let (unit, size) = display_unit(signal);
    let residual = |parameters: &Parameters| -> Result<Option<Vec<f64>>> {
        let simulated = if cut { replay_muscle(parameters, recording)? } else { replay(parameters, recording)? };
        Ok(simulated.get(signal).zip(recording.get(signal)).map(|(simulated, measured)| {
            measured.iter().zip(simulated).map(|(measured, simulated)| (measured - simulated) / size).collect()
        }))
    };
    let (Some(before), Some(after)) = (residual(nominal)?, residual(extended)?) else { return Ok(None) };
    let x: Vec<f64> = contraction.iter().map(|value| value * 1e3).collect();
    let mut curves = vec![Curve { label: "nominal", x: &x, y: &before, color: 1 }];
    if nominal != extended {
        curves.push(Curve { label: "extended", x: &x, y: &after, color: 2 });
    }
    let what = if cut { "force, from measured pressure and contraction" } else { "contraction" };
    let title = format!("{}: residual of the {what}", recording.name());
    Ok(Some(plot(&title, "contraction [mm]", &format!("measured − simulated [{unit}]"), &curves)))
}
