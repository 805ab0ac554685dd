//! Parts that methods share; none of them knows a method.

pub(crate) mod both_ways;
pub(crate) mod complex;
pub(crate) mod injection;
pub(crate) mod instant;
pub(crate) mod lines;
pub(crate) mod losses;
pub(crate) mod margin;
pub(crate) mod modulation;
pub(crate) mod plausibility;
pub(crate) mod polarity;
pub(crate) mod settle;
pub(crate) mod significance;
pub(crate) mod then_pole;
pub(crate) mod train;
pub(crate) mod turning;
pub(crate) mod windows;
