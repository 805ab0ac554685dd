//! States as bytes.

use std::ptr::null_mut;

use standstill_fmu::{Kind, Part};

use super::importer::{Slave, State, Unpacked, unpacked};
use super::{FIELD, PERIOD, set_legs};

/// What goes in at step `n`, and that step: of a drive whole and half periods.
fn step(slave: &Slave, part: Part, n: u32, time: &mut f64) {
    let half = PERIOD.seconds() / 2.0;
    let length = if part == Part::Motor || n % 5 < 3 { 2.0 * half } else { half };
    if part == Part::Drive {
        set_legs(slave, n);
    } else {
        let volts = 20.0 * f64::from(n % 7) - 60.0;
        for (name, volts) in [("u_a", volts), ("u_b", -0.25 * volts), ("u_c", -0.75 * volts)] {
            assert_eq!(slave.set(name, volts), 0);
        }
    }
    assert_eq!(slave.step(*time, length), 0, "{n}: {}", slave.said());
    *time += length;
}

/// All values, to the bit.
fn values(slave: &Slave, of: &Unpacked) -> Vec<u64> {
    let read = of.model.variables.iter().filter(|of| of.kind != Kind::Clock);
    read.map(|of| slave.get(&of.name).to_bits()).collect()
}

fn state_of(slave: &Slave) -> State {
    let mut state: State = null_mut();
    assert_eq!(slave.state("fmi2GetFMUstate", &mut state), 0);
    state
}

fn freed(slave: &Slave, mut state: State) {
    assert_eq!(slave.state("fmi2FreeFMUstate", &mut state), 0);
}

fn bytes_of(slave: &Slave) -> Vec<u8> {
    let state = state_of(slave);
    let bytes = slave.serialised(state).unwrap_or_else(|| panic!("{}", slave.said()));
    freed(slave, state);
    bytes
}

fn set(slave: &Slave, bytes: &[u8]) {
    let mut state: State = null_mut();
    assert_eq!(slave.deserialise(bytes, &mut state), 0, "{}", slave.said());
    assert_eq!(slave.set_state(state), 0, "{}", slave.said());
    freed(slave, state);
}

/// A run is forked by bytes: another instance that was told nothing else goes on with the same bits, in every variable and step, from
/// any step on.
#[test]
fn law_a_run_that_is_forked_from_bytes_goes_on_to_the_same_bits() {
    let iron = "motor = \"paper-5k5\"\nerrors = \"harsh\"\nrotor.state = \"free\"\ninverter.carrier = 12500.0\ninverter.terminal_capacitance = \"0.5 nF\"";
    for (text, part) in [(FIELD, Part::Drive), (iron, Part::Drive), (iron, Part::Motor)] {
        let unpacked = unpacked(text, part);
        let first = Slave::ready(&unpacked, &[("trial", 5.0)]);
        let mut time = 0.0;
        // in the middle of a period, too.
        for [begin, forked_at] in [[0, 0], [0, 4], [4, 23]] {
            (begin..forked_at).for_each(|n| step(&first, part, n, &mut time));
            let bytes = bytes_of(&first);
            assert_eq!(bytes_of(&first), bytes, "the same state has the same bytes");
            // Its trial is that of the bytes.
            let second = Slave::made(&unpacked);
            set(&second, &bytes);
            assert_eq!(bytes_of(&second), bytes);
            assert_eq!(values(&second, &unpacked), values(&first, &unpacked));
            let stayed = state_of(&first);
            let mut times = [time, time];
            for n in forked_at..forked_at + 20 {
                step(&first, part, n, &mut times[0]);
                step(&second, part, n, &mut times[1]);
                assert_eq!(
                    values(&second, &unpacked),
                    values(&first, &unpacked),
                    "{n}, forked at {forked_at}"
                );
            }
            // And the branch that was left goes on from where it was.
            assert_eq!(first.set_state(stayed), 0);
            freed(&first, stayed);
            assert_eq!(bytes_of(&first), bytes);
        }
    }
}

/// Before the first step: what was set and read is kept, and initialisation goes on.
#[test]
fn law_states_of_all_phases_are_kept_as_bytes() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let slave = Slave::made(&unpacked);
    assert_eq!(slave.set("sensors.noise", 0.03), 0);
    let early = bytes_of(&slave);
    assert_eq!(slave.call("fmi2EnterInitializationMode"), 0);
    let angle = slave.get("actual.angle");
    let initialising = bytes_of(&slave);
    for bytes in [early, initialising] {
        let again = Slave::made(&unpacked);
        set(&again, &bytes);
        assert_eq!(again.get("sensors.noise"), 0.03);
        let _ = again.call("fmi2EnterInitializationMode");
        assert_eq!(again.get("actual.angle").to_bits(), angle.to_bits());
        assert_eq!(again.call("fmi2ExitInitializationMode"), 0, "{}", again.said());
        step(&again, Part::Drive, 0, &mut 0.0);
    }
}

/// promise: fmu-bytes-refused
#[test]
fn law_bytes_that_are_no_state_of_this_fmu_are_refused_and_change_nothing() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let slave = Slave::ready(&unpacked, &[]);
    let mut time = 0.0;
    (0..6).for_each(|n| step(&slave, Part::Drive, n, &mut time));
    let (bytes, before) = (bytes_of(&slave), values(&slave, &unpacked));
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    let changed = super::importer::unpacked(&FIELD.replace("seed = 7", "seed = 8"), Part::Drive);
    let foreign = bytes_of(&Slave::ready(&changed, &[]));
    for (wrong, says) in [
        (&bytes[..bytes.len() - 1], "damaged"),
        (&bytes[..3], "damaged"),
        (&[], "damaged"),
        (&damaged, "damaged"),
        (&[b'x'; 200], "found something else"),
        (&foreign, "needed one of {"),
    ] {
        let mut state: State = null_mut();
        assert_eq!(slave.deserialise(wrong, &mut state), 3);
        assert!(state.is_null() && slave.said().contains(says), "{says}: {}", slave.said());
    }
    let state = state_of(&slave);
    let mut short = vec![0; bytes.len() - 1];
    assert_eq!(slave.serialise(state, &mut short), 3);
    assert!(slave.said().contains(&format!("needed {}", bytes.len())), "{}", slave.said());
    freed(&slave, state);
    assert!(slave.serialised(null_mut()).is_none());
    assert_eq!(values(&slave, &unpacked), before);
    step(&slave, Part::Drive, 6, &mut time);
    // A step that failed may have left the machine anywhere.
    assert_eq!(slave.step(time, 1.0), 3);
    let state = state_of(&slave);
    assert!(slave.serialised(state).is_none());
    assert!(slave.said().contains("a step of it failed"), "{}", slave.said());
    freed(&slave, state);
}
