//! The library as a host sees it: through its C interface.

mod calls;
mod contract;
mod host;
mod loading;
mod simulation;
mod state;
