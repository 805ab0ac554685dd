//! A bridge of MOSFETs on a low-voltage motor, by Heun's method in steps of 20 ns: shares no code with the simulator.
//!
//! A channel that is on is a resistance both ways, beside its body diode; a leg whose gates are both off conducts through a diode
//! until its current is zero, and is then open. A gate switches on a dead time after it was asked for.
#![allow(clippy::disallowed_methods, reason = "a witness uses the C library")]

use standstill_fit::{DeviceKind, Devices, Start};
use standstill_sim::{Purpose, Streams};

use super::{Pulses, Stage, word};

/// Step of the integration in s.
const DT: f64 = 2e-8;

/// How the iron saturates, with x = ψ_d/(L_d I) beside the magnet's flux and y = ψ_q/(L_q I) at a current I.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Iron {
    /// Not at all.
    Linear,
    /// i_d/I = x + β x² + γ x³ and i_q/I = y + γ_q y³: the law that the fit's first search uses.
    Series([f64; 3]),
    /// i/I the slopes along x and along y, the latter times L_d/L_q, of W = (x² + y² L_q/L_d)/2 + k (((x + m)² + y²)/m²)ⁿ, less what keeps zero current at x = 0: saturates late and steeply, and
    /// the axes influence each other. k, m, n.
    Steep([f64; 3]),
}

/// A motor and its drive.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// R in Ω.
    pub resistance: f64,
    /// L_d and L_q in H without current.
    pub inductance: [f64; 2],
    /// I in A.
    pub current: f64,
    pub iron: Iron,
    /// Of the d-axis, in degrees.
    pub angle: f64,
    /// In V.
    pub link: f64,
    /// A channel's resistance in Ω.
    pub channel: f64,
    /// A body diode's threshold in V and slope in Ω.
    pub diode: [f64; 2],
    /// In s.
    pub dead_time: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Gate {
    High,
    Low,
    Off,
}

/// What conducts in a leg: its channels, neither device, or the diode of one side with both gates off. It stays for a step: a step whose
/// second half had the other diode would end where it began, and the current would never reach zero.
#[derive(Clone, Copy, PartialEq)]
enum Path {
    Channel,
    Open,
    Lower,
    Upper,
}

impl Bench {
    /// Currents in A along d and q at fluxes in V s beside the magnet's.
    fn currents(&self, psi: [f64; 2]) -> [f64; 2] {
        let [x, y] =
            [psi[0] / (self.inductance[0] * self.current), psi[1] / (self.inductance[1] * self.current)];
        let [a, b] = match self.iron {
            Iron::Linear => [x, y],
            Iron::Series([beta, gamma, across]) => {
                [x * (1.0 + x * (beta + gamma * x)), y * (1.0 + across * y * y)]
            }
            Iron::Steep([k, m, n]) => {
                let slope = |x: f64, y: f64| {
                    2.0 * n * k * (((x + m).powi(2) + y * y) / (m * m)).powf(n - 1.0) / (m * m)
                };
                let rest = slope(0.0, 0.0);
                // An energy of the fluxes: its slope along ψ_q, in the same unit, has the ratio of the inductances.
                let ratio = self.inductance[0] / self.inductance[1];
                [x + slope(x, y) * (x + m) - rest * m, y + ratio * slope(x, y) * y]
            }
        };
        [a * self.current, b * self.current]
    }

    /// Γ in 1/H: the slopes of the currents.
    fn slopes(&self, psi: [f64; 2]) -> [[f64; 2]; 2] {
        let h = 1e-5 * self.inductance[0] * self.current;
        let along = |axis: usize| {
            let (mut high, mut low) = (psi, psi);
            high[axis] += h;
            low[axis] -= h;
            let [high, low] = [self.currents(high), self.currents(low)];
            [(high[0] - low[0]) / (2.0 * h), (high[1] - low[1]) / (2.0 * h)]
        };
        let [d, q] = [along(0), along(1)];
        [[d[0], q[0]], [d[1], q[1]]]
    }

    /// Inductances without current in H, and falls along +d and −d and along q at so many A.
    pub fn inductances(&self, current: f64) -> ([f64; 2], [f64; 3]) {
        let inductance = |target: [f64; 2]| {
            let mut psi = [0.0; 2];
            for _ in 0..60 {
                let (i, [[a, b], [c, d]]) = (self.currents(psi), self.slopes(psi));
                let off = [target[0] - i[0], target[1] - i[1]];
                let det = a * d - b * c;
                psi = [psi[0] + (d * off[0] - b * off[1]) / det, psi[1] + (a * off[1] - c * off[0]) / det];
            }
            let [[a, b], [c, d]] = self.slopes(psi);
            let det = a * d - b * c;
            [d / det, a / det]
        };
        let rest = inductance([0.0, 0.0]);
        let fall = |target: [f64; 2], axis: usize| 1.0 - inductance(target)[axis] / rest[axis];
        (rest, [fall([current, 0.0], 0), fall([-current, 0.0], 0), fall([0.0, current], 1)])
    }

