//! Machines whose iron remembers, and commands to play.

use crate::script::*;
use standstill_interface::{Command, Leg, Nanos, Reading, Sampling};
use standstill_inverter::{Bridge, DcLink, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Core, Hysteresis, Linear, MagneticCircuit, Motor, Winding, built_in};
use standstill_sim::{Case, Ended, Ledger, NoProbe, Run, run};

use Leg::{Duty, High, Low, Off};

pub fn pulse(on: [Leg<f64>; 3], off: [Leg<f64>; 3], micros: u64) -> Command<f64> {
    sampled(Command::sequence(stage(on, micros), stage(off, 3 * micros), Sampling::NONE), 16)
}

pub const USUAL: Devices = Devices {
    switch_drop: 0.9,
    switch_resistance: 50e-3,
    diode_drop: 1.0,
    diode_resistance: 30e-3,
    kind: standstill_inverter::DeviceKind::Igbt,
};

pub fn inverter(devices: Devices, open_leg: OpenLeg) -> Inverter {
    let dead_time = Nanos::from_micros(u64::from(devices != Devices::default()) * 2);
    Inverter {
        bridge: Bridge { devices, open_leg, ..Bridge::default() },
        gates: [GateTiming { dead_time, ..GateTiming::default() }; 3],
        link: DcLink::stiff(LINK),
        carrier_period: Nanos::from_micros(100),
    }
}

pub fn case(motor: &Motor, inverter: Inverter) -> Case<'_> {
    Case { start_angle: 0.35, ..Case::new(motor, inverter) }
}

/// A linear motor without saliency, of 10 mH and next to no resistance.
pub fn linear(hysteresis: Hysteresis) -> Motor {
    let winding = Winding { mean_inductance: 10e-3 / 1.5, saliency: 0.0, leakage: 0.0 };
    let core = Core::Linear(Linear::from_winding(&winding, 0.45));
    let magnetics = MagneticCircuit::new(core).expect("linear").with_hysteresis(Some(hysteresis));
    Motor { resistance: 1e-6, winding, magnetics, ..built_in("paper-5k5").expect("built in") }
}

pub fn of(name: &str, share: f64, cells: u8) -> Motor {
    let motor = built_in(name).expect("built in");
    let hysteresis = Hysteresis { coercive_current: share * motor.rated_current, depth: 0.05, cells };
    let magnetics = motor.magnetics.clone().with_hysteresis(Some(hysteresis));
    Motor { magnetics, ..motor }
}

pub fn play(case: &Case, commands: &[Command<f64>]) -> (Run<f64>, Vec<Reading<f64>>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, true, &mut NoProbe);
    assert!(!matches!(run.ended, Ended::Error(_)), "{:?} {:?}", run.ended, run.work);
    (run, script.readings)
}

pub fn ledger(case: &Case, commands: &[Command<f64>]) -> Ledger {
    play(case, commands).0.ledger.expect("asked for")
}

pub fn sequences(micros: u64) -> [(&'static str, Vec<Command<f64>>); 4] {
    let off = [Off; 3];
    let pwm =
        |a, b, c| sampled(Command::hold(stage([Duty(a), Duty(b), Duty(c)], 6 * micros), Sampling::NONE), 20);
    [
        (
            "fast",
            [[High, Low, Off], [Low, High, Off], [Off, High, Low], [Off, Low, High]]
                .map(|on| pulse(on, off, micros))
                .into(),
        ),
        (
            "slow",
            [[High, Low, Off], [Off, High, Low], [Low, Off, High]]
                .map(|on| pulse(on, [Low, Low, Off], micros))
                .into(),
        ),
        ("vector", vec![pulse([High, Low, Low], off, micros), pulse([Low, High, High], [Low; 3], micros)]),
        ("pwm", vec![pwm(0.6, 0.45, 0.41), pwm(0.45, 0.52, 0.55), pwm(0.55, 0.45, 0.5)]),
    ]
}
