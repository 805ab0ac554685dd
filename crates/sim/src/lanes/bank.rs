//! Machines side by side: each steps to its own next instant or to the end of one of its modes.

use standstill_interface::Dq;
use standstill_inverter::Inverter;
use standstill_numeric::{Compute, MOST_LANES, Mask, Symmetric, Wide};
use standstill_plant::Motor;

use crate::case::RunError;
use crate::physics::bounds::{Bounds, ENDS};
use crate::physics::machine::{Machine, Operating};
use crate::physics::memory::Memory;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::two_derivative::{Here, Tried};
use standstill_inverter::Source;

/// Machines of one kind, what they do until when, and what became of it.
#[derive(Clone, Debug)]
pub struct Bank<'a, V: Wide> {
    /// The machines.
    pub machine: Machine<'a, V>,
    /// What ends their modes.
    pub bounds: Bounds<V>,
    /// Where they are.
    pub here: Here<V>,
    /// How exact their steps must be.
    pub accuracy: Accuracy<V>,
    /// A bit for each machine that steps.
    pub live: u32,
    /// The next instant of each in ns, gate edges apart.
    pub stop: V,
    /// Length of the step to try next, and of the longest one, in ns.
    pub hint: V,
    /// See `hint`.
    pub longest: V,
    /// A bit for each machine of which a mode ends at `mode_end`.
    pub to_mode_end: u32,
    /// In ns.
    pub mode_end: V,
    /// Which mode that is.
    pub ending_mode: [usize; MOST_LANES],
    /// Largest phase current in A so far.
    pub peak: V,
    /// Furthest from the start in rad so far.
    pub moved: V,
    /// Steps in a row that were not taken.
    pub refused: V,
    /// Accepted steps, and all.
    pub steps: V,
    /// See `steps`.
    pub evaluations: V,
    /// Whether steps are looked at from within: `begin` and `tried` are then those of the last.
    pub follow: bool,
    /// Whether the referee takes the steps of a machine alone.
    pub refereed: bool,
    /// Where the last step began.
    pub begin: Here<V>,
    /// What the iron remembered there.
    pub begin_memory: Option<Memory<V>>,
    /// The last step.
    pub tried: Tried<V>,
    /// What became of it. Read number by number: what was stored in small pieces and is loaded in a large one would have to wait
    /// for all that was stored before.
    pub served: Served,
}

/// What became of a step: a bit for each machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Served {
    /// Took the step.
    pub accepted: u32,
    /// Is at its next instant, or where a mode ends.
    pub arrived: u32,
    /// A blocked leg's potential was out of its bounds before the step.
    pub out_of_bounds: u32,
    /// Changes too fast for any step, or is no number.
    pub broken: u32,
    /// Of those, who changes no faster than steps can follow, but is beyond the end of a mode in each.
    pub stuck: u32,
    /// A request to a leg has been carried out: the next one is wanted.
    pub carried_out: [u32; 3],
    /// A mode ends within the step.
    crossed: u32,
}

/// No mode has ended: a margin was negative by rounding only.
pub const NOTHING: usize = ENDS;

/// So many steps in a row that are not taken end a run: each is shorter than the one before, or is cut where a mode ends.
const MOST_REFUSED: f64 = 200.0;

/// The share of the tolerance that the next step is to take, and how many times as long as this one it is at most.
const HALF: f64 = 0.5;
/// See [`HALF`].
const LONGER_AT_MOST: f64 = 4.0;
/// A step that is tried again is at most this share of the one before, 0.7 being what a fourth power makes of four times the
/// tolerance, and at least a tenth of it: the error's order is not reached where the error is large.
const SHORTER_AT_LEAST: f64 = 0.7;
/// See [`SHORTER_AT_LEAST`].
const SHORTER_AT_MOST: f64 = 0.1;

/// A step in ns below which nothing can be resolved.
const SHORTEST: f64 = 1e-6;

