//! Force models fitted to what was measured.
//!
//! [`points`] finds static points in recordings, [`structure`] what of a model they can tell, [`mod@fit`] its parameters;
//! [`report`] says it.

pub mod fit;
pub mod points;
pub mod structure;
