//! A step of all machines of a bank, and its acceptance or rejection.

use standstill_numeric::{Compute, Mask, Wide};

use super::{Bank, Served};
use crate::effect::terminals::floating::SEEN;
use crate::effect::{Effect, each_effect, keep, keep_dq};
use crate::guard::Guard;
use crate::lanes::lanes_of;
use crate::physics::gates::NEVER;
use crate::physics::machine::Machine;
use crate::step::two_derivative::{Here, Tried};

/// Largest number of successive rejected steps. One more rejected step ends the run. After each rejection the next step is shorter or
/// ends where a mode ends.
const MOST_REFUSED: f64 = 200.0;

/// The length of the next step is chosen such that its expected error is this share of the tolerance.
const HALF: f64 = 0.5;
/// Largest ratio of the length of the next step to that of the present one.
const LONGER_AT_MOST: f64 = 4.0;
/// Replaces [`LONGER_AT_MOST`] in steps with ringing terminals. The error of such a step depends on the phase of the oscillation: twice
/// in each period it is small by accident.
const LONGER_WHERE_IT_RINGS: f64 = 1.5;
/// Size of a terminal's oscillation below which [`LONGER_AT_MOST`] holds for ringing terminals, too: an amplitude of 0.75 % of the link's
/// voltage. The error of so small an oscillation is negligible at any phase.
const STILL: f64 = 0.03;
/// An oscillation certainly cannot end a leg's current before a time that is known. The next step ends at this share of that time.
const BEFORE: f64 = 0.97;
/// Square of the angle in rad by which an eigenmode turns in a step. Below this value [`LONGER_AT_MOST`] holds for ringing terminals,
/// too: even in a step four times as long the mode turns no further than [`SEEN`] allows.
const HARDLY: f64 = SEEN / (LONGER_AT_MOST * LONGER_AT_MOST);
/// Largest length of a step after a rejected one, as a share of the rejected step. It suits an error of four times the tolerance: since
/// the error grows with the fourth power of the length, 0.7 is the right share.
const SHORTER_AT_LEAST: f64 = 0.7;
/// Smallest length of a step after a rejected one, as a share of the rejected step. A large error says little about the right length,
/// because it does not follow the fourth-power law.
const SHORTER_AT_MOST: f64 = 0.1;

/// Shortest step in ns. Times have no finer resolution.
const SHORTEST: f64 = 1e-6;

impl<V: Wide> Bank<'_, V> {
    /// Cuts steps at the time at which a current is expected to have charged a terminal to its bound.
    #[inline(always)]
    fn end_as_expected(&mut self, live: V::Mask, free_end: V) {
        let plan = &mut self.schedule;
        let cut = V::Mask::of_bits(plan.to_mode_end);
        let expecting = live & !cut & !plan.expected.above(free_end);
        plan.mode_end = V::choose(expecting, plan.expected, plan.mode_end);
        // An expected time is used once: if no mode ends there, the steps locate the end themselves.
        plan.expected = V::choose(expecting, V::of(NEVER), plan.expected);
        plan.to_mode_end |= expecting.bits();
        plan.nearest &= !expecting.bits();
        for lane in lanes_of(expecting.bits()) {
            plan.ending_mode[lane] = Some(Guard::Leg(plan.carried[lane]));
        }
    }
}

/// One step of all machines. `RARE` says whether the code for ringing terminals, play cells and shorted turns is included. That code is
/// larger than the rest of a step.
pub(super) struct StepOf<'b, 'a, V: Wide, const RARE: bool>(pub(super) &'b mut Bank<'a, V>);