impl<'a, V: Wide> Bank<'a, V> {
    /// For machines of the kind of this one, on this kind of inverter; `free`: whether rotors can move, `follow`: whether steps
    /// are looked at from within.
    pub fn like(motor: &'a Motor, inverter: &Inverter, free: bool, follow: bool) -> Self {
        use standstill_plant::Magnetics;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (plane, dq) = (Plane::new(zero, zero), Dq::new(zero, zero));
        let machine = Machine::like(motor, inverter, free);
        let rest =
            State { flux: plane, turned: zero, speed: zero, link: zero, lagging: dq, potential: [zero; 3] };
        let at = Operating {
            current: plane,
            inverse_inductance: Symmetric::new(one, zero, one),
            turning: plane,
            relaxing: plane,
            energy_turn: plane,
            energy_bend: zero,
            torque: zero,
            cogging_slope: zero,
            core_flux: dq,
            core_current: dq,
            lag: dq,
        };
        let here = Here { time: zero, state: rest, at, source: Source { voltage: zero, rise: zero } };
        let bounds = Bounds::new(motor.magnetics.core().kinks() != [false; 2]);
        let accuracy = Accuracy { per_flux: one, per_angle: one, per_flux_scale: one, filtered: zero };
        let tried = Tried::none(&here, machine.legs.at::<true>(zero, zero));
        Self {
            machine,
            bounds,
            begin: here,
            begin_memory: None,
            here,
            accuracy,
            live: 0,
            stop: zero,
            hint: zero,
            longest: zero,
            to_mode_end: 0,
            mode_end: zero,
            ending_mode: [0; MOST_LANES],
            peak: zero,
            moved: zero,
            refused: zero,
            steps: zero,
            evaluations: zero,
            follow,
            refereed: false,
            tried,
            served: Served::default(),
        }
    }

    /// Tries a step of each machine that is live. Where a mode ends within it, the next one will end there.
    pub fn step(&mut self) {
        if self.machine.legs.elastance.is_some() || self.machine.memory.is_some() || self.refereed {
            V::compute(StepOf::<_, true>(self));
        } else {
            V::compute(StepOf::<_, false>(self));
        }
        let mut left = self.served.crossed;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            self.find_end(lane);
        }
    }

    /// Why a machine is broken.
    pub fn why_broken(&self, lane: usize) -> RunError {
        if self.served.stuck >> lane & 1 == 1 { RunError::Stuck } else { RunError::NotFinite }
    }

    /// Evaluates a machine anew at its state.
    pub fn look(&mut self, lane: usize) {
        V::compute(LookAt(self, 1 << lane));
    }

    /// The machines at a share of the step taken last.
    pub fn within(&self, share: f64) -> Here<V> {
        V::compute(Within(self, share))
    }
}

/// A step of each machine. What rings with terminals and what the iron remembers take more room than all else of a step: `RARE`
/// is false where no machine has either, and the step then does without.
struct StepOf<'b, 'a, V: Wide, const RARE: bool>(&'b mut Bank<'a, V>);

