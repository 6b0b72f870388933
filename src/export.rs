//! Everything that is exported, written whole or not at all.

use crate::model::Interface;
use crate::models::models;
use crate::package::{Library, fmu};
use crate::parameters::Parameters;
use crate::{Error, Result, ssp};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The FMUs of all models, and the closed loop made of them, as paths in `folder` with their bytes.
pub fn files(parameters: &Parameters, libraries: &[Library], folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let interfaces: Vec<_> = models().iter().map(|model| model.interface()).collect();
    let fmus = || {
        let named = |interface: &Interface| folder.join(format!("{}.fmu", interface.name));
        interfaces.par_iter().map(|interface| (named(interface), fmu(interface, parameters, libraries))).collect()
    };
    let system = || (folder.join(ssp::FILE_NAME), ssp::closed_loop(parameters, libraries));
    let (mut files, system): (Vec<_>, _) = rayon::join(fmus, system);
    files.push(system);
    files
}

/// Refuses to write over what was read, however it is spelt.
///
/// # Errors
/// [`Error::Overwrites`].
pub fn spare<'a>(written: impl IntoIterator<Item = &'a Path>, read: &[PathBuf]) -> Result<()> {
    let read: BTreeSet<PathBuf> = read.iter().filter_map(|path| path.canonicalize().ok()).collect();
    let was_read = |path: &&Path| path.canonicalize().is_ok_and(|path| read.contains(&path));
    let found = written.into_iter().find(was_read);
    found.map_or(Ok(()), |path| Err(Error::Overwrites { path: path.to_owned() }))
}

/// Writes files whole or not at all, making their folders: each is written under another name first and renamed when
/// all are complete. What was `read` to make them stays as it is.
///
/// # Errors
/// [`Error::Overwrites`] for a file that was read; [`Error::Io`] with the path that could not be written.
pub fn write_whole(files: Vec<(PathBuf, Vec<u8>)>, read: &[PathBuf]) -> Result<Vec<PathBuf>> {
    spare(files.iter().map(|(path, _)| path.as_path()), read)?;
    let mut complete = Vec::new();
    for (path, bytes) in files {
        let io = |source| Error::Io { path: path.clone(), source };
        if path.is_dir() {
            return Err(io(std::io::Error::other("there is a folder of this name: remove it or choose another --out")));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder).map_err(|source| no_folder(folder, source))?;
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // the umask narrows it
        // The other name is nobody's business.
        let mut file = builder.tempfile_in(folder).map_err(|error| io(error.kind().into()))?;
        file.as_file_mut().write_all(&bytes).map_err(io)?;
        complete.push((path, file));
    }
    let mut written = Vec::new();
    for (path, file) in complete {
        file.persist(&path).map_err(|error| Error::Io { path: path.clone(), source: error.error })?;
        written.push(path);
    }
    Ok(written)
}

/// A folder that cannot be made.
fn no_folder(folder: &Path, source: std::io::Error) -> Error {
    let in_the_way = folder.ancestors().find(|path| path.exists() && !path.is_dir());
    let source = in_the_way.map_or(source, |file| {
        std::io::Error::other(format!("{} is a file and no folder: choose another --out", file.display()))
    });
    Error::Io { path: folder.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_keeps_a_file_from_being_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "in the way").unwrap();
        for out in [file.clone(), file.join("out")] {
            let refused = write_whole(vec![(out.join("a.csv"), Vec::new())], &[]).unwrap_err().to_string();
            let expected = format!("{} is a file and no folder: choose another --out", file.display());
            assert_eq!(refused, format!("{}: {expected}", out.display()));
        }
    }

    #[test]
    fn what_was_read_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("simulated.csv");
        let files = |text: &str| vec![(path.clone(), text.as_bytes().to_vec())];
        write_whole(files("old"), &[]).unwrap();
        let elsewhere = folder.path().join("x").join("..").join("simulated.csv");
        std::fs::create_dir(folder.path().join("x")).unwrap();
        let refused = write_whole(files("new"), &[elsewhere]).unwrap_err().to_string();
        assert_eq!(refused, format!("this would overwrite {}, which was read: choose another --out", path.display()));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        write_whole(files("new"), &[folder.path().join("other.csv")]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    }
}
