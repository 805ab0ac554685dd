//! Steps of several machines at once.
//!
//! ```text
//!   detection 0 ─┐  ask                        ┌─ go on
//!   detection 1 ─┤ ─────► one step in 8 lanes ─┤
//!   …            │                             │
//!   detection 7 ─┘                             └─ …          a detection that is done makes room for the next
//! ```
//! What they compute is what a single machine's step computes, written once ([`Machine`], [`Ask::stride`]) and here compiled
//! for arrays of numbers and the widest registers that the processor at hand has. Multiplication and addition are not
//! fused: each lane has the bits of the machine alone.
//!
//! A detection is a function that can wait: where it needs a step, it leaves what it asks for in its lane and lets the
//! others run. Alone, it never waits. So there is one control flow, and it does not know which of the two it is in.

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

use multiversion::multiversion;
use standstill_interface::{AlphaBeta, Detector, Real};
use standstill_inverter::{DcLink, LegMode, Legs, Port};
use standstill_plant::{Heading, Motor, Pack, Symmetric};

use crate::case::{Case, Run};
use crate::limits::Limits;
use crate::machine::{CORE, Machine, PLANE};
use crate::rig::{Rig, run, tolerances};
use crate::stride::{Ask, Crossing, Stride};
use crate::trace::NoProbe;

/// Machines side by side: one register of the widest kind, two or four of others.
pub const LANES: usize = 8;

/// A number of each.
pub type Lanes = Pack<LANES>;

/// Who carries out steps.
pub(crate) trait Steps {
    /// The legs conduct otherwise from now on.
    fn legs_changed(&self, _machine: &Machine, _limits: &Limits) {}

    /// So does the rotor move, or the core is on another side of a kink.
    fn motion_changed(&self, _machine: &Machine, _limits: &Limits) {}

    /// Asks for a step of the machine as it was last told to be: it is there at once, or at the next [`turn`].
    fn ask<const N: usize>(&self, ask: &Ask<'_, N>, tolerance: &[f64; N]) -> Option<Stride<N>>;

    /// The step that was asked for a turn ago.
    fn answer<const N: usize>(&self) -> Stride<N>;
}

/// Waits until the others have had their turns.
pub(crate) async fn turn() {
    let mut waited = false;
    poll_fn(|_| if std::mem::replace(&mut waited, true) { Poll::Ready(()) } else { Poll::Pending }).await;
}

/// One machine by itself.
pub(crate) struct Alone;

impl Steps for Alone {
    fn ask<const N: usize>(&self, ask: &Ask<'_, N>, tolerance: &[f64; N]) -> Option<Stride<N>> {
        Some(ask.stride(tolerance))
    }

    fn answer<const N: usize>(&self) -> Stride<N> {
        unreachable!("alone nothing is waited for")
    }
}

/// The outcome of a function that never waits.
pub(crate) fn at_once<F: Future>(future: F) -> F::Output {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => output,
        Poll::Pending => unreachable!("alone there is nothing to wait for"),
    }
}

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
    fn put_legs(&mut self, lane: usize, machine: &Machine, limits: &Limits) {
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
    fn put_motion(&mut self, lane: usize, machine: &Machine, limits: &Limits) {
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

/// A machine's place in a bank.
struct Seat<'b, 'a> {
    bank: &'b RefCell<Bank<'a>>,
    lane: usize,
}

impl Steps for Seat<'_, '_> {
    fn legs_changed(&self, machine: &Machine, limits: &Limits) {
        self.bank.borrow_mut().put_legs(self.lane, machine, limits);
    }

    fn motion_changed(&self, machine: &Machine, limits: &Limits) {
        self.bank.borrow_mut().put_motion(self.lane, machine, limits);
    }

    #[inline]
    fn ask<const N: usize>(&self, ask: &Ask<'_, N>, _tolerance: &[f64; N]) -> Option<Stride<N>> {
        self.bank.borrow_mut().put(self.lane, ask);
        None
    }

    #[inline]
    fn answer<const N: usize>(&self) -> Stride<N> {
        self.bank.borrow().take(self.lane)
    }
}

/// Runs detections side by side in the lanes of one thread, until `cases` has no more. All cases have the first one's
/// motor, tolerance and kind of link. `done` gets each run with the number of its case, as they come to their ends, not in
/// their order.
///
/// # Panics
/// On a case with another motor, another tolerance or a link that differs in more than the phase of its ripple.
///
/// Each run is the one that [`crate::run`] gives, to the last bit.
pub fn run_side_by_side<'a, T: Real, D: Detector<T>>(
    motor: &'a Motor,
    link: &'a DcLink,
    cases: impl IntoIterator<Item = (Case<'a>, D)>,
    mut done: impl FnMut(usize, Run<T>),
) {
    let mut cases = cases.into_iter().enumerate().peekable();
    let Some((_, (first, _))) = cases.peek() else { return };
    if motor.magnetics.eddy_currents().is_some() {
        // Longer states are not compiled for lanes.
        for (number, (case, mut detector)) in cases {
            done(number, run(&case, &mut detector, false, &mut NoProbe));
        }
        return;
    }
    let tolerance = first.tolerance;
    let bank = RefCell::new(Bank::new(motor, link, tolerances(first)));
    let begin = |lane| {
        let (number, (case, mut detector)) = cases.next()?;
        assert!(
            std::ptr::eq(case.motor, motor) && case.tolerance == tolerance,
            "cases of one motor and tolerance"
        );
        let phase = case.inverter.link.ripple_phase;
        assert!(case.inverter.link == DcLink { ripple_phase: phase, ..*link }, "cases of one kind of link");
        let seat = Seat { bank: &bank, lane };
        Some(async move {
            (number, Rig::<CORE, _, _>::new(&case, &mut NoProbe, seat).detect(&mut detector).await)
        })
    };
    take_turns(&bank, begin, done);
}

/// Lets detections run, each until it asks for a step or is done, in turn with the steps.
fn take_turns<T, F: Future<Output = (usize, Run<T>)>>(
    bank: &RefCell<Bank>,
    mut begin: impl FnMut(usize) -> Option<F>,
    mut done: impl FnMut(usize, Run<T>),
) {
    let mut seats: [Pin<Box<Option<F>>>; LANES] = std::array::from_fn(|_| Box::pin(None));
    let mut context = Context::from_waker(Waker::noop());
    let mut go_on = |lane: usize| {
        let seat = &mut seats[lane];
        loop {
            if let Some(detection) = seat.as_mut().as_pin_mut() {
                match detection.poll(&mut context) {
                    Poll::Pending => return,
                    Poll::Ready((number, run)) => done(number, run),
                }
            }
            let next = begin(lane);
            let over = next.is_none();
            seat.set(next);
            if over {
                return;
            }
        }
    };
    (0..LANES).for_each(&mut go_on);
    loop {
        let served = bank.borrow_mut().step();
        if served == [false; LANES] {
            return;
        }
        for lane in (0..LANES).filter(|lane| served[*lane]) {
            go_on(lane);
        }
    }
}
