//! What was computed of the last models.

use crate::parameters::Parameters;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// What was computed of so many models last, for all threads.
#[derive(Debug)]
pub struct Recent<T> {
    most: usize,
    models: Mutex<VecDeque<(Parameters, T)>>,
}

impl<T: Clone> Recent<T> {
    /// Keeps at most so many.
    pub fn new(most: usize) -> Self {
        Self { most, models: Mutex::default() }
    }

    /// What is known of a model, or what it takes to know it, which is kept.
    ///
    /// # Errors
    /// Those of what it takes.
    pub fn get_or<E>(&self, model: &Parameters, make: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let models = || self.models.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = models().iter().find(|(known, _)| known == model) {
            return Ok(known.clone());
        }
        let made = make()?;
        if self.most > 0 {
            let mut models = models();
            models.truncate(self.most - 1);
            models.push_front((*model, made.clone()));
        }
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_made_last_is_not_made_again() {
        let recent = Recent::new(2);
        let of = |mass: f64| {
            let mut model = Parameters::default();
            model.load.mass = mass;
            let mut is_made = false;
            let value = recent.get_or::<()>(&model, || {
                is_made = true;
                Ok(mass)
            });
            assert_eq!(value, Ok(mass));
            is_made
        };
        assert_eq!([1.0, 2.0, 1.0, 3.0, 2.0, 1.0].map(of), [true, true, false, true, false, true]);
        let model = Parameters::default();
        assert_eq!(recent.get_or(&model, || Err("diverged")), Err("diverged"));
        assert_eq!(recent.get_or::<()>(&model, || Ok(4.0)), Ok(4.0));
    }
}