impl<V: Wide, const RARE: bool> Compute for StepOf<'_, '_, V, RARE> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let bank = self.0;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (live, to_mode_end) = (V::Mask::of_bits(bank.live), V::Mask::of_bits(bank.to_mode_end));
        let legs = bank.machine.legs.at::<RARE>(bank.here.time, bank.machine.resistance);
        if bank.machine.memory_if::<RARE>().is_some() {
            bank.machine.find_cells(live, &legs, &mut bank.here.at, &bank.here.state);
        }
        let here = &bank.here;
        let edge = bank.machine.legs.next_edge(here.time);
        let stop = bank.stop.least(edge);
        let free_end = stop.least(here.time + bank.hint.least(bank.longest));
        let until =
            V::choose(live, V::choose(to_mode_end, bank.mode_end, free_end), here.time).greatest(here.time);
        let tried = if RARE && V::ALONE && bank.refereed {
            Tried::refereed(&bank.machine, &bank.bounds, &legs, here, until, &bank.accuracy)
        } else {
            Tried::new::<RARE>(&bank.machine, &bank.bounds, &legs, here, until, &bank.accuracy)
        };

        let exact = V::of(1.0 + 1e-12).above(tried.error);
        let out_of_bounds = live & zero.above(tried.blocked_at_begin);
        let may = live & exact & !out_of_bounds;
        let ends = (zero.above(tried.least_margin) & !to_mode_end)
            | (zero.above(tried.least_at_mode_end) & to_mode_end);
        let crossed = may & ends;
        let accepted = may & !crossed;
        // A cut that is not exact is none: shorter steps find their own.
        bank.to_mode_end &= !(live & !exact & !out_of_bounds).bits();
        let length = until - here.time;
        bank.refused = V::only(live & !accepted & !out_of_bounds, bank.refused + 1.0);
        let hopeless = bank.refused.above(V::of(MOST_REFUSED));
        let broken = live & ((V::of(SHORTEST).above(length) & !exact & !out_of_bounds) | hopeless);

        // The next step's length: the error falls with the fourth power or more. Not-a-number asks for a shorter one.
        let target = V::choose(tried.error.above(-one), tried.error, V::of(1e3)) + 1e-4;
        let mut factor = V::of(LONGER_AT_MOST);
        // Where it has room for the longest, no root is needed.
        if V::any(
            target.above(V::of(HALF / (LONGER_AT_MOST * LONGER_AT_MOST * LONGER_AT_MOST * LONGER_AT_MOST))),
        ) {
            factor = (V::of(HALF) / target).sqrt().sqrt().least(factor).greatest(V::of(SHORTER_AT_MOST));
        }
        let next = length * factor;
        // A step that ended at an instant says little about the next one's length.
        let longer = V::choose(bank.hint.above(length), next.greatest(bank.hint), next);
        let hint = V::choose(exact, longer, next.least(length * SHORTER_AT_LEAST));
        bank.hint = V::choose(live & !out_of_bounds, hint, bank.hint);

        // Gate edges alone need nobody where a current flows: what they make of the legs follows from the time.
        let mut at_edge = legs.idle & !edge.above(until);
        if RARE && bank.machine.legs.elastance.is_some() {
            // The charge of a terminal decides what an edge does.
            at_edge = !edge.above(until);
        }
        let arrived = accepted & (to_mode_end | !bank.stop.above(until) | at_edge);
        let [a, b, c] = bank.machine.legs.carried_out(until);
        let mut carried_out = [accepted & a, accepted & b, accepted & c];
        // Who looks at a step from within wants its gates as they were.
        if !bank.follow && V::any(carried_out[0] | carried_out[1] | carried_out[2]) {
            carried_out = bank.machine.legs.follow_on(carried_out);
        }
        let carried_out = [carried_out[0].bits(), carried_out[1].bits(), carried_out[2].bits()];
        bank.steps = bank.steps + V::only(accepted, one);
        bank.evaluations = bank.evaluations + V::only(live, one);
        let [a, b, c] = tried.phases[1];
        bank.peak = bank.peak.greatest(V::only(accepted, a.abs().greatest(b.abs()).greatest(c.abs())));
        if bank.machine.rotors.is_some() {
            bank.moved = bank.moved.greatest(V::only(accepted, tried.end.state.turned.abs()));
        }
        let crossed = crossed.bits();
        bank.served = Served {
            accepted: accepted.bits(),
            arrived: arrived.bits(),
            out_of_bounds: out_of_bounds.bits(),
            broken: broken.bits(),
            stuck: (broken & exact).bits(),
            carried_out,
            crossed,
        };
        if bank.follow {
            bank.begin = bank.here;
            bank.begin_memory.clone_from(&bank.machine.memory);
            bank.tried = tried;
        } else if crossed != 0 {
            bank.keep_for_ends::<RARE>(&tried);
        }
        take(&bank.machine, bank.bounds.sides.is_some(), &mut bank.here, &tried.end, accepted);
        if RARE && let (Some(memory), Some(moved)) = (&mut bank.machine.memory, &tried.moved) {
            memory.take(accepted, tried.end.state.flux, moved);
        }
    }
}

