//! What the tests share: motors, ideal drives, and a detector that plays a script.

use standstill_detect::Decay;
use standstill_interface::{Dq, Nanos};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, GateTiming, Inverter, OpenLeg};
use standstill_numeric::Heading;
use standstill_plant::{
    Cogging, Core, EddyBranch, FluxMap, Friction, Harmonics, MagneticCircuit, Magnetics, MapPoint, MapReport,
    MapSamples, Motor, Place, Temperature, built_in, built_in_names,
};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Case, Faults, RotorState, SensorSettings, Sensors, Streams, Tolerance};

#[path = "../../crates/sim/tests/runs/script/player.rs"]
mod player;

pub use player::Script;

pub fn paper_motor() -> Motor {
    built_in("paper-5k5").expect("built in")
}

/// The motor of the circuit-simulator reference: linear, L_A 9.2 mH, L_B −2.1 mH, R 1 Ω.
pub fn reference_motor() -> Motor {
    standstill_analysis::witness::forms::line_motor().expect("built in")
}

/// Every motor in every kind that the library knows: saturated and linear, frictionless, hot, with harmonics that keep
/// the phases alike, with cogging, with eddy currents, with all of it.
pub fn all_kinds_of_motors() -> Vec<Motor> {
    let mut all = Vec::new();
    for motor in built_in_names().filter_map(built_in) {
        let mut frictionless = motor.clone();
        frictionless.rotor.friction = Friction::default();
        let at = Temperature { winding: Some(120.0), magnet: Some(90.0) };
        let hot = motor.at_temperature(at).expect("survives");
        let size = motor.magnetics.inductance().smaller_eigenvalue();
        let rest = motor.magnetics.rest(Heading::ZERO).norm();
        let harmonics = Harmonics {
            inductance_4: 0.05 * size,
            asymmetry: 0.0,
            flux_5: 0.01 * rest,
            flux_7: -0.005 * rest,
        };
        let branch = EddyBranch { time_constant: 60e-6, d_depth: 0.25, q_depth: 0.15 };
        let with = |from: &Motor, magnetics| Motor { magnetics, ..from.clone() };
        let distorted = with(&motor, motor.magnetics.clone().with_harmonics(harmonics));
        let eddy = with(&motor, motor.magnetics.clone().with_eddy_currents(Some(branch)));
        let everything = hot.magnetics.clone().with_harmonics(harmonics).with_eddy_currents(Some(branch));
        let mut everything = with(&hot, everything);
        everything.rotor.cogging = Some(Cogging { torque: 0.4, periods: 6 });
        all.extend([motor.linearised(), frictionless, hot, distorted, eddy, everything, motor]);
    }
    all
}

/// A map of the motor's core up to `reach` in A, 31 × 31 points.
pub fn mapped(motor: &Motor, reach: f64) -> (Motor, MapReport) {
    let axis = |k: usize| reach * (k as f64 / 15.0 - 1.0);
    let point = |d: usize, q: usize| {
        let (i_d, i_q) = (axis(d), axis(q));
        let flux = motor.magnetics.core().flux_at(Dq::new(i_d, i_q)).expect("convex");
        MapPoint { i_d, i_q, psi_d: flux.d, psi_q: flux.q, place: Place::Cell(d + 1, q + 1) }
    };
    let points = (0..31).flat_map(|d| (0..31).map(move |q| point(d, q))).collect();
    let samples = MapSamples { file: "sampled".to_owned(), points, pole_pairs: None, resistance: None };
    let (map, report) = FluxMap::new(&samples).expect("a map");
    let magnetics = MagneticCircuit::new(Core::Map(map)).expect("convex");
    (Motor { magnetics, ..motor.clone() }, report)
}

/// Ideal switches and no dead time on a stiff link of 550 V; an idle leg with or without diodes.
pub fn ideal_inverter(open_leg: OpenLeg) -> Inverter {
    Inverter {
        bridge: Bridge { open_leg, ..Bridge::default() },
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(550.0),
        carrier_period: Nanos::from_micros(100),
    }
}

/// With usual drops and dead time.
pub fn usual_inverter(open_leg: OpenLeg) -> Inverter {
    let devices = Devices {
        kind: DeviceKind::Igbt,
        switch_drop: 0.9,
        switch_resistance: 50e-3,
        diode_drop: 1.0,
        diode_resistance: 30e-3,
    };
    let timing = GateTiming { dead_time: Nanos::from_micros(2), ..GateTiming::default() };
    Inverter {
        bridge: Bridge { devices, open_leg, ..Bridge::default() },
        gates: [timing; 3],
        ..ideal_inverter(open_leg)
    }
}

/// A case with exact sensors and a locked rotor.
pub fn exact_case(motor: &Motor, inverter: Inverter, angle_deg: f64) -> Case<'_> {
    Case {
        motor,
        inverter,
        sensors: Sensors::nominal(SensorSettings::IDEAL),
        start_angle: angle_deg.to_radians(),
        rotor: RotorState::Locked,
        memory: None,
        load_torque: 0.0,
        start_speed: 0.0,
        acceleration: 0.0,
        faults: Faults::default(),
        streams: Streams::new(1, 0),
        tolerance: Tolerance::default(),
        time_limit: Case::TIME_LIMIT,
    }
}

pub fn scenario(errors: ErrorSet, decay: Decay, rotor: RotorState) -> Scenario {
    Scenario::paper(paper_motor(), errors, decay, rotor, 1)
}
