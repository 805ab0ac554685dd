//! The plant of a fit: computes the currents of a piece from parameters.

use standstill_interface::{
    Abc, Command, Detector, Dq, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{Bridge, DcLink, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Algebraic, Core, EddyBranch, Falls, IronBridge, MagneticCircuit, Motor, Winding};
use standstill_sim::{
    Case, Ended, Event, Faults, Probe, RotorState, SensorSettings, Sensors, Snapshot, Streams, Tolerance, run,
};

use super::pieces::{Edge, Piece};
use super::record::{CHANNELS, LINK, Request};
use super::steep;

/// Law of the core's saturation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// ```text
    /// i_d/I = x + β x² + γ x³,  x = δ_d/(L_d I);   i_q/I = y + γ_q y³,  y = ψ_q/(L_q I)
    /// ```
    /// with δ_d the flux linkage besides the magnet's: smooth where nothing saturates, and equal on both sides of the magnet's
    /// flux except for the sign of β.
    Series,
    /// [`Algebraic::falling`]: the law of iron, as in a data sheet's `[nameplate]`. The three numbers are the falls of L_d along
    /// +d and −d and of L_q.
    Iron,
    /// [`steep::core`]: iron that saturates later and more steeply than the others. The three numbers are its.
    Steep,
}

/// Parameters of the plant besides its edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Phase resistance R in Ω.
    pub resistance: f64,
    /// L_d and L_q in H at zero current.
    pub inductance: [f64; 2],
    /// Rotor angle θ in rad.
    pub angle: f64,
    /// Law of saturation.
    pub law: Law,
    /// The three numbers of `law`. For iron, NaN in place of the fall along −d means that none is given.
    pub saturation: [f64; 3],
    /// Eddy currents; with a time constant of zero there are none.
    pub eddy: EddyBranch,
    /// Characteristics of switches and diodes.
    pub devices: Devices,
    /// Dead time in s.
    pub dead_time: f64,
}

/// A plant without eddy currents.
pub const NO_EDDIES: EddyBranch = EddyBranch { time_constant: 0.0, d_depth: 0.0, q_depth: 0.0 };

/// Largest share of an inductance that eddy currents take, as a data sheet may state it.
const DEEPEST: f64 = 0.9;

/// Quantities that a fit leaves unchanged.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Motor from which all other properties are taken.
    pub motor: Motor,
    /// Current I in A at which saturation is stated.
    pub current: f64,
    /// Flux linkage ψ_pm of the magnet in Wb.
    pub magnet_flux: f64,
    /// Numerical tolerance of the flux linkage in Wb.
    pub tolerance: f64,
    /// Largest time in s between two points of a waveform.
    pub resolution: f64,
}

/// Simulated currents of a piece as a function of time.
#[derive(Clone, Debug, Default)]
pub struct Waveform {
    /// Times in s from the beginning of the piece's simulation, with the currents of the channels in A. Where the link's current jumps,
    /// two points have the same time.
    points: Vec<(f64, [f64; CHANNELS])>,
    resolution: f64,
}

impl Probe for Waveform {
    fn resolution(&self) -> Option<f64> {
        Some(self.resolution)
    }

    fn snapshot(&mut self, at: &Snapshot) {
        let ([a, b, c], link) = (at.current, at.link_current());
        match self.points[..] {
            [.., (last, _)] if last > at.time => {}
            [.., (before, _), (last, ref mut now)] if before == at.time && last == at.time => {
                now[LINK] = link;
            }
            // The phase currents are the same before and after.
            [.., (last, before)] if last == at.time => {
                if before[LINK] != link {
                    let [a, b, c, _] = before;
                    self.points.push((at.time, [a, b, c, link]));
                }
            }
            _ => self.points.push((at.time, [a, b, c, link])),
        }
    }

    fn event(&mut self, _: f64, _: Event) {}
}

impl Waveform {
    /// Returns currents in A and their slopes in A/s at ascending times, by linear interpolation.
    pub fn at(&self, times: impl Iterator<Item = f64>) -> Vec<Sampled> {
        let mut k = 1;
        let last = self.points.len() - 1;
        times
            .map(|time| {
                while k < last && self.points[k].0 < time {
                    k += 1;
                }
                let ((from, a), (to, b)) = (self.points[k - 1], self.points[k]);
                let slope = slope(a, b, to - from);
                let within = (time.clamp(self.points[0].0, self.points[last].0) - from).min(to - from);
                (std::array::from_fn(|n| a[n] + slope[n] * within), slope)
            })
            .collect()
    }
}