    /// The phases' axes in d and q.
    fn axes(&self) -> [[f64; 2]; 3] {
        std::array::from_fn(|k| {
            let at = (120.0 * k as f64 - self.angle).to_radians();
            [at.cos(), at.sin()]
        })
    }

    /// Potential in V of a terminal with this current into the motor.
    fn potential(&self, gate: Gate, path: Path, current: f64) -> f64 {
        let [threshold, slope] = self.diode;
        // Against the switch: channel and diode side by side.
        let reverse = |i: f64| {
            let channel = self.channel * i;
            if channel < threshold {
                channel
            } else {
                (i + threshold / slope) / (1.0 / self.channel + 1.0 / slope)
            }
        };
        match gate {
            Gate::High if current >= 0.0 => self.link - self.channel * current,
            Gate::High => self.link + reverse(-current),
            Gate::Low if current <= 0.0 => -self.channel * current,
            Gate::Low => -reverse(current),
            Gate::Off if path == Path::Lower => -threshold - slope * current,
            Gate::Off => self.link + threshold - slope * current,
        }
    }

    /// The pulses of these stages.
    pub fn pulses(&self, stages: &[Stage]) -> Pulses {
        let axes = self.axes();
        let phases = |i: [f64; 2]| axes.map(|axis| axis[0] * i[0] + axis[1] * i[1]);
        let (mut legs, mut rows) = (Vec::new(), Vec::new());
        let (mut psi, mut path) = ([0.0; 2], [Path::Open; 3]);
        let mut on = [0.0; 3];
        let mut before = [""; 3];
        let mut number = 0_usize;
        for (duration, stage) in stages {
            let from = number as f64 * DT;
            legs.push((from, *stage));
            for k in 0..3 {
                if stage[k] != before[k] {
                    on[k] = from + self.dead_time;
                }
            }
            before = *stage;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
            for _ in 0..(duration / DT).round() as usize {
                let now = number as f64 * DT;
                let i = phases(self.currents(psi));
                let gate: [Gate; 3] = std::array::from_fn(|k| match stage[k] {
                    _ if now < on[k] - DT / 2.0 => Gate::Off,
                    "high" => Gate::High,
                    "low" => Gate::Low,
                    _ => Gate::Off,
                });
                for k in 0..3 {
                    path[k] = match (gate[k], path[k]) {
                        (Gate::Off, Path::Channel) if i[k] > 0.0 => Path::Lower,
                        (Gate::Off, Path::Channel) if i[k] < 0.0 => Path::Upper,
                        (Gate::Off, Path::Channel) => Path::Open,
                        (Gate::Off, path) => path,
                        _ => Path::Channel,
                    };
                }
                let from_link = |k: &usize| gate[*k] == Gate::High || path[*k] == Path::Upper;
                rows.push([now, i[0], i[1], i[2], (0..3).filter(from_link).map(|k| i[k]).sum()]);
                psi = self.step(&axes, psi, gate, &mut path);
                number += 1;
            }
        }
        let (rest, _) = self.inductances(self.current);
        let truth = vec![
            ("resistance", self.resistance),
            ("L_d", rest[0]),
            ("L_q", rest[1]),
            ("angle", self.angle),
            ("switch_resistance", self.channel),
            ("diode_drop", self.diode[0]),
            ("diode_resistance", self.diode[1]),
            ("dead_time", self.dead_time),
        ];
        let bench = *self;
        let falls = move |current| bench.inductances(current).1;
        Pulses { rows, legs, truth, falls: Some(std::sync::Arc::new(falls)), link: self.link }
    }

    /// One step; split where a current through a diode passes zero.
    fn step(&self, axes: &[[f64; 2]; 3], psi: [f64; 2], gate: [Gate; 3], path: &mut [Path; 3]) -> [f64; 2] {
        let phase = |psi: [f64; 2], k: usize| {
            let i = self.currents(psi);
            axes[k][0] * i[0] + axes[k][1] * i[1]
        };
        let (mut psi, mut left) = (psi, DT);
        loop {
            let next = self.heun(axes, psi, gate, path, left);
            let crossed = |k: &usize| match path[*k] {
                Path::Lower => phase(next, *k) < 0.0,
                Path::Upper => phase(next, *k) > 0.0,
                _ => false,
            };
            let share = |k: usize| (phase(psi, k) / (phase(psi, k) - phase(next, k))).clamp(0.0, 1.0);
            let Some(first) = (0..3).filter(crossed).min_by(|a, b| share(*a).total_cmp(&share(*b))) else {
                return next;
            };
            let part = left * share(first);
            psi = self.heun(axes, psi, gate, path, part);
            left -= part;
            path[first] = Path::Open;
            if path.iter().filter(|path| **path == Path::Open).count() > 1 {
                *path = gate.map(|gate| if gate == Gate::Off { Path::Open } else { Path::Channel });
                return [0.0; 2];
            }
        }
    }

