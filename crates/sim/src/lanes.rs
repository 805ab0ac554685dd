//! Runs side by side, or one alone: the same code for both.
//!
//! ```text
//!   run 0  ─┐ wants a step                       ┌─ resume
//!   run 1  ─┤ ─────► one step in wide registers ─┤
//!   …       │                                    │
//!   run 7  ─┘                                    └─ …        a run that is over makes room for the next
//! ```
//! Each run steps to its own next instant. What it computes does not depend on its neighbours: multiplication and addition
//! are not fused, and nothing is branched upon that is not the same for all machines of a kind.

pub mod bank;

use std::marker::PhantomData;

use standstill_interface::{Abc, Command, Detector, Leg, Reading, Real, Stage, Step};

use standstill_numeric::{OnWidest, Wide, Width, on_widest};
use standstill_plant::Magnetics;

use self::bank::{Bank, Served};
use crate::case::{Case, Ended, Run, RunError};
use crate::control::{Control, Want, can_move};
use crate::trace::{NoProbe, Probe};

/// A run in its lane, with its detector.
struct Detection<'a, T: Real, D> {
    number: usize,
    control: Control<'a>,
    detector: D,
    readings: Vec<Reading<T>>,
}

impl<'a, T: Real, D: Detector<T>> Detection<'a, T, D> {
    /// Goes on until a step is wanted, or to the end of the run.
    fn advance<V: Wide>(&mut self, bank: &mut Bank<'a, V>, mut want: Want) -> Option<Run<T>> {
        loop {
            let ended = match want {
                Want::Step => return None,
                Want::Over(error) => Ended::Error(error),
                Want::Command => {
                    self.readings.clear();
                    self.readings.extend(self.control.readings.iter().map(reading_as));
                    match self.detector.step(&self.readings) {
                        Step::Done(outcome) => Ended::Outcome(outcome),
                        Step::Drive(command) => {
                            want = self.control.command(bank, &command_of(&command));
                            continue;
                        }
                    }
                }
            };
            return Some(self.control.finish(bank, ended));
        }
    }
}

/// A reading in the detector's numbers.
fn reading_as<T: Real>(reading: &Reading<f64>) -> Reading<T> {
    Reading {
        at: reading.at,
        current: reading.current.map(T::of),
        sensed: reading.sensed,
        dc_link: T::of(reading.dc_link),
        dc_link_clipped: reading.dc_link_clipped,
    }
}

/// A detector's command in double precision.
fn command_of<T: Real>(command: &Command<T>) -> Command<f64> {
    let stage = |stage: Stage<T>| {
        let Abc(legs) = stage.legs;
        let legs = legs.map(|leg| match leg {
            Leg::Off => Leg::Off,
            Leg::Low => Leg::Low,
            Leg::High => Leg::High,
            Leg::Duty(duty) => Leg::Duty(duty.to_double()),
        });
        Stage { legs: Abc(legs), duration: stage.duration }
    };
    Command { stage: stage(command.stage), then: command.then.map(stage), sampling: command.sampling }
}

/// Whether the steps of a case are looked at from within by its sensors.
fn has_filters(case: &Case) -> bool {
    let settings = &case.sensors.settings;
    settings.bandwidth.is_some() || settings.dc_link.bandwidth.is_some()
}

/// Whether the core of a case has kinks where its fluxes are zero.
fn has_kinks(case: &Case) -> bool {
    case.motor.magnetics.core().kinks() != [false; 2]
}

/// Whether a case fits into a bank.
fn fits<V: Wide>(bank: &Bank<V>, case: &Case) -> bool {
    bank.machine.fits(case.motor, &case.inverter.link, can_move(case.rotor))
        && bank.bounds.sides.is_some() == has_kinks(case)
        && (bank.follow || !has_filters(case))
}

/// Runs in the lanes of a bank.
struct SideBySide<'a, V: Wide, T: Real, D> {
    bank: Bank<'a, V>,
    lanes: Vec<Option<Detection<'a, T, D>>>,
}

impl<'a, V: Wide, T: Real, D: Detector<T>> SideBySide<'a, V, T, D> {
    fn new(bank: Bank<'a, V>) -> Self {
        Self { bank, lanes: (0..V::LANES).map(|_| None).collect() }
    }

    /// Seats a run in a lane; its end, if it needs no step.
    fn seat(&mut self, lane: usize, detection: Detection<'a, T, D>) -> Option<Run<T>> {
        let run = self.lanes[lane].insert(detection).advance(&mut self.bank, Want::Command);
        if run.is_some() {
            self.bank.live &= !(1 << lane);
        }
        run
    }