/// Makes the end of a step the place of those that took it. What does not change in machines of this kind is left as it is;
/// `kinks`: whether the core's flux is asked for.
#[inline(always)]
fn take<V: Wide>(machine: &Machine<V>, kinks: bool, here: &mut Here<V>, end: &Here<V>, accepted: V::Mask) {
    let choose = |to: &mut V, from: V| *to = V::choose(accepted, from, *to);
    let plane = |to: &mut Plane<V>, from: Plane<V>| *to = Plane::choose(accepted, from, *to);
    let dq = |to: &mut Dq<V>, from: Dq<V>| {
        choose(&mut to.d, from.d);
        choose(&mut to.q, from.q);
    };
    choose(&mut here.time, end.time);
    choose(&mut here.source.voltage, end.source.voltage);
    choose(&mut here.source.rise, end.source.rise);
    plane(&mut here.state.flux, end.state.flux);
    choose(&mut here.state.link, end.state.link);
    let (to, from) = (&mut here.at, &end.at);
    plane(&mut to.current, from.current);
    choose(&mut to.inverse_inductance.xx, from.inverse_inductance.xx);
    choose(&mut to.inverse_inductance.xy, from.inverse_inductance.xy);
    choose(&mut to.inverse_inductance.yy, from.inverse_inductance.yy);
    if machine.rotors.is_some() {
        choose(&mut here.state.turned, end.state.turned);
        choose(&mut here.state.speed, end.state.speed);
        plane(&mut to.turning, from.turning);
        plane(&mut to.energy_turn, from.energy_turn);
        choose(&mut to.energy_bend, from.energy_bend);
        choose(&mut to.torque, from.torque);
        choose(&mut to.cogging_slope, from.cogging_slope);
    }
    if machine.circuits.eddies().is_some() {
        dq(&mut here.state.lagging, end.state.lagging);
        plane(&mut to.relaxing, from.relaxing);
        dq(&mut to.lag, from.lag);
    }
    if machine.legs.elastance.is_some() {
        for (to, from) in here.state.potential.iter_mut().zip(end.state.potential) {
            choose(to, from);
        }
    }
    if kinks {
        dq(&mut to.core_flux, from.core_flux);
    }
    if machine.circuits.have_ends() {
        dq(&mut to.core_current, from.core_current);
    }
}

/// Machines evaluated anew at their states: a bit for each.
struct LookAt<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32);

impl<V: Wide> Compute for LookAt<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let here = &self.0.here;
        let iron = self.0.machine.memory.as_ref().map(|memory| memory.iron_here(here.state.flux));
        let at = self.0.machine.operating(&here.state, iron.as_ref());
        let there = Here { time: here.time, state: here.state, at, source: here.source };
        let bank = self.0;
        if let (Some(memory), Some(iron)) = (&mut bank.machine.memory, &iron) {
            memory.set_tangent(V::Mask::of_bits(self.1), iron.tangent);
        }
        take(&bank.machine, true, &mut bank.here, &there, V::Mask::of_bits(self.1));
    }
}

/// Machines at a share of the step taken last.
struct Within<'b, 'a, V: Wide>(&'b Bank<'a, V>, f64);

impl<V: Wide> Compute for Within<'_, '_, V> {
    type Output = Here<V>;

    #[inline(always)]
    fn compute(self) -> Here<V> {
        let Self(bank, share) = self;
        bank.tried.within(&bank.machine, &bank.begin, bank.begin_memory.as_ref(), V::of(share))
    }
}

#[cfg(test)]
mod tests;
