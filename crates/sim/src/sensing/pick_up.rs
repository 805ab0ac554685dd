//! What switching edges induce in the wires between current sensors and converter.

use std::f64::consts::TAU;

use standstill_inverter::{Conduction, Gate};
use standstill_numeric::{exp, sin_cos};

/// What an edge of a leg's potential from one rail to the other adds to all current readings, t seconds later:
/// `± amplitude · e^(−t/decay) · cos(2π frequency t)`, positive for an edge upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickUp {
    /// In A.
    pub amplitude: f64,
    /// Time constant in s.
    pub decay: f64,
    /// In Hz.
    pub frequency: f64,
}

/// The pick-up of all edges so far. As all of them ring at one frequency, their sum is one complex number.
#[derive(Clone, Copy, Debug)]
pub struct Ringing {
    of: PickUp,
    /// Where the potential of each leg was last, as a share of the link: 0 and 1 at the rails, a half where it floats.
    levels: [f64; 3],
    /// Real and imaginary part in A at a time in ns.
    phasor: [f64; 2],
    since: f64,
}

impl Ringing {
    pub fn new(of: PickUp) -> Self {
        Self { of, levels: [0.5; 3], phasor: [0.0; 2], since: 0.0 }
    }

    /// What it adds at a time in ns, in A.
    pub fn at(&self, time: f64) -> f64 {
        self.turned(time)[0]
    }

    fn turned(&self, time: f64) -> [f64; 2] {
        let t = (time - self.since) * 1e-9;
        // Below 1e-17 of what it was.
        if t > 40.0 * self.of.decay {
            return [0.0; 2];
        }
        let size = exp(-t / self.of.decay);
        let (sin, cos) = sin_cos(TAU * self.of.frequency * t);
        let [re, im] = self.phasor;
        [size * (re * cos - im * sin), size * (re * sin + im * cos)]
    }

    /// A leg's potential moves at a time in ns by a share of the link at once.
    pub fn jump(&mut self, time: f64, share: f64) {
        self.phasor = self.turned(time);
        self.phasor[0] += self.of.amplitude * share;
        self.since = time;
    }

    /// Potentials move over `h` seconds from a time in ns on: by these shares of the link a step at its beginning and at its end, and
    /// in between by what is linear.
    pub fn glide(&mut self, time: f64, h: f64, share: [f64; 2]) {
        let end = time + h * 1e9;
        let turn = [-h / self.of.decay, TAU * self.of.frequency * h];
        let size = turn[0] * turn[0] + turn[1] * turn[1];
        if size == 0.0 || share == [0.0; 2] {
            return;
        }
        let over =
            |[re, im]: [f64; 2]| [(re * turn[0] + im * turn[1]) / size, (im * turn[0] - re * turn[1]) / size];
        // ∫ e^(z (1 − s)) (a + (b − a) s) ds = a φ₁(z) + (b − a) φ₂(z), φ₁ = (e^z − 1)/z, φ₂ = (φ₁ − 1)/z.
        let (mut first, mut second) = ([1.0, 0.0], [0.5, 0.0]);
        if size > 1e-6 {
            let grown = if turn[0] < -40.0 { 0.0 } else { exp(turn[0]) };
            let (sin, cos) = sin_cos(turn[1]);
            first = over([grown * cos - 1.0, grown * sin]);
            second = over([first[0] - 1.0, first[1]]);
        }
        self.phasor = self.turned(end);
        self.since = end;
        for n in 0..2 {
            self.phasor[n] += self.of.amplitude * (share[0] * first[n] + (share[1] - share[0]) * second[n]);
        }
    }

    /// Gates and modes are these from a time in ns on.
    pub fn follow(&mut self, time: f64, gates: [Gate; 3], modes: [Conduction; 3]) {
        for k in 0..3 {
            let level = match (gates[k], modes[k]) {
                (Gate::High, _) => 1.0,
                (Gate::Low, _) => 0.0,
                (Gate::Off, mode) if mode.is_upper() => 1.0,
                (Gate::Off, mode) if mode.is_lower() => 0.0,
                _ => 0.5,
            };
            // A potential that floats drifts to a rail, and away from it, much more slowly than a switch moves it.
            let drifts = level == 0.5 || (self.levels[k] == 0.5 && gates[k] == Gate::Off);
            if level != self.levels[k] && !drifts {
                self.phasor = self.turned(time);
                self.phasor[0] += self.of.amplitude * (level - self.levels[k]);
                self.since = time;
            }
            self.levels[k] = level;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};

    const OF: PickUp = PickUp { amplitude: 0.2, decay: 0.5e-6, frequency: 5e6 };

    #[test]
    fn analytic_edges_ring_and_add_up() {
        let mut ringing = Ringing::new(OF);
        let wave = |t: f64| (-t / 0.5e-6).exp() * (TAU * 5e6 * t).cos();
        // From rest, leg a to the upper rail: half an edge. Leg b to the lower one cancels it.
        ringing.follow(0.0, [Gate::High, Gate::Off, Gate::Off], [UpperSwitch, Blocked, LowerDiode]);
        assert!((ringing.at(130.0) - 0.1 * wave(130e-9)).abs() < 1e-15);
        // The gates go off: a's current goes on through the lower diode, a whole edge down; c's stays where it was.
        ringing.follow(700.0, [Gate::Off; 3], [LowerDiode, Blocked, LowerDiode]);
        for t in [700.0, 731.0, 1500.0] {
            let expected = 0.1 * wave(t * 1e-9) - 0.2 * wave((t - 700.0) * 1e-9);
            assert!((ringing.at(t) - expected).abs() < 1e-14, "{t} ns: {} A", ringing.at(t));
        }
        assert_eq!(ringing.at(700.0 + 20_001.0), 0.0);
    }

    #[test]
    fn law_what_moves_no_potential_at_once_rings_not() {
        let mut ringing = Ringing::new(OF);
        ringing.follow(0.0, [Gate::Off; 3], [LowerDiode, UpperDiode, Blocked]);
        // The switch beside a diode that conducts.
        ringing.follow(1000.0, [Gate::Low, Gate::High, Gate::Off], [LowerDiode, UpperDiode, Blocked]);
        ringing.follow(2000.0, [Gate::Low, Gate::High, Gate::Off], [LowerSwitch, UpperSwitch, Blocked]);
        // Currents that end.
        ringing.follow(3000.0, [Gate::Off; 3], [LowerDiode, Blocked, Blocked]);
        assert!([0.0, 100.0, 1100.0, 2100.0, 3100.0].iter().all(|t| ringing.at(*t) == 0.0));
    }
}
