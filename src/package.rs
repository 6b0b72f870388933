//! FMUs as files: description, library, documentation and parameters in a zip whose bytes depend on nothing else.

use crate::effects::Effects;
use crate::model::Interface;
use crate::model_description::model_description;
use crate::parameters::Parameters;
use crate::{Error, Result, input};
use minijinja::context;
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// The FMU library for the platform of this binary.
pub const EMBEDDED_LIBRARY: &[u8] = include_bytes!(env!("SINEW_EMBEDDED_LIBRARY"));
/// FMI's name for the platform of [`EMBEDDED_LIBRARY`].
pub const EMBEDDED_PLATFORM: &str = env!("SINEW_EMBEDDED_PLATFORM");

/// Platforms of FMI 2.0 and the extension of a library there.
const PLATFORMS: &[(&str, &str)] =
    &[("linux64", "so"), ("linux32", "so"), ("win64", "dll"), ("win32", "dll"), ("darwin64", "dylib")];

/// Bytes with which a shared library begins, by its extension: ELF, PE, Mach-O of 64 bit or of several processors.
const BEGINNINGS: [(&str, &[u8]); 4] =
    [("so", b"\x7fELF"), ("dll", b"MZ"), ("dylib", b"\xcf\xfa\xed\xfe"), ("dylib", b"\xca\xfe\xba\xbe")];

/// The FMU library for one platform.
#[derive(Debug, Clone)]
pub struct Library {
    platform: &'static str,
    extension: &'static str,
    bytes: Vec<u8>,
}

impl Library {
    /// The library inside this binary.
    ///
    /// # Errors
    /// [`Error::Platform`] on a system that FMI 2.0 has no name for.
    pub fn embedded() -> Result<Self> {
        Self::new(EMBEDDED_PLATFORM, EMBEDDED_LIBRARY.to_vec())
    }

    /// A library from `PLATFORM=FILE`.
    ///
    /// # Errors
    /// [`Error::Platform`], [`Error::Io`], [`Error::NoLibrary`] for another file than a library for the platform.
    pub fn from_argument(argument: &str) -> Result<Self> {
        let (platform, file) = argument.split_once('=').ok_or(Error::Platform { argument: argument.to_owned() })?;
        let bytes = input::read(file.as_ref())?;
        let library = Self::new(platform, bytes)?;
        let begins =
            |(extension, start): &(&str, &[u8])| *extension == library.extension && library.bytes.starts_with(start);
        let no_library = || Error::NoLibrary { path: file.into(), platform: library.platform };
        if BEGINNINGS.iter().any(begins) { Ok(library) } else { Err(no_library()) }
    }

    fn new(platform: &str, bytes: Vec<u8>) -> Result<Self> {
        let known = PLATFORMS.iter().find(|(name, _)| *name == platform);
        let (platform, extension) = *known.ok_or(Error::Platform { argument: platform.to_owned() })?;
        Ok(Self { platform, extension, bytes })
    }
}

/// The embedded library and those given as `PLATFORM=FILE`; a given one takes the place of the embedded one.
///
/// # Errors
/// As [`Library::embedded`] and [`Library::from_argument`].
pub fn libraries(arguments: &[String]) -> Result<Vec<Library>> {
    let mut all = vec![Library::embedded()?];
    for argument in arguments {
        let library = Library::from_argument(argument)?;
        all.retain(|other| other.platform != library.platform);
        all.push(library);
    }
    all.sort_by_key(|library| library.platform);
    Ok(all)
}

/// The bytes of the FMU of one model.
pub fn fmu(interface: &Interface, parameters: &Parameters, libraries: &[Library]) -> Vec<u8> {
    let name = interface.name;
    let mut files = vec![
        ("modelDescription.xml".to_owned(), model_description(interface, parameters).into_bytes()),
        ("model.png".to_owned(), include_bytes!("package/icon.png").to_vec()),
        ("documentation/index.html".to_owned(), documentation(interface, parameters).into_bytes()),
        ("documentation/licenses/license.txt".to_owned(), include_bytes!("../LICENSE").to_vec()),
        ("resources/parameters.toml".to_owned(), parameters.to_toml().into_bytes()),
    ];
    for Library { platform, extension, bytes } in libraries {
        files.push((format!("binaries/{platform}/{name}.{extension}"), bytes.clone()));
    }
    zip(&files)
}

pub(crate) fn zip(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(4))
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    for (name, bytes) in files {
        let written = writer.start_file(name, options).map(|()| writer.write_all(bytes));
        written.expect("a new name").expect("memory takes every write");
    }
    writer.finish().expect("memory takes every write").into_inner()
}

/// The page that explains a model: equation, limits, source, variables with their values, effects.
fn documentation(interface: &Interface, parameters: &Parameters) -> String {
    let variables: Vec<_> = interface
        .variables
        .iter()
        .map(|variable| {
            let declaration = variable.declaration;
            let start = parameters
                .find(declaration.name)
                .map(|(_, value)| declaration.choice(value).map_or_else(|| short(value), str::to_owned));
            context! {
                name => variable.name,
                role => declaration.role_name(),
                unit => declaration.unit.symbol,
                description => declaration.description,
                start,
                min => declaration.min.is_finite().then(|| short(declaration.min)),
                max => declaration.max.is_finite().then(|| short(declaration.max)),
            }
        })
        .collect();
    let effects: Vec<_> = Effects::DESCRIPTIONS
        .iter()
        .filter(|effect| interface.variables.iter().any(|v| v.declaration.group() == effect.name))
        .map(|effect| {
            context! {
                name => effect.name, meaning => effect.meaning, equation => effect.equation,
                signature => effect.signature, reference => effect.reference,
            }
        })
        .collect();
    let page = context! {
        name => interface.name,
        description => interface.description,
        documentation => context! {
            equation => interface.documentation.equation,
            limits => interface.documentation.limits,
            source => interface.documentation.source,
        },
        variables,
        effects,
        version => env!("CARGO_PKG_VERSION"),
    };
    render("index.html", include_str!("package/index.html"), &page)
}

/// Fills a template that ships with the program; everything in it is escaped for HTML.
pub(crate) fn render(name: &str, template: &str, values: &minijinja::Value) -> String {
    let mut environment = minijinja::Environment::new();
    environment.add_template(name, template).expect("a template that ships is valid");
    let template = environment.get_template(name).expect("it was just added");
    template.render(values).expect("a template that ships renders")
}

/// A number for people, with four significant digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (value.fract() == 0.0 && value.abs() < 1e4) {
        return value.to_string();
    }
    if value.abs() >= 1e6 {
        return format!("{value:.3e}");
    }
    #[allow(clippy::cast_possible_truncation)]
    let digits = 3 - value.abs().log10().floor() as i32;
    match digits {
        0..=6 => {
            let text = format!("{value:.*}", digits.unsigned_abs() as usize);
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        ..0 => format!("{value:.0}"),
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_library_for_its_platform_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("library");
        let given = |platform: &str, bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            Library::from_argument(&format!("{platform}={}", path.display())).map_err(|error| error.to_string())
        };
        for (platform, bytes) in [("linux64", &b"\x7fELF\x02"[..]), ("win32", b"MZ"), ("darwin64", b"\xcf\xfa\xed\xfe")]
        {
            given(platform, bytes).unwrap();
            let refused = given(platform, b"# Sinew").unwrap_err();
            let expected = format!("{}: no shared library for {platform}", path.display());
            assert!(refused.starts_with(&expected), "{refused}");
        }
        given("win64", b"\x7fELF\x02").unwrap_err();
    }
}
