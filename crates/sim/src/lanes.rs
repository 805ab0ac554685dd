//! Runs side by side, or one alone, by the same code.
//!
//! ```text
//!   run 0  ─┐ wants a step                       ┌─ resume
//!   run 1  ─┤ ─────► one step in wide registers ─┤
//!   …       │                                    │
//!   run 7  ─┘                                    └─ …        a run that is over makes room for the next
//! ```
//! Each run steps to its own next instant. Its results do not depend on its neighbours: multiplication and addition are
//! not fused, and machines of one kind (the same form of equations) pass the same branches of the code whatever their
//! values.

pub mod bank;
pub mod driven;
mod mode_ends;
mod slots;

use standstill_numeric::{OnWidest, Wide, Width, on_widest};
use standstill_plant::Magnetics;

use standstill_interface::{Command, Detector, Reading, Real};

use self::bank::{Bank, Served};
use self::driven::Driven;
use self::slots::{Adapter, Slots};
use crate::case::{Case, Finished, Run};
use crate::control::{Control, Room, Want, can_move};
use crate::sensing::Sensed;
use crate::trace::{NoProbe, Probe};

/// The source of cases and the receiver of finished runs. This trait hides the types of detectors, so that the engine
/// is compiled once for each register width instead of once for each detector.
trait Host<'a> {
    /// Returns the next case for this lane; none if no case is left.
    fn next(&mut self, lane: usize) -> Option<Case<'a>>;

    /// Returns the command of the detector in this lane after these readings; `None` if the detector is done.
    fn step(&mut self, lane: usize, readings: &[Reading<f64>]) -> Option<Command<f64>>;

    /// Receives the finished run of this lane, which ended because its detector was done or by an error.
    fn over(&mut self, lane: usize, finished: &Finished);
}

/// A detector as a closure. It takes the readings of the last command and returns the next command, or `None` if the detector is done.
type Orders<'d> = dyn FnMut(&[Reading<f64>]) -> Option<Command<f64>> + 'd;

/// Continues a run until it needs a step (`None`) or ends; in the latter case returns the finished run.
fn advance<'a, V: Wide>(
    control: &mut Control<'a>,
    bank: &mut Bank<'a, V>,
    detector: &mut Orders<'_>,
    mut want: Want,
) -> Option<Finished> {
    loop {
        match want {
            Want::Step => return None,
            Want::Over(error) => return Some(control.finish(bank, Some(error))),
            Want::Command => match detector(control.read::<V>()) {
                Some(command) => {
                    control.note(bank);
                    want = control.command(bank, &command);
                }
                None => return Some(control.finish(bank, None)),
            },
        }
    }
}

/// Returns whether a voltage sensor of a case has a filter that needs the values inside each step.
fn is_followed(case: &Case) -> bool {
    let (settings, capacitive) = (&case.sensors.settings, case.inverter.bridge.terminal_capacitance > 0.0);
    let jumps = settings.terminal.is_some_and(|of| of.bandwidth.is_some()) && !capacitive;
    settings.dc_link.bandwidth.is_some() || jumps
}

/// Returns whether the core of a case has kinks at zero flux.
fn has_kinks(case: &Case) -> bool {
    case.motor.magnetics.core().kinks() != [false; 2]
}

/// Returns whether a case can run in this bank: its machine's equations have the form of those of the bank.
fn fits<V: Wide>(bank: &Bank<V>, case: &Case) -> bool {
    bank.machine.fits(
        case.motor,
        &case.inverter,
        can_move(case.rotor),
        case.sensors.settings.load().is_some(),
    ) && bank.machine.shorted.is_some() == case.faults.short_turns()
        && bank.bounds.sides.is_some() == has_kinks(case)
        && bank.bounds.levels.is_some() == case.sensors.settings.comparator.any()
        && Sensed::fits(
            bank.sensed.as_ref(),
            &case.sensors.settings,
            case.inverter.bridge.terminal_capacitance > 0.0,
        )
        && (bank.control.follow || !is_followed(case))
}

/// The runs in the lanes of a bank.
struct SideBySide<'a, V: Wide> {
    bank: Bank<'a, V>,
    lanes: Vec<Option<Control<'a>>>,
}

impl<'a, V: Wide> SideBySide<'a, V> {
    fn new(bank: Bank<'a, V>) -> Self {
        Self { bank, lanes: (0..V::LANES).map(|_| None).collect() }
    }

    /// Puts a run into a lane. Returns the finished run if it needs no step.
    fn begin(&mut self, lane: usize, control: Control<'a>, detector: &mut Orders<'_>) -> Option<Finished> {
        let finished = advance(self.lanes[lane].insert(control), &mut self.bank, detector, Want::Command);
        if finished.is_some() {
            self.bank.schedule.live &= !(1 << lane);
        }
        finished
    }

    /// Begins the next cases in a lane, one after the other, until one of them needs a step.
    fn fill(&mut self, lane: usize, host: &mut dyn Host<'a>) {
        let mut room = self.lanes[lane].take().map_or_else(Room::default, Control::into_room);
        while let Some(case) = host.next(lane) {
            let finished = if fits(&self.bank, &case) {
                let control =
                    Control::new(case, &mut self.bank, lane, None, false, std::mem::take(&mut room));
                self.begin(lane, control, &mut |readings| host.step(lane, readings))
            } else {
                Some(alone(&case, &mut |readings| host.step(lane, readings), false, &mut NoProbe, false))
            };
            match finished {
                Some(finished) => host.over(lane, &finished),
                None => return,
            }
        }
    }

