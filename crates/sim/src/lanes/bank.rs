//! Machines side by side: a lane of wide registers for each.

use multiversion::multiversion;
use standstill_interface::AlphaBeta;
use standstill_inverter::{DcLink, LegMode, Legs, Port};
use standstill_numeric::{Heading, Pack, Symmetric};
use standstill_plant::Motor;

use crate::limits::Limits;
use crate::machine::{CORE, Machine, PLANE};
use crate::stride::{Ask, Crossing, Stride};

/// Machines side by side: one register of the widest kind, two or four of others.
pub const LANES: usize = 8;

/// A number of each.
pub type Lanes = Pack<LANES>;

/// Machines of which a step in lanes can only be one: as long a state, moving or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    /// A rotor at rest on a stiff link.
    Still,
    /// A rotor at rest.
    Resting,
    /// A rotor that moves.
    Moving,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Still, Self::Resting, Self::Moving];

    fn of<const N: usize>(machine: &Machine) -> Self {
        match N {
            PLANE => Self::Still,
            CORE if machine.moves => Self::Moving,
            CORE => Self::Resting,
            _ => unreachable!("no detection runs in lanes with a longer state"),
        }
    }
}

/// Machines side by side, what they ask for and what they get. All have the same motor and the same link but for the phase
/// of its ripple.
#[derive(Debug)]
pub struct Bank<'a> {
    machine: Machine<'a, Lanes>,
    limits: Limits<Lanes>,
    time: Lanes,
    h: Lanes,
    state: [Lanes; CORE],
    asked: [Option<Kind>; LANES],
    slope: [Lanes; CORE],
    answer: Stride<CORE, Lanes>,
    tolerance: [f64; CORE],
}

impl<'a> Bank<'a> {
    /// Without machines in its lanes yet; with the tolerances of their states.
    pub fn new(motor: &'a Motor, link: &'a DcLink, tolerance: [f64; CORE]) -> Self {
        let zero = Pack([0.0; LANES]);
        let (three, plane) = ([zero; 3], AlphaBeta::new(zero, zero));
        let gamma = Symmetric::new(zero, zero, zero);
        let leg = LegMode { rail: zero, offset: zero, resistance: zero, direction: zero, blocked: zero };
        Self {
            machine: Machine {
                motor,
                link,
                ripple_phase: zero,
                legs: Legs { leg: [leg; 3], idle: zero },
                moves: false,
                dry_friction: zero,
                load_torque: zero,
                angle: zero,
                heading: Heading { sin: zero, cos: zero },
            },
            limits: Limits {
                low: [[zero; 2]; 3],
                high: [[zero; 2]; 3],
                motion: [zero; 4],
                stops: [zero; 2],
                sides: [[zero; 2]; 2],
            },
            time: zero,
            h: zero,
            state: [zero; CORE],
            asked: [None; LANES],
            slope: [zero; CORE],
            answer: Stride {
                error: zero,
                margin: zero,
                end: [zero; CORE],
                port: Port { current: three, inverse_inductance: gamma, holding: plane, dc_link: zero },
                crossing: Crossing { other_margin: zero, middle_current: three, rise: [three; 2] },
            },
            tolerance,
        }
    }

    /// The legs of a lane's machine in their modes.
    pub(super) fn put_legs(&mut self, lane: usize, machine: &Machine, limits: &Limits) {
        let put = |to: &mut Lanes, from: f64| to.0[lane] = from;
        put(&mut self.machine.legs.idle, machine.legs.idle);
        for (k, from) in machine.legs.leg.iter().enumerate() {
            let to = &mut self.machine.legs.leg[k];
            put(&mut to.rail, from.rail);
            put(&mut to.offset, from.offset);
            put(&mut to.resistance, from.resistance);
            put(&mut to.direction, from.direction);
            put(&mut to.blocked, from.blocked);
            // Those of conducting legs mean nothing.
            if from.direction == 0.0 {
                for part in 0..2 {
                    put(&mut self.limits.low[k][part], limits.low[k][part]);
                    put(&mut self.limits.high[k][part], limits.high[k][part]);
                }
            }
        }
    }

    /// All else of a lane's machine.
    pub(super) fn put_motion(&mut self, lane: usize, machine: &Machine, limits: &Limits) {
        let put = |to: &mut Lanes, from: f64| to.0[lane] = from;
        let (to, from) = (&mut self.machine, machine);
        put(&mut to.ripple_phase, from.ripple_phase);
        put(&mut to.dry_friction, from.dry_friction);
        put(&mut to.load_torque, from.load_torque);
        put(&mut to.angle, from.angle);
        put(&mut to.heading.sin, from.heading.sin);
        put(&mut to.heading.cos, from.heading.cos);
        for (to, from) in self.limits.motion.iter_mut().zip(limits.motion) {
            put(to, from);
        }
        for k in 0..2 {
            put(&mut self.limits.stops[k], limits.stops[k]);
            put(&mut self.limits.sides[k][0], limits.sides[k][0]);
            put(&mut self.limits.sides[k][1], limits.sides[k][1]);
        }
    }

