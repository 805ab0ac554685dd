use crate::physics::plane::Plane;
use standstill_interface::Nanos;
use standstill_inverter::{Bridge, Conduction, DcLink, Gate, GateTiming, Inverter};
use standstill_plant::{Core, Hysteresis, Linear, MagneticCircuit, Motor, Winding, built_in};

use super::*;

/// If terminals have no capacitance, the step compiled without ringing terminals gives the same bits as the step for all machines.
#[test]
fn law_a_step_that_may_ring_is_the_other_where_nothing_rings() {
    use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperSwitch};
    let motor = built_in("paper-5k5").expect("a built-in motor");
    let timing = GateTiming { turn_off_delay: Nanos(300), turn_on_delay: Nanos(200), dead_time: Nanos(2000) };
    let inverter = Inverter {
        bridge: Bridge::default(),
        gates: [timing; 3],
        link: DcLink { ripple: 0.01, ..DcLink::stiff(550.0) },
        carrier_period: Nanos(100_000),
    };
    let mut seen = Vec::new();
    for free in [false, true] {
        for modes in
            [[UpperSwitch, LowerSwitch, Blocked], [UpperSwitch, LowerSwitch, LowerDiode], [Blocked; 3]]
        {
            let mut bank: Bank<'_, f64> = Bank::like(&motor, &inverter, &SensorSettings::IDEAL, free, false);
            bank.machine.put(0, &motor, &inverter.link, 0.4, 0.0);
            bank.machine.legs.put_bridge(0, &inverter.bridge);
            for (k, gate) in [Gate::High, Gate::Low, Gate::Off].into_iter().enumerate() {
                bank.machine.legs.gates[k].expect(0, Some((-2.0, -1.0, gate)));
            }
            bank.machine.legs.put(0, modes);
            bank.here.state.flux = Plane::new(0.46, -0.02);
            bank.here.state.link = 551.0;
            bank.look(0);
            let both = [
                {
                    let legs = bank.machine.legs.at::<true>(0.0, motor.resistance);
                    Tried::new::<true>(
                        &bank.machine,
                        &bank.bounds,
                        &legs,
                        &bank.here,
                        9e4,
                        &bank.control.accuracy,
                    )
                },
                {
                    let legs = bank.machine.legs.at::<false>(0.0, motor.resistance);
                    Tried::new::<false>(
                        &bank.machine,
                        &bank.bounds,
                        &legs,
                        &bank.here,
                        9e4,
                        &bank.control.accuracy,
                    )
                },
            ]
            .map(|tried| format!("{tried:?}"));
            assert_eq!(both[0], both[1], "{modes:?}, free: {free}");
            seen.extend(both);
        }
    }
    seen.dedup();
    assert_eq!(seen.len(), 6, "every machine takes a step of its own");
}

/// The inductance of a linear core, without the contribution of the play cells, stays constant over many steps: no part of the cells'
/// predicted stiffness remains in it.
#[test]
fn regress_cells_leave_nothing_in_the_inductance() {
    use Conduction::{LowerSwitch, UpperSwitch};
    let winding = Winding { mean_inductance: 10e-3 / 1.5, saliency: 0.0, leakage: 0.0 };
    let hysteresis = Hysteresis { coercive_current: 0.5, depth: 0.3, cells: 3 };
    let core = Core::Linear(Linear::from_winding(&winding, 0.45));
    let magnetics = MagneticCircuit::new(core).expect("linear").with_hysteresis(Some(hysteresis));
    let paper = built_in("paper-5k5").expect("a built-in motor");
    let motor = Motor { resistance: 30.0, winding, magnetics, ..paper };
    let inverter = Inverter {
        bridge: Bridge::default(),
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(550.0),
        carrier_period: Nanos(100_000),
    };
    let mut bank: Bank<'_, f64> = Bank::like(&motor, &inverter, &SensorSettings::IDEAL, false, false);
    bank.machine.put(0, &motor, &inverter.link, 0.4, 0.0);
    bank.machine.legs.put_bridge(0, &inverter.bridge);
    for (k, gate) in [Gate::High, Gate::Low, Gate::Low].into_iter().enumerate() {
        bank.machine.legs.gates[k].expect(0, Some((-2.0, -1.0, gate)));
    }
    bank.machine.legs.put(0, [UpperSwitch, LowerSwitch, LowerSwitch]);
    let cells = motor.magnetics.cells().expect("cells");
    // Magnetised across the voltage, so that the elastic flux of sliding cells turns.
    let memory = bank.machine.branch.as_mut().expect("it remembers");
    memory.put(0, cells, Plane::new(0.5, 0.0), 10e-3, 1e-7, Some(Plane::new(0.43, 0.9)));
    bank.here.state.flux = Plane::new(0.5, 0.0);
    bank.here.state.link = 550.0;
    bank.look(0);
    let (mut tangents, mut worst) = (Vec::new(), 0.0_f64);
    for step in 1..=40 {
        let legs = bank.machine.legs.at::<true>(bank.here.time, motor.resistance);
        bank.machine.find_modes(true, &legs, &mut bank.here.at, &bank.here.state);
        let until = f64::from(step) * 2e3;
        let tried =
            Tried::new::<true>(&bank.machine, &bank.bounds, &legs, &bank.here, until, &bank.control.accuracy);
        take(&bank.machine, false, &mut bank.here, &tried.end, true);
        let memory = bank.machine.branch.as_mut().expect("it remembers");
        memory.take(true, tried.end.state.flux, &tried.branch.expect("cells"));
        let (all, cells) = (bank.here.at.inverse_inductance, memory.stiffness());
        for (all, core) in [(all.xx - cells.xx, 100.0), (all.xy - cells.xy, 0.0), (all.yy - cells.yy, 100.0)]
        {
            worst = worst.max((all - core).abs());
        }
        tangents.push(cells.xy);
    }
    let turned = tangents.iter().fold(f64::NEG_INFINITY, |most, xy| most.max(*xy))
        - tangents.iter().fold(f64::INFINITY, |least, xy| least.min(*xy));
    assert!(turned > 1.0, "nothing turns");
    assert!(worst < 1e-11, "{worst:e} 1/H of 100");
}