impl Waveform {
    /// Returns the same values as [`Self::at`], behind probes with this time constant in s that are at rest when the waveform
    /// begins: exact for straight lines between its points.
    pub fn behind(&self, lag: f64, times: impl Iterator<Item = f64>) -> Vec<Sampled> {
        if lag <= 0.0 {
            return self.at(times);
        }
        // y′ = (x − y)/τ with x a straight line: y = x − mτ + (y₀ − x₀ + mτ) exp(−t/τ).
        let after = |y: [f64; CHANNELS], k: usize, time: f64| -> Sampled {
            let ((from, a), (to, b)) = (self.points[k - 1], self.points[k]);
            let decay = standstill_numeric::exp(-(time - from) / lag);
            let slope = slope(a, b, to - from);
            let both: [(f64, f64); CHANNELS] = std::array::from_fn(|n| {
                let x = a[n] + slope[n] * (time - from);
                (x, x - slope[n] * lag + (y[n] - a[n] + slope[n] * lag) * decay)
            });
            (both.map(|(_, y)| y), both.map(|(x, y)| (x - y) / lag))
        };
        let (mut k, last) = (1, self.points.len() - 1);
        let mut shown = self.points[0].1;
        times
            .map(|time| {
                while k < last && self.points[k].0 < time {
                    shown = after(shown, k, self.points[k].0).0;
                    k += 1;
                }
                after(shown, k, time.clamp(self.points[k - 1].0, self.points[last].0))
            })
            .collect()
    }
}

/// Currents of the channels in A and their slopes in A/s at one instant.
pub type Sampled = ([f64; CHANNELS], [f64; CHANNELS]);

/// Returns the slopes of a straight line over a time in s; zero where the time is none, as where a current jumps.
fn slope(a: [f64; CHANNELS], b: [f64; CHANNELS], time: f64) -> [f64; CHANNELS] {
    std::array::from_fn(|n| if time > 0.0 { (b[n] - a[n]) / time } else { 0.0 })
}

/// Detector that gives commands one after the other.
struct Player {
    commands: std::vec::IntoIter<Command<f64>>,
}

impl Detector<f64> for Player {
    fn step(&mut self, _: &[Reading<f64>]) -> Step<f64> {
        match self.commands.next() {
            Some(command) => Step::Drive(command),
            None => Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            }),
        }
    }
}

/// Time in s by which a piece's simulation begins before its first row and continues after its last: the channels' delay is
/// smaller in magnitude.
pub const MARGIN: f64 = 20e-6;

fn legs(requests: [Request; 3]) -> Abc<Leg<f64>> {
    Abc(requests.map(|request| match request {
        Request::Off => Leg::Off,
        Request::Low => Leg::Low,
        Request::High => Leg::High,
    }))
}

/// Factor by which time, fluxes and inductances are scaled in a simulation, which leaves currents and voltages unchanged: the
/// simulator counts in nanoseconds, and a search over times of edges needs finer steps. A power of two, which rounds nothing.
const STRETCH: f64 = 1024.0;

/// Returns the commands of a piece in scaled time, its edges shifted by `shifts` in s.
fn commands(piece: &Piece, shifts: &[f64]) -> Vec<Command<f64>> {
    let (begin, end) = (piece.rows[0].time, piece.rows[piece.rows.len() - 1].time);
    let at = |time: f64| Nanos::from_seconds((time - begin + MARGIN) * STRETCH);
    let mut from = Nanos::ZERO;
    let mut requested = piece.first;
    let mut commands = Vec::with_capacity(piece.edges.len() + 1);
    let nowhere = Edge { at: end + MARGIN, deviation: 0.0, legs: piece.first };
    for (edge, shift) in piece.edges.iter().zip(shifts).chain([(&nowhere, &0.0)]) {
        // Two edges never change places.
        let to = at(edge.at + shift).max(from + Nanos(1));
        let stage = Stage { legs: legs(requested), duration: to - from };
        commands.push(Command::hold(stage, Sampling::NONE));
        (from, requested) = (to, edge.legs);
    }
    commands
}

impl Plant {
    /// Returns the core; none if no iron has these falls.
    pub fn core(&self, frame: &Frame) -> Option<Algebraic> {
        let [l_d, l_q] = self.inductance;
        if !(l_d > 0.0 && l_q > 0.0) {
            return None;
        }
        let units = [l_d * frame.current, l_q * frame.current];
        match self.law {
            Law::Steep => steep::core(self.inductance, frame.current, self.saturation),
            Law::Series => {
                let [beta, gamma, gamma_q] = self.saturation;
                // ψ² and (ψ − ψ₀)³ about a flux ψ₀ so large that ψ keeps its sign; what the magnet's is does not matter.
                let rest = 3.0 * units[0];
                let square = beta / (l_d * units[0]);
                let own = 1.0 / l_d - 2.0 * square * rest;
                let cube = gamma / (l_d * units[0] * units[0]);
                let bridge = IronBridge {
                    strength: cube,
                    saturation: 0.0,
                    q_share: 0.0,
                    magnet_flux: rest,
                    exponent: 2,
                };
                Some(Algebraic {
                    d: own,
                    dd: square,
                    d_exponent: 1,
                    q: 1.0 / l_q,
                    qq: gamma_q / (l_q * units[1] * units[1]),
                    q_exponent: 2,
                    magnet_current: (own + square * rest) * rest,
                    bridge: (cube != 0.0).then_some(bridge),
                    ..Algebraic::default()
                })
            }
            Law::Iron => {
                let [d, minus_d, q] = self.saturation;
                let minus_d = Some(minus_d).filter(|fall| !fall.is_nan());
                let falls = Falls { d, minus_d, q: 0.0 };
                let core = Algebraic::falling([l_d, l_q], frame.magnet_flux, frame.current, falls).ok()?;
                // As `falling` has it, on both sides of none.
                let along_q = q / (1.0 - q) / 3.0;
                let most_q = units[1] / (1.0 + along_q);
                Some(Algebraic { qq: along_q / (l_q * most_q * most_q), q_exponent: 2, ..core })
            }
        }
    }

