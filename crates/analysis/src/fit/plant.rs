//! The plant with its parameters: from numbers to the currents of a piece.

use standstill_interface::{
    Abc, Command, Detector, Dq, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_inverter::{Bridge, DcLink, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Algebraic, Core, Falls, IronBridge, MagneticCircuit, Motor, Winding};
use standstill_sim::{
    Case, Ended, Event, Probe, RotorState, SensorSettings, Sensors, Snapshot, Streams, Tolerance, run,
};

use super::pieces::{Edge, Piece};
use super::record::Request;

/// How the core saturates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// ```text
    /// i_d/I = x + β x² + γ x³,  x = δ_d/(L_d I);   i_q/I = y + γ_q y³,  y = ψ_q/(L_q I)
    /// ```
    /// with δ_d the flux beside the magnet's: smooth where nothing saturates, and the same to either side of the
    /// magnet but for the sign of β.
    Series,
    /// [`Algebraic::falling`]: iron, as a data sheet's `[nameplate]` has it. The three numbers are the falls of L_d along
    /// +d and −d and of L_q.
    Iron,
}

/// What the plant is, but for its edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// R in Ω.
    pub resistance: f64,
    /// L_d and L_q in H, without current.
    pub inductance: [f64; 2],
    /// θ in rad.
    pub angle: f64,
    /// How it saturates, and the law's three numbers.
    pub law: Law,
    /// See `law`. Of iron, no fall along −d is not-a-number.
    pub saturation: [f64; 3],
    /// Switches and diodes.
    pub devices: Devices,
    /// In s.
    pub dead_time: f64,
}

/// What stays as it is in a fit.
#[derive(Clone, Debug)]
pub struct Frame {
    /// All else of the motor.
    pub motor: Motor,
    /// I in A, at which saturation is stated.
    pub current: f64,
    /// ψ_pm in Wb.
    pub magnet_flux: f64,
    /// Numerical tolerance of the flux in Wb.
    pub tolerance: f64,
    /// Time in s between two points of a waveform, at most.
    pub resolution: f64,
}

/// Currents of a piece between its instants.
#[derive(Clone, Debug, Default)]
pub struct Waveform {
    /// Time in s from the piece's start, and phase currents in A.
    points: Vec<(f64, [f64; 3])>,
    resolution: f64,
}

impl Probe for Waveform {
    fn resolution(&self) -> Option<f64> {
        Some(self.resolution)
    }

    fn snapshot(&mut self, at: &Snapshot) {
        if self.points.last().is_none_or(|(time, _)| *time < at.time) {
            self.points.push((at.time, at.current));
        }
    }

    fn event(&mut self, _: f64, _: Event) {}
}

impl Waveform {
    /// Currents in A and their slopes in A/s at times in order; straight lines between its points.
    pub fn at(&self, times: impl Iterator<Item = f64>) -> Vec<([f64; 3], [f64; 3])> {
        let mut k = 1;
        let last = self.points.len() - 1;
        times
            .map(|time| {
                while k < last && self.points[k].0 < time {
                    k += 1;
                }
                let ((from, a), (to, b)) = (self.points[k - 1], self.points[k]);
                let slope: [f64; 3] = std::array::from_fn(|n| (b[n] - a[n]) / (to - from));
                let within = (time.clamp(self.points[0].0, self.points[last].0) - from).min(to - from);
                (std::array::from_fn(|n| a[n] + slope[n] * within), slope)
            })
            .collect()
    }
}

