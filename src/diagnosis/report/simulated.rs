//! `simulated.csv`.

use crate::measurement::Recording;
use crate::simulation::{OUTPUTS, Replay};
use std::fmt::Write;

/// Measured and simulated signals of all recordings as CSV, in SI units; `replays` are those of each recording, one by each of the models with
/// these labels.
pub fn simulated_csv<const N: usize>(labels: [&str; N], recordings: &[Recording], replays: &[[Replay; N]]) -> Vec<u8> {
    let mut text = String::from("recording,time [s]");
    for signal in OUTPUTS {
        let _ = write!(text, ",measured_{} [{}]", signal.name(), signal.unit());
        labels.iter().for_each(|label| {
            let _ = write!(text, ",{label}_{} [{}]", signal.name(), signal.unit());
        });
    }
    text.push('\n');
    for (recording, replays) in recordings.iter().zip(replays) {
        let name = quoted(&recording.name());
        for (k, time) in recording.time.iter().enumerate() {
            let _ = write!(text, "{name},{time}");
            for signal in OUTPUTS {
                let measured = recording.get(signal).map(|values| values[k]).filter(|value| !value.is_nan());
                let columns = std::iter::once(measured).chain(replays.iter().map(|r| r.get(signal).map(|v| v[k])));
                columns.for_each(|value| {
                    let _ = write!(text, ",{}", value.map(|value| value.to_string()).unwrap_or_default());
                });
            }
            text.push('\n');
        }
    }
    text.into_bytes()
}

/// A CSV cell that may hold separators.
fn quoted(text: &str) -> String {
    let mut writer = csv::WriterBuilder::new().terminator(csv::Terminator::Any(b'\n')).from_writer(Vec::new());
    writer.write_record([text]).expect("memory takes every write");
    let bytes = writer.into_inner().expect("memory takes every write");
    String::from_utf8_lossy(&bytes).trim_end().to_owned()
}