    fn heun(
        &self,
        axes: &[[f64; 2]; 3],
        psi: [f64; 2],
        gate: [Gate; 3],
        path: &mut [Path; 3],
        time: f64,
    ) -> [f64; 2] {
        let first = self.voltage(axes, psi, gate, path);
        let second = self.voltage(axes, [psi[0] + time * first[0], psi[1] + time * first[1]], gate, path);
        std::array::from_fn(|n| psi[n] + time * (first[n] + second[n]) / 2.0)
    }

    /// dψ/dt in V. A leg that is open has the potential that keeps its current, within the diodes' thresholds.
    fn voltage(
        &self,
        axes: &[[f64; 2]; 3],
        psi: [f64; 2],
        gate: [Gate; 3],
        path: &mut [Path; 3],
    ) -> [f64; 2] {
        if path.iter().filter(|path| **path == Path::Open).count() > 1 {
            return [0.0; 2];
        }
        let i = self.currents(psi);
        let mut u: [f64; 3] =
            std::array::from_fn(|k| self.potential(gate[k], path[k], axes[k][0] * i[0] + axes[k][1] * i[1]));
        if let Some(k) = (0..3).find(|k| path[*k] == Path::Open) {
            // p·Γ (u − R i) = 0.
            let [[a, b], [c, d]] = self.slopes(psi);
            let [p, q] = axes[k];
            let row = [p * a + q * c, p * b + q * d];
            let along = |k: usize| row[0] * axes[k][0] + row[1] * axes[k][1];
            let others: f64 = (0..3).filter(|n| *n != k).map(|n| 2.0 / 3.0 * along(n) * u[n]).sum();
            let holding = self.resistance * (row[0] * i[0] + row[1] * i[1]);
            u[k] = (holding - others) / (2.0 / 3.0 * along(k));
            if u[k] < -self.diode[0] {
                (path[k], u[k]) = (Path::Lower, -self.diode[0]);
            } else if u[k] > self.link + self.diode[0] {
                (path[k], u[k]) = (Path::Upper, self.link + self.diode[0]);
            }
        }
        let v = |n: usize| 2.0 / 3.0 * (0..3).map(|k| axes[k][n] * u[k]).sum::<f64>();
        [v(0) - self.resistance * i[0], v(1) - self.resistance * i[1]]
    }
}

/// The six vectors one after the other, each from rest: for so long, then for so long off, in s.
pub fn six_vectors(pulse: f64, rest: f64) -> Vec<Stage> {
    let mut stages: Vec<Stage> = vec![(20e-6, ["off"; 3])];
    for vector in ["HLL", "LHH", "LHL", "HLH", "LLH", "HHL"] {
        stages.push((pulse, std::array::from_fn(|leg| word(&vector[leg..=leg]))));
        stages.push((rest, ["off"; 3]));
    }
    stages
}

impl Bench {
    /// A motor of some 20 A on 12 V with its drive, another one with each seed.
    pub fn drawn(seed: u64, iron: Iron) -> Self {
        let mut draws = Streams::new(seed, 7).open(Purpose::GateDelay);
        let mut spread = |value: f64, share: f64| value * standstill_numeric::exp(share * draws.normal());
        let resistance = spread(30e-3, 0.5);
        let l = spread(35e-6, 0.3);
        let channel = spread(4e-3, 0.5);
        let diode = [spread(0.8, 0.12), spread(5e-3, 0.5)];
        let dead_time = (spread(0.8e-6, 0.4) / DT).round() * DT;
        let angle = 360.0 * draws.uniform();
        let inductance = [l, 1.4 * l];
        Self { resistance, inductance, current: 20.0, iron, angle, link: 12.0, channel, diode, dead_time }
    }

    /// For how long a vector lasts that drives the current, in s: whole microseconds.
    pub fn pulse(&self) -> f64 {
        (1.2 * self.inductance[0] * self.current / (2.0 / 3.0 * self.link) * 1e6).round() * 1e-6
    }
}

/// What a fit is told of the drive: each number as well as a fit takes it to be known, another one with each seed.
pub fn drive(bench: &Bench, seed: u64) -> Start {
    let mut draws = Streams::new(seed, 8).open(Purpose::GateDelay);
    let mut about = |value: f64| value / (1.0 + 0.5 / 1.96 * draws.normal()).max(0.2);
    let devices = Devices {
        kind: DeviceKind::Mosfet,
        switch_drop: 0.0,
        switch_resistance: about(bench.channel),
        diode_drop: about(bench.diode[0]),
        diode_resistance: about(bench.diode[1]),
    };
    Start {
        motor: None,
        devices,
        dead_time: about(bench.dead_time),
        stated: super::all_stated(),
        settle: 3e-6,
        most_used: standstill_fit::MOST_USED,
    }
}
