//! The equations of motor, legs and link, for several machines side by side: one in each lane of wide registers.

pub mod gates;
pub mod legs;
pub mod links;
pub mod machine;
pub mod motion;
pub mod plane;
pub mod state;
pub mod terminals;
