//! Plots as SVG: for `sinew simulate`, and for a report that is read without JavaScript.

use super::display_unit;
use crate::Result;
use crate::measurement::{Recording, Signal};
use crate::parameters::Parameters;
use crate::plot::{Curve, plot};
use crate::simulation::{OUTPUTS, Replay, replay, replay_muscle};

/// Measured against simulated over time for every signal, as SVG; the simulations are those of the nominal model and, where there is one, of
/// the extended model.
pub fn time_plots(recording: &Recording, replays: &[Replay]) -> Vec<String> {
    let name = recording.name();
    let mut plots = Vec::new();
    for signal in OUTPUTS {
        let simulated: Option<Vec<&[f64]>> = replays.iter().map(|replay| replay.get(signal)).collect();
        let (Some(measured), Some(simulated)) = (recording.get(signal), simulated) else { continue };
        let (unit, size) = display_unit(signal);
        let shown: Vec<Vec<f64>> =
            [measured].into_iter().chain(simulated).map(|all| all.iter().map(|value| value / size).collect()).collect();
        let labels = ["measured", "nominal", "extended"].into_iter().zip(&shown).enumerate();
        let curves: Vec<Curve> =
            labels.map(|(color, (label, y))| Curve { label, x: &recording.time, y, color }).collect();
        let label = format!("{} [{unit}]", signal.name().replace('_', " "));
        plots.push(plot(&format!("{name}: {}", signal.name().replace('_', " ")), "time [s]", &label, &curves));
    }
    plots
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