impl Waveform {
    /// As [`Self::at`], behind probes of this time constant in s, which are at rest when the waveform begins: exact for straight lines
    /// between its points.
    pub fn behind(&self, lag: f64, times: impl Iterator<Item = f64>) -> Vec<([f64; 3], [f64; 3])> {
        if lag <= 0.0 {
            return self.at(times);
        }
        // y′ = (x − y)/τ with x a straight line: y = x − mτ + (y₀ − x₀ + mτ) exp(−t/τ).
        let after = |y: [f64; 3], k: usize, time: f64| -> ([f64; 3], [f64; 3]) {
            let ((from, a), (to, b)) = (self.points[k - 1], self.points[k]);
            let decay = standstill_numeric::exp(-(time - from) / lag);
            let x_and_y = |n: usize| {
                let slope = (b[n] - a[n]) / (to - from);
                let x = a[n] + slope * (time - from);
                (x, x - slope * lag + (y[n] - a[n] + slope * lag) * decay)
            };
            let both = [x_and_y(0), x_and_y(1), x_and_y(2)];
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

/// Plays requests, one after the other.
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

/// Time in s that a piece's simulation begins before its first row, and goes on after its last: channels are late or
/// early by less.
pub const MARGIN: f64 = 20e-6;

fn legs(requests: [Request; 3]) -> Abc<Leg<f64>> {
    Abc(requests.map(|request| match request {
        Request::Off => Leg::Off,
        Request::Low => Leg::Low,
        Request::High => Leg::High,
    }))
}

/// By how much time is stretched in a simulation, with all fluxes and inductances, which leaves currents and voltages as they are: the
/// simulator counts in nanoseconds, and a search over places of edges needs finer ones. A power of two, which rounds nothing.
const STRETCH: f64 = 1024.0;

/// The commands of a piece whose edges are shifted by so much, in s, in stretched time.
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
    /// The core. None: there is no such iron.
    pub fn core(&self, frame: &Frame) -> Option<Algebraic> {
        let [l_d, l_q] = self.inductance;
        if !(l_d > 0.0 && l_q > 0.0) {
            return None;
        }
        let units = [l_d * frame.current, l_q * frame.current];
        match self.law {
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

    /// The motor. None: there is no such motor.
    pub fn motor(&self, frame: &Frame) -> Option<Motor> {
        let magnetics = MagneticCircuit::new(Core::Algebraic(self.core(frame)?)).ok()?;
        let [l_d, l_q] = self.inductance;
        let winding =
            Winding { mean_inductance: (l_d + l_q) / 3.0, saliency: (l_d - l_q) / 3.0, leakage: 0.0 };
        Some(Motor { resistance: self.resistance, magnetics, winding, ..frame.motor.clone() })
    }

    /// The currents of a piece, its edges shifted by so much in s. None: there is no such plant.
    pub fn waveform(&self, frame: &Frame, piece: &Piece, shifts: &[f64]) -> Option<Waveform> {
        let Devices { kind: _, switch_drop, switch_resistance, diode_drop, diode_resistance } = self.devices;
        let least =
            [switch_drop, switch_resistance, diode_drop, diode_resistance, self.dead_time, self.resistance];
        if !least.iter().all(|value| *value >= 0.0) {
            return None;
        }
        let stretched = Self { inductance: self.inductance.map(|l| l * STRETCH), ..self.clone() };
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
            start_angle: self.angle,
            rotor: RotorState::Locked,
            memory: None,
            load_torque: 0.0,
            streams: Streams::new(0, 0),
            tolerance: Tolerance { flux: frame.tolerance * STRETCH },
            time_limit,
        };
        let mut waveform = Waveform { points: Vec::new(), resolution: frame.resolution * STRETCH };
        let mut player = Player { commands: commands.into_iter() };
        let run = run(&case, &mut player, false, &mut waveform);
        waveform.points.iter_mut().for_each(|(time, _)| *time /= STRETCH);
        let sane = |(_, current): &(f64, [f64; 3])| current.iter().all(|i| i.abs() < 1e3 * frame.current);
        match run.ended {
            Ended::Outcome(_) if waveform.points.len() > 1 && waveform.points.iter().all(sane) => {
                Some(waveform)
            }
            _ => None,
        }
    }

    /// Falls of L_d along +d and −d and of L_q at the frame's current.
    pub fn falls(&self, frame: &Frame) -> Option<[f64; 3]> {
        self.falls_at(frame, [frame.current; 3])
    }

    /// Falls of L_d along +d and −d and of L_q, each at a current of its own in A.
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