impl<V: Wide, const RARE: bool> Compute for StepOf<'_, '_, V, RARE> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let bank = self.0;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let live = V::Mask::of_bits(bank.schedule.live);
        let legs = bank.machine.legs.at::<RARE>(bank.here.time, bank.machine.resistance);
        let capacitive = bank.machine.legs.elastance_if::<RARE>().is_some();
        if RARE {
            bank.machine.find_modes(live, &legs, &mut bank.here.at, &bank.here.state);
        }
        let edge = bank.machine.legs.next_edge(bank.here.time);
        let stop = bank.schedule.stop.least(edge);
        let free_end = stop.least(bank.here.time + bank.control.next.least(bank.control.longest));
        if capacitive {
            bank.end_as_expected(live, free_end);
        }
        let (here, plan, control) = (&bank.here, &mut bank.schedule, &mut bank.control);
        let to_mode_end = V::Mask::of_bits(plan.to_mode_end);
        let until =
            V::choose(live, V::choose(to_mode_end, plan.mode_end, free_end), here.time).greatest(here.time);
        let accuracy = control.accuracy.of_step(until, plan.sample);
        let tried = if RARE && V::ALONE && control.refereed {
            Tried::refereed(&bank.machine, &bank.bounds, &legs, here, until, &accuracy)
        } else {
            Tried::new::<RARE>(&bank.machine, &bank.bounds, &legs, here, until, &accuracy)
        };

        let exact = V::of(1.0 + 1e-12).above(tried.error);
        let out_of_bounds = live & zero.above(tried.blocked_at_begin);
        let may = live & exact & !out_of_bounds;
        let ends = (zero.above(tried.least_margin) & !to_mode_end)
            | (zero.above(tried.least_at_mode_end) & V::Mask::of_bits(plan.to_mode_end & !plan.nearest));
        let crossed = may & ends;
        let accepted = may & !crossed;
        // If a step cut at a mode's end is not exact, its cut is dropped: shorter steps locate the end anew.
        plan.to_mode_end &= !(live & !exact & !out_of_bounds).bits();
        let length = until - here.time;
        control.refused = V::only(live & !accepted & !out_of_bounds, control.refused + 1.0);
        let hopeless = control.refused.above(V::of(MOST_REFUSED));
        let broken = live & ((V::of(SHORTEST).above(length) & !exact & !out_of_bounds) | hopeless);

        // The next step's length: the error grows with its fourth power or faster. An error that is not a number asks for a shorter step.
        let target = V::choose(tried.error.above(-one), tried.error, V::of(1e3)) + 1e-4;
        let mut longest = V::of(LONGER_AT_MOST);
        if RARE && let Some(floating) = &tried.floating {
            let [a, b, c] = legs.flows;
            let still = V::of(STILL).above(floating.size) | V::of(HARDLY).above(floating.turned());
            longest = V::choose(a & b & c | still, longest, V::of(LONGER_WHERE_IT_RINGS));
        }
        let mut factor = longest;
        // If all errors allow the longest step, no root is needed.
        if V::any(
            target.above(V::of(HALF / (LONGER_AT_MOST * LONGER_AT_MOST * LONGER_AT_MOST * LONGER_AT_MOST))),
        ) {
            factor = (V::of(HALF) / target).sqrt().sqrt().least(factor).greatest(V::of(SHORTER_AT_MOST));
        }
        let next = length * factor;
        // A step that ended at an instant says little about the next one's length.
        let longer = V::choose(control.next.above(length), next.greatest(control.next), next);
        let mut next = V::choose(exact, longer, next.least(length * SHORTER_AT_LEAST));
        if RARE && let Some(floating) = &tried.floating {
            // The step is too long only because a current may end within it: a step that ends a little before that time is exact.
            let ends = !exact & one.above(floating.exact) & V::of(BEFORE).above(floating.until);
            next = V::choose(ends, next.greatest(length * floating.until * BEFORE), next);
        }
        control.next = V::choose(live & !out_of_bounds, next, control.next);

        // While a current flows, a gate edge alone needs no action of the run: the legs' conduction follows from the time.
        let mut at_edge = legs.idle & !edge.above(until);
        if capacitive {
            // With a capacitance, the effect of an edge depends on the terminal's potential.
            at_edge = !edge.above(until);
        }
        let arrived = accepted & (to_mode_end | !plan.stop.above(until) | at_edge);
        let [a, b, c] = bank.machine.legs.carried_out(until);
        let mut carried_out = [accepted & a, accepted & b, accepted & c];
        // If values inside the step are needed, the gates must stay as they were during the step.
        if !control.follow && V::any(carried_out[0] | carried_out[1] | carried_out[2]) {
            carried_out = bank.machine.legs.follow_on(carried_out);
        }
        let carried_out = [carried_out[0].bits(), carried_out[1].bits(), carried_out[2].bits()];
        let outcome = &mut bank.outcome;
        outcome.steps = outcome.steps + V::only(accepted, one);
        outcome.evaluations = outcome.evaluations + V::only(live, one);
        let [a, b, c] = tried.phases[1];
        outcome.peak = outcome.peak.greatest(V::only(accepted, a.abs().greatest(b.abs()).greatest(c.abs())));
        if bank.machine.rotors.is_some() {
            outcome.moved = outcome.moved.greatest(V::only(accepted, tried.end.state.turned.abs()));
        }
        let crossed = crossed.bits();
        outcome.served = Served {
            accepted: accepted.bits(),
            arrived: arrived.bits(),
            out_of_bounds: out_of_bounds.bits(),
            broken: broken.bits(),
            stuck: (broken & exact).bits(),
            carried_out,
            crossed,
        };
        if let Some(sensed) = &mut bank.sensed {
            sensed.keep::<RARE>(accepted, &bank.here, &tried, &bank.machine);
        }
        if control.follow {
            outcome.begin = bank.here;
            outcome.begin_branch.clone_from(&bank.machine.branch);
            outcome.tried = tried;
        } else if crossed != 0 {
            bank.keep_for_ends::<RARE>(&tried);
        }
        take(&bank.machine, bank.bounds.sides.is_some(), &mut bank.here, &tried.end, accepted);
        if RARE && let (Some(branch), Some(step)) = (&mut bank.machine.branch, &tried.branch) {
            branch.take(accepted, tried.end.state.flux, step);
        }
    }
}

/// Makes the end of a step the present state of the machines that accepted the step. Values that are constant for this kind of machine
/// are not copied. `kinks` says whether the core's flux is copied.
#[inline(always)]
pub(super) fn take<V: Wide>(
    machine: &Machine<V>,
    kinks: bool,
    here: &mut Here<V>,
    end: &Here<V>,
    accepted: V::Mask,
) {
    keep(accepted, end.time, &mut here.time);
    each_effect!(machine, machine.branch.as_ref(), effect => effect.keep(accepted, end, here));
    if kinks {
        keep_dq(accepted, end.at.core_flux, &mut here.at.core_flux);
    }
    if machine.circuits.have_ends() {
        keep_dq(accepted, end.at.core_current, &mut here.at.core_current);
    }
}
