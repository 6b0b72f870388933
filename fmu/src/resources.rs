//! Where the parameter file of an FMU is, and what it says.

use crate::refusal::Refusal;
use sinew::parameters::Parameters;
use std::path::PathBuf;

/// Name of the file with the start values, in the resources of every FMU.
pub const PARAMETER_FILE: &str = "parameters.toml";

/// The start values of an FMU.
///
/// # Errors
/// [`Refusal::ResourceLocation`] where the location is no folder on this machine; [`Refusal::Model`] where the
/// parameter file cannot be read or used.
pub fn start_parameters(location: &str) -> Result<Parameters, Refusal> {
    let path = folder(location)?.join(PARAMETER_FILE);
    let text = std::fs::read_to_string(&path).map_err(|source| sinew::Error::Io { path: path.clone(), source })?;
    let mut parameters = Parameters::default();
    parameters.apply_toml(&text, &path.display().to_string())?;
    Ok(parameters)
}

/// The folder that a `file:` URI means. A plain path, which some hosts pass, means itself.
fn folder(location: &str) -> Result<PathBuf, Refusal> {
    let refused = || Refusal::ResourceLocation { location: location.to_owned() };
    let Some((scheme, rest)) = location.split_once(':').filter(|(scheme, _)| !is_drive(scheme)) else {
        return if location.is_empty() { Err(refused()) } else { Ok(location.into()) };
    };
    if !scheme.eq_ignore_ascii_case("file") || rest.is_empty() {
        return Err(refused());
    }
    let path = match rest.strip_prefix("//") {
        Some(after) => after.strip_prefix("localhost").filter(|path| path.starts_with('/')).unwrap_or(after),
        None => rest,
    };
    if !path.starts_with('/') {
        return Err(refused()); // on another machine
    }
    let decoded = String::from_utf8(percent_decoded(path)).map_err(|_| refused())?;
    let drive = decoded[1..].split_once(':').is_some_and(|(drive, _)| is_drive(drive));
    Ok(decoded[usize::from(drive)..].into())
}

fn is_drive(text: &str) -> bool {
    text.len() == 1 && text.chars().all(|letter| letter.is_ascii_alphabetic())
}

/// Replaces `%20` and the like. A `%` without two digits stays, as some hosts do not encode paths.
fn percent_decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).and_then(|&byte| char::from(byte).to_digit(16));
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((high * 16 + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    decoded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_folder_is_understood() {
        for (location, expected) in [
            ("file:///tmp/my%20fmu/resources", "/tmp/my fmu/resources"),
            ("file:/tmp/resources/", "/tmp/resources/"),
            ("file://localhost/tmp/r", "/tmp/r"),
            ("FILE:///tmp/gr%C3%B6%C3%9Fe", "/tmp/größe"),
            ("file:///tmp/100%/a%2", "/tmp/100%/a%2"),
            ("file:///localhost/r", "/localhost/r"),
            ("file:///C:/Users/me/r", "C:/Users/me/r"),
            ("file:///c%3A/r", "c:/r"),
            ("/tmp/100%25", "/tmp/100%25"),
            ("C:\\fmu\\resources", "C:\\fmu\\resources"),
            ("relative/resources", "relative/resources"),
        ] {
            assert_eq!(folder(location).unwrap(), PathBuf::from(expected), "{location}");
        }
    }

    #[test]
    fn what_is_no_folder_here_is_refused() {
        for location in ["", "file:", "http://example.org/r", "file://elsewhere/r", "file:relative", "file:///%ff"] {
            assert!(matches!(folder(location), Err(Refusal::ResourceLocation { .. })), "{location}");
        }
    }
}
