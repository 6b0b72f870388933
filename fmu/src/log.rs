//! Sentences for the host's logger.

use crate::refusal::Refusal;
use sinew::model_description::LOG_CATEGORIES;

/// How a call ended.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// As asked.
    Ok = 0,
    /// Done, but something may not be as intended.
    Warning = 1,
    /// Not done; the instance is as before.
    Discard = 2,
    /// Refused.
    Error = 3,
    /// The instance can no longer be used.
    Fatal = 4,
}

impl Status {
    /// The log category of messages with this status.
    pub fn category(self) -> &'static str {
        match self {
            Self::Ok => "logEvents",
            Self::Warning => "logStatusWarning",
            Self::Discard | Self::Error => "logStatusError",
            Self::Fatal => "logStatusFatal",
        }
    }
}

/// Takes a status, a category and a text to the host.
pub type Logger = Box<dyn Fn(Status, &str, &str)>;

/// The host's logger, and what it wants to hear. Failures are always told.
pub struct Log {
    logger: Logger,
    enabled: Vec<&'static str>,
}

impl Log {
    /// A log with all categories on or off.
    pub fn new(logger: Logger, on: bool) -> Self {
        let mut log = Self { logger, enabled: Vec::new() };
        log.enable_all(on);
        log
    }

    fn enable_all(&mut self, on: bool) {
        self.enabled = LOG_CATEGORIES.iter().map(|(name, _)| *name).filter(|_| on).collect();
    }

    /// Turns the log off, or on for the named categories only, or for all where none is named.
    ///
    /// # Errors
    /// [`Refusal::UnknownCategory`]; the known ones count nevertheless.
    pub fn enable(&mut self, on: bool, names: &[&str]) -> Result<(), Refusal> {
        self.enable_all(on);
        if names.is_empty() {
            return Ok(());
        }
        self.enabled.retain(|known| names.contains(known));
        let is_known = |name: &str| LOG_CATEGORIES.iter().any(|(known, _)| *known == name);
        let unknown: Vec<_> = names.iter().filter(|name| !is_known(name)).map(|name| format!("`{name}`")).collect();
        if unknown.is_empty() { Ok(()) } else { Err(Refusal::UnknownCategory { names: unknown.join(", ") }) }
    }

    /// Tells the host, if it wants to hear it; the text is only made then.
    pub fn write(&self, status: Status, text: impl FnOnce() -> String) {
        if status >= Status::Discard || self.enabled.contains(&status.category()) {
            (self.logger)(status, status.category(), &text());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    #[test]
    fn failures_are_always_told_and_the_rest_by_category() {
        let told = Rc::new(RefCell::new(Vec::new()));
        let listener = Rc::clone(&told);
        let mut log = Log::new(Box::new(move |status, _, _| listener.borrow_mut().push(status)), false);
        let all = [Status::Ok, Status::Warning, Status::Discard, Status::Error, Status::Fatal];
        let heard = |log: &Log| {
            all.iter().for_each(|status| log.write(*status, String::new));
            told.take()
        };
        assert_eq!(heard(&log), all[2..]);
        log.enable(true, &[]).unwrap();
        assert_eq!(heard(&log), all);
        log.enable(false, &["logEvents"]).unwrap();
        assert_eq!(heard(&log), all[2..]);
        let unknown = log.enable(true, &["logEvents", "logNoise"]).unwrap_err();
        assert_eq!(unknown.to_string(), "there is no log category `logNoise`");
        assert_eq!(heard(&log), [Status::Ok, Status::Discard, Status::Error, Status::Fatal]);
    }
}
