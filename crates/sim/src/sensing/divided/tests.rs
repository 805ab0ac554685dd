use super::*;
use crate::physics::legs::Leg;

/// Length of the step in s.
const H: f64 = 2e-6;
/// Capacitance of a terminal in F.
const CAPACITANCE: f64 = 0.3e-9;

/// A step with oscillating currents and three floating terminals, or two floating terminals and one with a conducting device.
struct Bench {
    /// Rate of the discharge per step.
    leak: f64,
    /// Rate of the filter per step.
    filter: f64,
    /// Initial common potential in V of three floating terminals, which falls by the dividers alone.
    common: f64,
    /// Whether a device of the first leg conducts.
    conducts: bool,
}

/// Complex rates of both modes per step.
const TURNS: [[f64; 2]; 2] = [[-0.3, 5.0], [-0.1, 0.7]];
/// Complex amplitudes of both modes in A.
const PHASOR: [[f64; 2]; 2] = [[2e-3, -1e-3], [0.5e-3, 0.8e-3]];
/// Voltage of the link in V and its slope in V/s, at both ends.
const LINK: [[f64; 2]; 2] = [[500.0, 2e6], [503.0, 1e6]];
/// Resistance of the device in Ω.
const RESISTANCE: f64 = 3.0;

fn axes() -> [Plane<f64>; 3] {
    let root = 3.0_f64.sqrt() / 2.0;
    [Plane::new(1.0, 0.0), Plane::new(-0.5, root), Plane::new(-0.5, -root)]
}

fn times([a, b]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [a * x - b * y, a * y + b * x]
}

fn grown([decay, turn]: [f64; 2], s: f64) -> [f64; 2] {
    let size = standstill_numeric::exp(decay * s);
    let (sin, cos) = standstill_numeric::sin_cos(turn * s);
    [size * cos, size * sin]
}

impl Bench {
    fn ringing() -> Oscillating<f64> {
        let of = [0, 1].map(|m: usize| Oscillation {
            phasor: PHASOR[m],
            turns: TURNS[m],
            over: grown(TURNS[m], 1.0),
        });
        let to = [Plane::new(0.8, 0.6), Plane::new(-0.6, 0.8)];
        Oscillating { of, to, per_charge: 0.0 }
    }

    /// Current of a leg in A, and its slope per step, after a share of the step.
    fn current(k: usize, s: f64) -> [f64; 2] {
        let ringing = Self::ringing();
        let mut sum = [0.0; 2];
        for m in 0..2 {
            let share = axes()[k].dot(ringing.to[m]);
            let now = times(PHASOR[m], grown(TURNS[m], s));
            sum[0] += share * now[0];
            sum[1] += share * times(now, TURNS[m])[0];
        }
        sum
    }

    /// Potential of a terminal in V after a share of the step: the solution of the equations at the head of `divided.rs`.
    fn potential(&self, k: usize, s: f64) -> f64 {
        if k == 0 && self.conducts {
            let [from, to] = LINK;
            let link = cubic([from[0], to[0]], [from[1] * H, to[1] * H]);
            let link = link[0] + s * (link[1] + s * (link[2] + s * link[3]));
            return link - 1.0 - RESISTANCE * Self::current(0, s)[0];
        }
        let ringing = Self::ringing();
        let mut sum = self.common * standstill_numeric::exp(-self.leak * s);
        for m in 0..2 {
            let [x, y] = [TURNS[m][0] + self.leak, TURNS[m][1]];
            let [re, im] = times(PHASOR[m], grown(TURNS[m], s));
            let share = axes()[k].dot(ringing.to[m]);
            sum -= share * H / CAPACITANCE * (re * x + im * y) / (x * x + y * y);
        }
        sum
    }

