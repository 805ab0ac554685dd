//! Figures and pages of results.

pub mod figure;
pub mod page;
pub mod study;

/// The figures of the gallery, which tests of the layout draw, name the crate as others do.
#[cfg(test)]
extern crate self as standstill_report;