    /// Seats a machine in a lane, or tells that it changed.
    pub fn seat(&mut self, lane: usize, machine: &Machine, limits: &Limits) {
        self.put_legs(lane, machine, limits);
        self.put_motion(lane, machine, limits);
    }

    /// Leaves in a lane what the machine there asks for.
    pub fn put<const N: usize>(&mut self, lane: usize, ask: &Ask<'_, N>) {
        self.time.0[lane] = ask.time;
        self.h.0[lane] = ask.h;
        for n in 0..N {
            self.state[n].0[lane] = ask.start[n];
        }
        self.asked[lane] = Some(Kind::of::<N>(ask.machine));
    }

    /// Carries out the steps of the kind that most machines ask for; returns for which lanes.
    pub fn step(&mut self) -> [bool; LANES] {
        let Some(kind) = self.most_wanted() else { return [false; LANES] };
        self.advance(kind);
        self.asked.each_mut().map(|asked| {
            let served = *asked == Some(kind);
            if served {
                *asked = None;
            }
            served
        })
    }

    /// The derivatives of all states, for machines that move or do not.
    pub fn slopes<const N: usize>(&mut self, moves: bool) -> [Lanes; N] {
        self.machine.moves = moves;
        slopes_of_lanes::<N>(self);
        std::array::from_fn(|n| self.slope[n])
    }

    /// What the machine in a lane got.
    pub fn take<const N: usize>(&self, lane: usize) -> Stride<N> {
        let Stride { error, margin, end, port, crossing } = &self.answer;
        let take = |from: &Lanes| from.0[lane];
        let gamma = &port.inverse_inductance;
        Stride {
            error: take(error),
            margin: take(margin),
            end: std::array::from_fn(|n| take(&end[n])),
            port: Port {
                current: port.current.each_ref().map(take),
                inverse_inductance: Symmetric::new(take(&gamma.xx), take(&gamma.xy), take(&gamma.yy)),
                holding: AlphaBeta::new(take(&port.holding.alpha), take(&port.holding.beta)),
                dc_link: take(&port.dc_link),
            },
            // Asked for seldom.
            crossing: if take(margin) < 0.0 {
                Crossing {
                    other_margin: take(&crossing.other_margin),
                    middle_current: crossing.middle_current.each_ref().map(take),
                    rise: crossing.rise.each_ref().map(|rise| rise.each_ref().map(take)),
                }
            } else {
                Crossing::default()
            },
        }
    }

    /// The kind that most machines ask for.
    fn most_wanted(&self) -> Option<Kind> {
        let count = |kind: Kind| self.asked.iter().filter(|asked| **asked == Some(kind)).count();
        let [still, resting, moving] = Kind::ALL.map(count);
        match still.max(resting).max(moving) {
            0 => None,
            most if still == most => Some(Kind::Still),
            most if moving == most => Some(Kind::Moving),
            _ => Some(Kind::Resting),
        }
    }

    /// Carries out what machines of this kind ask for; what the others' lanes compute means nothing.
    fn advance(&mut self, kind: Kind) {
        self.machine.moves = kind == Kind::Moving;
        match kind {
            Kind::Still => stride_of_lanes::<PLANE>(self),
            Kind::Resting | Kind::Moving => stride_of_lanes::<CORE>(self),
        }
    }
}

/// The right-hand side of each machine.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+bmi2", "x86_64+avx2+bmi2"))]
fn slopes_of_lanes<const N: usize>(bank: &mut Bank) {
    let mut state = [bank.time; N];
    state.copy_from_slice(&bank.state[..N]);
    let slope = bank.machine.evaluate(&bank.machine.terminals(), bank.time, &state).slope;
    bank.slope[..N].copy_from_slice(&slope);
}

/// A step of each machine.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+bmi2", "x86_64+avx2+bmi2"))]
fn stride_of_lanes<const N: usize>(bank: &mut Bank) {
    let (mut start, mut tolerance) = ([bank.time; N], [0.0; N]);
    start.copy_from_slice(&bank.state[..N]);
    tolerance.copy_from_slice(&bank.tolerance[..N]);
    let ask =
        Ask::<N, Lanes> { machine: &bank.machine, limits: &bank.limits, time: bank.time, start, h: bank.h };
    let stride = ask.stride(&tolerance);
    bank.answer.error = stride.error;
    bank.answer.margin = stride.margin;
    bank.answer.crossing = stride.crossing;
    bank.answer.end[..N].copy_from_slice(&stride.end);
    bank.answer.port = stride.port;
}