    /// Outputs of the filters in V after the whole step, and after a share of it.
    fn filtered(&self, before: [f64; 3], share: f64) -> [[f64; 3]; 2] {
        let mut divided = Divided::<f64>::default();
        divided.put(0, self.filter / (std::f64::consts::TAU * H), before);
        let mut legs = Conducting::<f64>::default();
        if self.conducts {
            legs.flows[0] = true;
            legs.leg[0] = Leg { rail: 1.0, offset: -1.0, resistance: RESISTANCE, direction: 1.0 };
        }
        let potential = [0.0, 1.0].map(|s| [0, 1, 2].map(|k| self.potential(k, s)));
        let rise = [0.0, 1.0].map(|s| {
            [0, 1, 2].map(|k| -H / CAPACITANCE * Self::current(k, s)[0] - self.leak * self.potential(k, s))
        });
        divided.ends =
            Ends { potential, rise, link: LINK, elastance: 1.0 / CAPACITANCE, leak: self.leak / H };
        let plane = |s: f64| {
            let [a, b, c] = [0, 1, 2].map(|k| Self::current(k, s)[1] / H);
            Plane::new((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt())
        };
        let ringing = Self::ringing();
        divided.advance(true, H, &legs, &[plane(0.0), plane(1.0)], &axes(), Some(&ringing));
        [divided.at(0), divided.within(0, share, H, Some(&ringing))]
    }

    /// Solution of `y′ = a (v − y)` after a share of the step, by Simpson's rule for the convolution.
    fn expected(&self, k: usize, before: f64, share: f64) -> f64 {
        let parts = 4000;
        let mut sum = 0.0;
        for n in 0..=parts {
            let s = share * f64::from(n) / f64::from(parts);
            let weight = if n == 0 || n == parts { 1.0 } else { f64::from(2 + 2 * (n % 2)) };
            sum += weight * standstill_numeric::exp(self.filter * (s - share)) * self.potential(k, s);
        }
        before * standstill_numeric::exp(-self.filter * share)
            + self.filter * share * sum / f64::from(3 * parts)
    }
}

#[test]
fn analytic_filters_follow_terminals_that_ring_leak_and_conduct() {
    let before = [300.0, 120.0, -5.0];
    for (leak, filter, common, conducts) in [
        (0.0, 1.3, 0.0, false),
        (0.0, 1.3, 0.0, true),
        (0.4, 1.3, 200.0, false),
        // A discharge as fast as the filter, and one much faster than step and filter.
        (1.3, 1.3, 200.0, false),
        (30.0, 1.3, 200.0, false),
        (0.4, 0.01, 0.0, true),
        (0.2, 40.0, 200.0, false),
    ] {
        let bench = Bench { leak, filter, common, conducts };
        let share = 0.37;
        let [all, part] = bench.filtered(before, share);
        for k in 0..3 {
            for (found, share) in [(all[k], 1.0), (part[k], share)] {
                let expected = bench.expected(k, before[k], share);
                assert!(
                    (found - expected).abs() < 1e-8 * 500.0,
                    "leak {leak}, filter {filter}, {conducts}, terminal {k} after {share}: {found}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn law_an_open_wires_end_is_where_the_drive_holds_it() {
    let mut divided = Divided::<f64>::default();
    divided.put(0, 1e12, [0.0; 3]);
    divided.hold(0, [Some(1.0), None, Some(0.5)]);
    let (legs, axes) = (Conducting::default(), axes());
    divided.ends = Ends {
        potential: [[7.0; 3]; 2],
        rise: [[0.0; 3]; 2],
        link: [[500.0, 0.0]; 2],
        elastance: 1.0,
        leak: 0.0,
    };
    divided.advance(true, H, &legs, &[Plane::default(); 2], &axes, None);
    for (found, expected) in divided.at(0).into_iter().zip([500.0, 7.0, 250.0]) {
        assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
    }
    // A step that was not taken changes nothing.
    divided.hold(0, [None; 3]);
    divided.advance(false, H, &legs, &[Plane::default(); 2], &axes, None);
    assert!((divided.at(0)[0] - 500.0).abs() < 1e-9);
}
