//! The saved state of an instance, and its bytes.
//!
//! # Format, version 1
//! All numbers are little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `SINEWFMU` |
//! | 4 | version of the format |
//! | 38 | GUID of the model, as text with braces |
//! | 1 | phase of the instance |
//! | 8 | stop time in s, infinite where there is none |
//! | 8 n | what [`sinew::model::Model::save`] gives |
//! | 8 | checksum of all of the above (FNV-1a) |

use crate::instance::Phase;
use sinew::Error;

const MAGIC: &[u8; 8] = b"SINEWFMU";
const VERSION: u32 = 1;
const GUID_LENGTH: usize = 38;
const HEADER_LENGTH: usize = MAGIC.len() + 4 + GUID_LENGTH + 1 + 8;
const CHECKSUM_LENGTH: usize = 8;

/// The saved state of an instance.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// GUID of the model.
    pub guid: &'static str,
    /// Where in the order of calls the instance was.
    pub phase: Phase,
    /// Stop time in s, infinite where there is none.
    pub stop_time: f64,
    /// Time, inputs, parameters and state of the model.
    pub values: Vec<f64>,
}

impl Snapshot {
    /// Number of bytes in [`Snapshot::to_bytes`].
    pub fn size(&self) -> usize {
        HEADER_LENGTH + 8 * self.values.len() + CHECKSUM_LENGTH
    }

    /// As bytes that may outlive the process.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.size());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(self.guid.as_bytes());
        bytes.push(self.phase as u8);
        bytes.extend_from_slice(&self.stop_time.to_le_bytes());
        self.values.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        bytes.extend_from_slice(&checksum(&bytes).to_le_bytes());
        bytes
    }

    /// Reads back what [`Snapshot::to_bytes`] wrote for a model with this GUID.
    ///
    /// # Errors
    /// [`Error::SavedState`]. Whether the model accepts the values is for the model to say.
    pub fn from_bytes(bytes: &[u8], guid: &'static str) -> sinew::Result<Self> {
        let wrong = |problem| Error::SavedState { problem };
        let cut_short = || wrong("it is cut short");
        let (bytes, checksum_read) = bytes.split_last_chunk::<CHECKSUM_LENGTH>().ok_or_else(cut_short)?;
        let (magic, rest) = bytes.split_first_chunk::<8>().ok_or_else(cut_short)?;
        if magic != MAGIC {
            return Err(wrong("it was not written by this FMU"));
        }
        let (version, rest) = rest.split_first_chunk::<4>().ok_or_else(cut_short)?;
        if u32::from_le_bytes(*version) != VERSION {
            return Err(wrong("it has another version of the format"));
        }
        if checksum(bytes) != u64::from_le_bytes(*checksum_read) {
            return Err(wrong("it is damaged"));
        }
        let (guid_read, rest) = rest.split_first_chunk::<GUID_LENGTH>().ok_or_else(cut_short)?;
        if guid_read != guid.as_bytes() {
            return Err(wrong("it is of another model or version"));
        }
        let ([phase], rest) = rest.split_first_chunk::<1>().ok_or_else(cut_short)?;
        let phase = Phase::SAVED.into_iter().find(|known| *known as u8 == *phase);
        let (stop_time, rest) = rest.split_first_chunk::<8>().ok_or_else(cut_short)?;
        let stop_time = f64::from_le_bytes(*stop_time);
        let (values, left) = rest.as_chunks::<8>();
        let values = values.iter().map(|value| f64::from_le_bytes(*value)).collect();
        match phase {
            Some(phase) if left.is_empty() && !stop_time.is_nan() => Ok(Self { guid, phase, stop_time, values }),
            _ => Err(wrong("it holds values that no simulation has")),
        }
    }
}

/// FNV-1a, 64 bit.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GUID: &str = "{01234567-89ab-cdef-0123-456789abcdef}";

    #[test]
    fn bytes_read_back_exactly() {
        let values = vec![0.1, -0.0, f64::MAX, 5e-324];
        let saved = Snapshot { guid: GUID, phase: Phase::StepComplete, stop_time: f64::INFINITY, values };
        assert_eq!(saved.to_bytes().len(), saved.size());
        assert_eq!(Snapshot::from_bytes(&saved.to_bytes(), GUID).unwrap(), saved);
    }

    #[test]
    fn no_damage_goes_unnoticed() {
        let saved = Snapshot { guid: GUID, phase: Phase::StepComplete, stop_time: 1.0, values: vec![0.5; 3] };
        let bytes = saved.to_bytes();
        for length in 0..bytes.len() {
            Snapshot::from_bytes(&bytes[..length], GUID).unwrap_err();
        }
        for position in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[position] ^= 0x10;
            Snapshot::from_bytes(&damaged, GUID).unwrap_err();
        }
        Snapshot::from_bytes(&bytes, "{11234567-89ab-cdef-0123-456789abcdef}").unwrap_err();
    }
}
