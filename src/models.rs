//! The models that are exported as FMUs.

use crate::controller::PidFeedForward;
use crate::model::{Interface, Model, Registered, Simulator};
use crate::parameters::Parameters;
use crate::plant::{PneumaticActuator, PneumaticMuscle};
use crate::reference::ReferenceTrajectory;
use std::sync::LazyLock;

macro_rules! models {
    ($($System:ty,)*) => {
        $(
            impl Registered for $System {
                fn interface() -> &'static Interface {
                    static INTERFACE: LazyLock<Interface> = LazyLock::new(Interface::of::<$System>);
                    &INTERFACE
                }
            }
        )*

        /// One fresh simulation of every model that is exported as an FMU, with default parameters.
        pub fn models() -> Vec<Box<dyn Model>> {
            vec![$(Box::new(Simulator::<$System>::new(Parameters::default())),)*]
        }
    };
}

models! {
    PneumaticMuscle,
    PneumaticActuator,
    PidFeedForward,
    ReferenceTrajectory,
}
