//! What methods share: each part is one thing that a method does or knows, and none knows a method.

pub(crate) mod both_ways;
pub(crate) mod complex;
pub(crate) mod injection;
pub(crate) mod lines;
pub(crate) mod margin;
pub(crate) mod modulation;
pub(crate) mod polarity;
pub(crate) mod settle;
pub(crate) mod significance;
pub(crate) mod train;
