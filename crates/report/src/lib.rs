//! Figures and pages of results.

pub mod figure;
pub mod page;
pub mod study;