/// If a leg's current flows against its mode before a step begins, no step can locate the mode's end: the error is `Stuck`, not
/// `NotFinite`.
#[test]
fn law_a_mode_that_had_ended_before_its_step_is_called_so() {
    use Conduction::{LowerSwitch, UpperSwitch};
    let motor = built_in("paper-5k5").expect("built in");
    let inverter = Inverter {
        bridge: Bridge::default(),
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(550.0),
        carrier_period: Nanos(100_000),
    };
    let begun_with = |flux: Plane<f64>, resistance: f64| {
        let mut bank: Bank<'_, f64> = Bank::like(&motor, &inverter, &SensorSettings::IDEAL, false, false);
        bank.machine.put(0, &motor, &inverter.link, 0.0, 0.0);
        bank.machine.legs.put_bridge(0, &inverter.bridge);
        for (k, gate) in [Gate::High, Gate::Low, Gate::Low].into_iter().enumerate() {
            bank.machine.legs.gates[k].expect(0, Some((-2.0, -1.0, gate)));
        }
        bank.machine.legs.put(0, [UpperSwitch, LowerSwitch, LowerSwitch]);
        bank.here.state.flux = flux;
        bank.here.state.link = 550.0;
        bank.machine.resistance = resistance;
        (bank.schedule.live, bank.schedule.stop) = (1, 1e3);
        (bank.control.next, bank.control.longest) = (1e3, 1e3);
        bank.look(0);
        let mut steps = 0;
        while bank.outcome.served.broken == 0 && bank.here.time < 1e3 && steps < 1000 {
            bank.step();
            steps += 1;
        }
        (bank.outcome.served.broken, bank.why_broken(0))
    };
    let begun = |flux: Plane<f64>| begun_with(flux, 1.0);
    // A flux below the magnet's: some amperes flow out of the winding into a leg whose upper switch conducts.
    let backwards = begun(Plane::new(0.40, 0.0));
    let (1, error @ RunError::Stuck(place)) = backwards else { panic!("{backwards:?}") };
    assert_eq!((place.time, place.modes), (Nanos::ZERO, [UpperSwitch, LowerSwitch, LowerSwitch]));
    assert!(f32::from_bits(place.current[0]) < -1.0, "{place:?}");
    assert!(error.to_string().contains("at 0 s, a upper switch -"), "{error}");
    let (1, error @ RunError::NotFinite(_)) = begun(Plane::new(f64::NAN, 0.0)) else { panic!("finite") };
    assert!(error.to_string().contains("a upper switch without a finite current"), "{error}");
    assert_eq!(error.name(), "the simulation left the finite numbers");
    assert_eq!(begun(Plane::new(0.50, 0.0)).0, 0);
    // A finite state from which no step is short enough has another error, `NoStep`.
    let (1, error @ RunError::NoStep(_)) = begun_with(Plane::new(0.50, 0.0), f64::NAN) else {
        panic!("a step")
    };
    assert_eq!(error.name(), "no step of the simulation was short enough: the state changes too fast");
}
