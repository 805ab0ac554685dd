//! `standstill`: a test bench for initial rotor position detection of permanent-magnet synchronous motors.

use std::process::ExitCode;

fn main() -> ExitCode {
    standstill_cli::main()
}
