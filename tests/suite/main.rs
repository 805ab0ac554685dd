//! The test suite. Names carry the kind of evidence: `analytic_` against a closed form, `law_` against a law of
//! physics, `cross_` against another program, `regress_` against a mistake once made.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod accuracy;
mod amplifiers;
mod bench;
mod convergence;
mod determinism;
mod draws;
mod edges;
mod energy;
mod error_sets;
mod failures;
mod hysteresis;
mod lanes;
mod magnetics;
mod methods;
mod pulse;
mod random;
mod random_detections;
mod random_gates;
mod readings;
mod referee;
mod reference;
mod rotor;
mod sensors;
mod shunt;
mod spice;
mod tables;
mod tape;
