//! Files that are read: whole, and no more than fits.

use crate::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes of the largest file that is read: more than two hours of ten columns at 1 kHz. A device need not end at all.
const LARGEST: u64 = 1_000_000_000;

/// All bytes of a file or pipe.
///
/// # Errors
/// [`Error::Io`], also for more than 1 GB.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    read_up_to(LARGEST, path)
}

/// The text of a file or pipe.
///
/// # Errors
/// As [`read`]; [`Error::Io`] for what is not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let no_text = |_| std::io::Error::new(std::io::ErrorKind::InvalidData, "not UTF-8 text: save the file as UTF-8");
    String::from_utf8(read(path)?).map_err(no_text).map_err(|source| Error::Io { path: path.to_owned(), source })
}

fn read_up_to(largest: u64, path: &Path) -> Result<Vec<u8>> {
    let io = |source| Error::Io { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(largest + 1).read_to_end(&mut bytes)).map_err(io)?;
    if bytes.len() as u64 > largest {
        let problem = "holds more than 1 GB, or never ends as some devices: give a smaller file";
        return Err(io(std::io::Error::other(problem)));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_is_refused() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("LICENSE");
        let size = path.metadata().unwrap().len();
        assert_eq!(read_up_to(size, &path).unwrap().len() as u64, size);
        let refused = read_up_to(size - 1, &path).unwrap_err().to_string();
        let expected = "holds more than 1 GB, or never ends as some devices: give a smaller file";
        assert_eq!(refused, format!("{}: {expected}", path.display()));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_without_end_is_refused() {
        let refused = read_up_to(1000, Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(refused.starts_with("/dev/zero: holds more than"), "{refused}");
    }
}
