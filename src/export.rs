//! Everything that is exported, written whole or not at all.

use crate::model::Interface;
use crate::models::models;
use crate::package::{Library, fmu};
use crate::parameters::Parameters;
use crate::{Error, Result, ssp};
use rayon::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes the FMUs of all models, and the closed loop made of them, into a folder and returns their paths.
///
/// # Errors
/// [`Error::Io`]; no FMU is then half-written.
pub fn export(parameters: &Parameters, libraries: &[Library], folder: &Path) -> Result<Vec<PathBuf>> {
    let interfaces: Vec<_> = models().iter().map(|model| model.interface()).collect();
    let fmus = || {
        let named = |interface: &Interface| folder.join(format!("{}.fmu", interface.name));
        interfaces.par_iter().map(|interface| (named(interface), fmu(interface, parameters, libraries))).collect()
    };
    let system = || (folder.join(ssp::FILE_NAME), ssp::closed_loop(parameters, libraries));
    let (mut files, system): (Vec<_>, _) = rayon::join(fmus, system);
    files.push(system);
    write_whole(files)
}

/// Writes files whole or not at all, making their folders: each is written under another name first and renamed when
/// all are complete.
///
/// # Errors
/// [`Error::Io`] with the path that could not be written.
pub fn write_whole(files: Vec<(PathBuf, Vec<u8>)>) -> Result<Vec<PathBuf>> {
    let mut complete = Vec::new();
    for (path, bytes) in files {
        let io = |source| Error::Io { path: path.clone(), source };
        if path.is_dir() {
            return Err(io(std::io::Error::other("there is a folder of this name: remove it or choose another --out")));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source })?;
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // the umask narrows it
        let mut file = builder.tempfile_in(folder).map_err(io)?;
        file.write_all(&bytes).map_err(io)?;
        complete.push((path, file));
    }
    let mut written = Vec::new();
    for (path, file) in complete {
        file.persist(&path).map_err(|error| Error::Io { path: path.clone(), source: error.error })?;
        written.push(path);
    }
    Ok(written)
}
