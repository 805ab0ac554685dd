//! The equations of motor, legs and link, of several machines side by side.

pub mod gates;
pub mod legs;
pub mod links;
pub mod machine;
pub mod motion;
pub mod plane;
pub mod state;
pub mod terminals;
