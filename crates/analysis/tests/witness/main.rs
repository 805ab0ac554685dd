//! Problems of others, through the public doors of this crate: [`sensitivity`] by the shares that `budget` prints, [`optimiser`] by the
//! search of `tune`.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod optimiser;
mod sensitivity;
