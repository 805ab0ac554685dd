//! Tables and figures from records.

pub mod figure;
pub mod page;
pub mod study;
pub mod table;