    /// Takes one step of all lanes and continues their runs. Returns the lanes whose runs have ended, as a bit mask.
    fn turn(&mut self, host: &mut dyn Host<'a>) -> u32 {
        let mut over = 0;
        self.bank.step();
        let Served { accepted, arrived, out_of_bounds, broken, carried_out, .. } = self.bank.outcome.served;
        if self.bank.control.follow {
            let thirds = [self.bank.within(1.0 / 3.0), self.bank.within(2.0 / 3.0)];
            for lane in lanes_of(accepted) {
                if let Some(control) = &mut self.lanes[lane] {
                    control.follow(&self.bank, &thirds);
                }
            }
        }
        if self.bank.sensed.is_some() {
            for lane in lanes_of(accepted) {
                if let Some(control) = &mut self.lanes[lane] {
                    control.sample_within(&mut self.bank);
                }
            }
        }
        for lane in lanes_of(arrived | out_of_bounds | broken) {
            let Some(control) = &mut self.lanes[lane] else { continue };
            let want = if broken >> lane & 1 == 1 {
                control.recover(&mut self.bank)
            } else {
                control.resume(&mut self.bank, out_of_bounds >> lane & 1 == 1)
            };
            if want == Want::Step {
                continue;
            }
            if let Some(finished) =
                advance(control, &mut self.bank, &mut |readings| host.step(lane, readings), want)
            {
                self.bank.schedule.live &= !(1 << lane);
                over |= 1 << lane;
                host.over(lane, &finished);
                control.take_back(finished.past);
            }
        }
        // Runs that arrived at an instant have already set the legs' next requests.
        for (k, carried_out) in carried_out.into_iter().enumerate() {
            for lane in lanes_of(carried_out & !(arrived | broken)) {
                if let Some(control) = &mut self.lanes[lane] {
                    control.carry_out(&mut self.bank, k);
                }
            }
        }
        over
    }
}

/// Returns the numbers of the set bits of a lane mask, in ascending order.
fn lanes_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        (bits != 0).then(|| {
            bits &= bits - 1;
            lane
        })
    })
}

/// Carries out one detection from rest.
///
/// `ledger` requests the energy balance, whose integration costs time. Neither `ledger` nor the
/// observer `probe` changes the run by a single bit.
pub fn run<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
) -> Run<T> {
    by(case, detector, ledger, probe, false)
}

/// Carries out one detection with an independent fifth-order integrator, which shares only the equations with the
/// engine's own steps. It serves tests and measures the numerical error of a run.
pub fn referee<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
) -> Run<T> {
    by(case, detector, ledger, probe, true)
}

/// Carries out one run of a detector. If `refereed` is true, the referee computes the steps instead of the engine.
fn by<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut dyn Probe,
    refereed: bool,
) -> Run<T> {
    let mut adapter = Adapter::new();
    let finished = alone(case, &mut |readings| adapter.step(detector, readings), ledger, probe, refereed);
    adapter.run(&finished, Some(detector))
}

/// Carries out one run alone, in a bank of one lane.
fn alone<'a>(
    case: &Case<'a>,
    detector: &mut Orders<'_>,
    ledger: bool,
    probe: &'a mut dyn Probe,
    refereed: bool,
) -> Finished {
    let mut driven = Driven::watched(case, Some(probe), ledger, refereed);
    while let Some(command) = detector(driven.readings()) {
        driven.note();
        if let Err(error) = driven.carry_out(&command) {
            return driven.finish(Some(error));
        }
    }
    driven.finish(None)
}

/// Runs detections side by side in one thread until `cases` is exhausted. `done` receives each run with the number of
/// its case, in the order in which runs end. Each result equals that of [`run`] bit by bit.
///
/// Each case may have its own motor, link and drive. Cases whose equations have another form than those of the first
/// case (not just other numbers) are carried out one by one.
pub fn run_side_by_side<'a, T: Real, D: Detector<T>>(
    cases: impl IntoIterator<Item = (Case<'a>, D)>,
    done: impl FnMut(usize, Run<T>),
) {
    run_side_by_side_in(Width::Avx512, cases, done);
}

/// Carries out [`run_side_by_side`] in registers no wider than `most`; the results do not depend on the width, bit by
/// bit.
pub fn run_side_by_side_in<'a, T: Real, D: Detector<T>>(
    most: Width,
    cases: impl IntoIterator<Item = (Case<'a>, D)>,
    done: impl FnMut(usize, Run<T>),
) {
    all(most, &mut Slots::new(cases.into_iter(), done));
}

/// Carries out all runs of a host, side by side.
fn all(most: Width, host: &mut dyn Host<'_>) {
    // The first case determines the kind of machines in the bank, and takes lane 0.
    if let Some(first) = host.next(0) {
        on_widest(most, Work { first, host });
    }
}

/// The runs of a host, as a computation for one register width.
struct Work<'a, 'h> {
    first: Case<'a>,
    host: &'h mut dyn Host<'a>,
}

impl OnWidest for Work<'_, '_> {
    type Output = ();

    fn with<V: Wide>(self) {
        let Self { first, host } = self;
        let bank: Bank<'_, V> = Bank::of(&first, is_followed(&first));
        let mut side_by_side = SideBySide::new(bank);
        let control = Control::new(first, &mut side_by_side.bank, 0, None, false, Room::default());
        if let Some(finished) = side_by_side.begin(0, control, &mut |readings| host.step(0, readings)) {
            host.over(0, &finished);
            side_by_side.fill(0, host);
        }
        for lane in 1..V::LANES {
            side_by_side.fill(lane, host);
        }
        while side_by_side.bank.schedule.live != 0 {
            for lane in lanes_of(side_by_side.turn(host)) {
                side_by_side.fill(lane, host);
            }
        }
    }
}