    /// Returns the motor; none if its parameters are invalid.
    pub fn motor(&self, frame: &Frame) -> Option<Motor> {
        let EddyBranch { time_constant, d_depth, q_depth } = self.eddy;
        if ![d_depth, q_depth].iter().all(|depth| (0.0..=DEEPEST).contains(depth)) || time_constant < 0.0 {
            return None;
        }
        let magnetics = MagneticCircuit::new(Core::Algebraic(self.core(frame)?)).ok()?;
        let magnetics = magnetics.with_eddy_currents((time_constant > 0.0).then_some(self.eddy));
        let [l_d, l_q] = self.inductance;
        let winding =
            Winding { mean_inductance: (l_d + l_q) / 3.0, saliency: (l_d - l_q) / 3.0, leakage: 0.0 };
        Some(Motor { resistance: self.resistance, magnetics, winding, ..frame.motor.clone() })
    }

    /// Simulates the currents of a piece with its edges shifted by `shifts` in s; none if the plant's parameters are invalid.
    pub fn waveform(&self, frame: &Frame, piece: &Piece, shifts: &[f64]) -> Option<Waveform> {
        let Devices { kind: _, switch_drop, switch_resistance, diode_drop, diode_resistance } = self.devices;
        let least =
            [switch_drop, switch_resistance, diode_drop, diode_resistance, self.dead_time, self.resistance];
        if !least.iter().all(|value| *value >= 0.0) {
            return None;
        }
        let eddy = EddyBranch { time_constant: self.eddy.time_constant * STRETCH, ..self.eddy };
        let stretched = Self { inductance: self.inductance.map(|l| l * STRETCH), eddy, ..self.clone() };
        let magnet_flux = frame.magnet_flux * STRETCH;
        let motor = Motor { magnet_flux, ..frame.motor.clone() };
        let motor = stretched.motor(&Frame { motor, magnet_flux, ..frame.clone() })?;
        let dead_time = Nanos::from_seconds(self.dead_time * STRETCH);
        let gate = GateTiming { dead_time, ..GateTiming::default() };
        let commands = commands(piece, shifts);
        let time_limit = commands.iter().fold(Nanos(1), |sum, command| sum + command.duration());
        let case = Case {
            motor: &motor,
            inverter: Inverter {
                bridge: Bridge { devices: self.devices, open_leg: OpenLeg::Diodes, ..Bridge::default() },
                gates: [gate; 3],
                link: DcLink::stiff(piece.link),
                carrier_period: Nanos::from_micros(100),
            },
            sensors: Sensors::nominal(SensorSettings::IDEAL),
            start_angle: self.angle + piece.turn,
            rotor: RotorState::Locked,
            memory: None,
            load_torque: 0.0,
            start_speed: 0.0,
            acceleration: 0.0,
            faults: Faults::default(),
            streams: Streams::new(0, 0),
            tolerance: Tolerance { flux: frame.tolerance * STRETCH },
            time_limit,
        };
        let mut waveform = Waveform { points: Vec::new(), resolution: frame.resolution * STRETCH };
        let mut player = Player { commands: commands.into_iter() };
        let run = run(&case, &mut player, false, &mut waveform);
        waveform.points.iter_mut().for_each(|(time, _)| *time /= STRETCH);
        let sane =
            |(_, current): &(f64, [f64; CHANNELS])| current.iter().all(|i| i.abs() < 1e3 * frame.current);
        match run.ended {
            Ended::Outcome(_) if waveform.points.len() > 1 && waveform.points.iter().all(sane) => {
                Some(waveform)
            }
            _ => None,
        }
    }

    /// Returns the falls of L_d along +d and −d and of L_q at the frame's current.
    pub fn falls(&self, frame: &Frame) -> Option<[f64; 3]> {
        self.falls_at(frame, [frame.current; 3])
    }

    /// Returns the falls of L_d along +d and −d and of L_q, each at its own current in A.
    pub fn falls_at(&self, frame: &Frame, currents: [f64; 3]) -> Option<[f64; 3]> {
        let core = MagneticCircuit::new(Core::Algebraic(self.core(frame)?)).ok()?;
        let at = |d: f64, q: f64| {
            let heading = standstill_numeric::Heading::ZERO;
            let flux = core.flux_at(Dq::new(d, q), heading).ok()?;
            Some(core.state(flux, heading).inverse_inductance.inverse())
        };
        let [l_d, l_q] = self.inductance;
        let [d, minus_d, q] = currents;
        Some([1.0 - at(d, 0.0)?.xx / l_d, 1.0 - at(-minus_d, 0.0)?.xx / l_d, 1.0 - at(0.0, q)?.yy / l_q])
    }
}
