use standstill_interface::Nanos;
use standstill_inverter::{Bridge, Conduction, DcLink, Gate, GateTiming, Inverter};
use standstill_plant::built_in;

use super::*;

/// Where terminals have no capacitance, the step that does without what rings has the bits of the one for all.
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
            let mut bank: Bank<'_, f64> = Bank::like(&motor, &inverter, free, false);
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
                    Tried::new::<true>(&bank.machine, &bank.bounds, &legs, &bank.here, 9e4, &bank.accuracy)
                },
                {
                    let legs = bank.machine.legs.at::<false>(0.0, motor.resistance);
                    Tried::new::<false>(&bank.machine, &bank.bounds, &legs, &bank.here, 9e4, &bank.accuracy)
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