    /// Takes cases into a lane until one of them needs a step.
    fn fill(
        &mut self,
        lane: usize,
        cases: &mut impl Iterator<Item = (usize, (Case<'a>, D))>,
        done: &mut impl FnMut(usize, Run<T>),
    ) {
        let spare = self.lanes[lane].take();
        let (mut raw, mut readings) =
            spare.map_or_else(Default::default, |spare| (spare.control.readings, spare.readings));
        for (number, (case, mut detector)) in cases {
            if !fits(&self.bank, &case) {
                done(number, run(&case, &mut detector, false, &mut NoProbe));
                continue;
            }
            let control = Control::new(case, &mut self.bank, lane, None, false, std::mem::take(&mut raw));
            let detection = Detection { number, control, detector, readings: std::mem::take(&mut readings) };
            match self.seat(lane, detection) {
                Some(run) => done(number, run),
                None => return,
            }
        }
    }

    /// A step of all, and what follows from it. `over` gets the runs that have come to their ends, with their lanes.
    fn turn(&mut self, mut over: impl FnMut(usize, Run<T>)) {
        let Served { accepted, arrived, unfit, broken, past } = self.bank.step();
        if self.bank.follow {
            let thirds = [self.bank.within(1.0 / 3.0), self.bank.within(2.0 / 3.0)];
            for lane in lanes_of(accepted) {
                if let Some(detection) = &mut self.lanes[lane] {
                    detection.control.follow(&self.bank, &thirds);
                }
            }
        }
        for lane in lanes_of(arrived | unfit | broken) {
            let Some(detection) = &mut self.lanes[lane] else { continue };
            let want = if broken >> lane & 1 == 1 {
                Want::Over(RunError::NotFinite)
            } else {
                detection.control.resume(&mut self.bank, unfit >> lane & 1 == 1)
            };
            if let Some(run) = detection.advance(&mut self.bank, want) {
                self.bank.live &= !(1 << lane);
                over(lane, run);
            }
        }
        // Those who arrived have seen to it.
        for (k, past) in past.into_iter().enumerate() {
            for lane in lanes_of(past & !(arrived | broken)) {
                if let Some(detection) = &mut self.lanes[lane] {
                    detection.control.carry_out(&mut self.bank, k);
                }
            }
        }
    }
}

/// The numbers of the bits that are set.
fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        (bits != 0).then(|| {
            bits &= bits - 1;
            lane
        })
    })
}

/// A detector that belongs to somebody else.
struct Borrowed<'d, D: ?Sized>(&'d mut D);

impl<T: Real, D: Detector<T> + ?Sized> Detector<T> for Borrowed<'_, D> {
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
        self.0.step(readings)
    }
}

/// Carries out one detection from rest.
///
/// `ledger` asks for the energies, which are integrated along and cost time. Neither they nor who watches change a bit of
/// the run.
pub fn run<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
) -> Run<T> {
    alone(case, detector, ledger, probe, false)
}

/// The same by another method for each step, of order five and with nothing in common with the engine's own but the
/// equations: for tests, and to know the numerical error of a run.
pub fn referee<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
) -> Run<T> {
    alone(case, detector, ledger, probe, true)
}

fn alone<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
    refereed: bool,
) -> Run<T> {
    let watched = probe.resolution().is_some() || ledger || has_filters(case);
    let mut bank: Bank<'_, f64> = Bank::like(case.motor, &case.inverter.link, can_move(case.rotor), watched);
    bank.refereed = refereed;
    let control = Control::new(case.clone(), &mut bank, 0, Some(probe), ledger, Vec::new());
    let mut one = SideBySide::new(bank);
    let detection = Detection { number: 0, control, detector: Borrowed(detector), readings: Vec::new() };
    let mut ended = one.seat(0, detection);
    loop {
        if let Some(run) = ended {
            return run;
        }
        one.turn(|_, run| ended = Some(run));
    }
}

/// Runs detections side by side in the lanes of one thread, until `cases` has no more. `done` gets each run with the number
/// of its case, as they come to their ends, not in their order. Each run is the one that [`run`] gives, to the last bit.
///
/// Each case may have a motor, a link and a drive of its own. Cases of another kind than the first one's (another form of
/// its equations, not other numbers) are carried out one by one.
pub fn run_side_by_side<'a, T: Real, D: Detector<T>>(
    cases: impl IntoIterator<Item = (Case<'a>, D)>,
    done: impl FnMut(usize, Run<T>),
) {
    run_side_by_side_in(Width::Avx512, cases, done);
}

/// The same in registers no wider than `most`: the bits of the runs do not depend on it.
pub fn run_side_by_side_in<'a, T: Real, D: Detector<T>>(
    most: Width,
    cases: impl IntoIterator<Item = (Case<'a>, D)>,
    done: impl FnMut(usize, Run<T>),
) {
    on_widest(most, Work { cases: cases.into_iter(), done, of: PhantomData });
}

/// Cases to be run, and what is done with the runs.
struct Work<'a, T, C, F> {
    cases: C,
    done: F,
    of: PhantomData<(&'a (), T)>,
}

impl<'a, T: Real, D: Detector<T>, C, F> OnWidest for Work<'a, T, C, F>
where
    C: Iterator<Item = (Case<'a>, D)>,
    F: FnMut(usize, Run<T>),
{
    type Output = ();

    fn with<V: Wide>(self) {
        let Self { cases, mut done, .. } = self;
        let mut cases = cases.enumerate().peekable();
        let Some((_, (first, _))) = cases.peek() else { return };
        let bank: Bank<'a, V> =
            Bank::like(first.motor, &first.inverter.link, can_move(first.rotor), has_filters(first));
        let mut all = SideBySide::new(bank);
        for lane in 0..V::LANES {
            all.fill(lane, &mut cases, &mut done);
        }
        let mut over = Vec::with_capacity(V::LANES);
        while all.bank.live != 0 {
            all.turn(|lane, run| over.push((lane, run)));
            for (lane, run) in over.drain(..) {
                if let Some(detection) = &all.lanes[lane] {
                    done(detection.number, run);
                }
                all.fill(lane, &mut cases, &mut done);
            }
        }
    }
}
