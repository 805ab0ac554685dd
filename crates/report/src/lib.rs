//! Tables and figures from records.

pub mod figure;
pub mod table;
pub mod page;
