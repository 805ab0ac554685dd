//! Runs of the simulator alone: closed forms, balances of energy, the referee. One program, which links and compiles the simulator once.

mod comparators;
mod dividers;
mod driven;
mod faults;
mod hysteresis;
mod script;
mod shorted;
mod supply;
mod terminals;
mod turning;
