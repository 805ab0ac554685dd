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

mod bank;

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

use standstill_interface::{Detector, Real};
use standstill_inverter::DcLink;
use standstill_plant::Motor;

pub use self::bank::{Bank, LANES, Lanes};

use crate::case::{Case, Run};
use crate::limits::Limits;
use crate::machine::{CORE, Machine};
use crate::rig::{Rig, run, tolerances};
use crate::stride::{Ask, Stride};
use crate::trace::NoProbe;

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
/// their order. Each run is the one that [`crate::run`] gives, to the last bit.
///
/// # Panics
/// On a case with another motor, another tolerance or a link that differs in more than the phase of its ripple.
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
