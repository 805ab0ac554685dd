//! The gate sequencer: turns commands into successive requests to the legs.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use standstill_interface::{Abc, Command, Leg, Nanos, Stage};
use standstill_inverter::{Gate, GateTiming};
use standstill_numeric::Wide;

use super::requests::{LegPlan, Task};
use crate::physics::gates::{Alternation, LegGates, NEVER};
use crate::physics::legs::Legs;

/// The sequencer of one leg.
#[derive(Clone, Debug)]
struct LegSequencer {
    timing: GateTiming,
    plan: LegPlan,
    /// Requests of finished commands that have not yet switched the gates.
    left: VecDeque<(Nanos, Gate)>,
    /// The next request whose gate differs from `requested`, if that request is already known.
    ahead: Option<(Nanos, Gate)>,
    /// The last request that was passed to the leg's gates.
    requested: Gate,
    /// The last request before the present command.
    before: Gate,
    /// Time of the last change of the request before the present command; none if there was no change.
    changed: Option<Nanos>,
    /// Whether the leg's gates advance through alternating PWM requests by themselves, so that the sequencer must be updated
    /// before it passes the next request.
    alternates: bool,
    /// Requests to a leg whose switches may fail; none for all other legs.
    faulty: Option<Faulty>,
}

/// Requests to a leg whose switches may fail to turn on.
#[derive(Clone, Copy, Debug)]
struct Faulty {
    /// Whether the lower and the upper switch fail to turn on at present.
    lost: [bool; 2],
    /// The time in ns at which the present request turns its switch on, and the requested gate.
    under_way: (f64, Gate),
    /// The turn-off time and the turn-on time in ns of the next request, and the requested gate.
    pending: Option<(f64, f64, Gate)>,
}

impl Faulty {
    /// A leg without requests whose switches work.
    const NONE: Self = Self { lost: [false; 2], under_way: (f64::NEG_INFINITY, Gate::Off), pending: None };

    /// Returns whether the switch that a request turns on fails to turn on at present.
    fn loses(&self, gate: Gate) -> bool {
        match gate {
            Gate::Off => false,
            Gate::Low => self.lost[0],
            Gate::High => self.lost[1],
        }
    }

    /// Returns the pending request as the leg executes it. Both switches stay off if the requested switch fails to turn on.
    fn carried(&self) -> Option<(f64, f64, Gate)> {
        let (off, on, gate) = self.pending?;
        Some(if self.loses(gate) { (off, off, Gate::Off) } else { (off, on, gate) })
    }
}

impl LegSequencer {
    /// Replaces the executed request by the next request. If alternating PWM requests follow, the gates advance through
    /// them without this sequencer.
    fn expect_next<V: Wide>(&mut self, gates: &mut LegGates<V>, lane: usize) {
        let next = self.next();
        if let Some(faulty) = &mut self.faulty {
            faulty.pending = next;
            return gates.expect(lane, faulty.carried());
        }
        gates.expect(lane, next);
        if let Some((off, on, gate)) = next
            && gate != Gate::Off
            && self.left.is_empty()
            && let Some(([high_for, low_for], last)) = self.plan.alternates(self.requested_at(off))
        {
            let dead = on - off;
            // Each request must be long enough to turn its switch on.
            self.alternates = high_for > dead && low_for > dead;
            if self.alternates {
                let until = last + self.timing.turn_off_delay.0 as f64;
                gates.alternate(lane, Alternation { high_for, low_for, dead, until });
            }
        }
    }

    /// Updates the sequencer after the gates have advanced through alternating requests by themselves.
    fn catch_up<V: Wide>(&mut self, gates: &LegGates<V>, lane: usize) {
        if std::mem::take(&mut self.alternates) {
            let (off, gate) = gates.coming(lane);
            (self.ahead, self.requested) = (None, gate);
            self.plan.go_on_after(self.requested_at(off), gate);
        }
    }

    /// Returns whether all requests of this leg have been passed to its gates.
    fn is_idle(&self) -> bool {
        self.ahead.is_none() && self.plan.is_over() && self.left.is_empty()
    }

    /// Returns the time of the last change of the request before `at`, a time of the command that began at `start`.
    fn changed_before(&self, at: Nanos, start: Nanos) -> Option<Nanos> {
        (at > start).then(|| self.plan.changed(self.before, at)).flatten().or(self.changed)
    }

    /// Returns the time of the request whose turn-off is at `off` in ns.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a time is a whole number")]
    fn requested_at(&self, off: f64) -> Nanos {
        Nanos(off as u64 - self.timing.turn_off_delay.0)
    }

    /// Returns the next request whose gate differs from the last request's: its time and its gate. The request stays pending.
    #[inline]
    fn peek(&mut self) -> Option<(Nanos, Gate)> {
        while self.ahead.is_none() {
            let request = self.left.pop_front().or_else(|| self.plan.take())?;
            self.ahead = Some(request).filter(|(_, gate)| *gate != self.requested);
        }
        self.ahead
    }

    /// Removes the next request whose gate differs from the last request's. Returns its turn-off time and turn-on time in ns, and its gate.
    /// The gate is off if the request is too short to turn its switch on.
    #[inline]
    fn next(&mut self) -> Option<(f64, f64, Gate)> {
        let (at, gate) = self.peek()?;
        self.ahead = None;
        self.requested = gate;
        let off = at + self.timing.turn_off_delay;
        // The other switch is off by that time even if the delays are unequal: no shoot-through.
        let on = (at + self.timing.dead_time + self.timing.turn_on_delay).max(off);
        if gate == Gate::Off || self.loses(on.0 as f64) {
            return Some((off.0 as f64, off.0 as f64, Gate::Off));
        }
        Some((off.0 as f64, on.0 as f64, gate))
    }

    /// Returns whether the next request turns the leg off before the present one would turn its switch on, at `on` in ns. The present
    /// request is then too short to have an effect.
    fn loses(&mut self, on: f64) -> bool {
        self.peek().is_some_and(|(at, _)| (at + self.timing.turn_off_delay).0 as f64 <= on)
    }
}

/// Returns the gate that a leg keeps throughout a stage; none for a leg that switches or may switch.
fn kept(leg: &Leg<f64>) -> Option<Gate> {
    match leg {
        Leg::Off => Some(Gate::Off),
        Leg::Low => Some(Gate::Low),
        Leg::High => Some(Gate::High),
        Leg::Duty(_) | Leg::Rise(_) | Leg::Fall(_) => None,
    }
}

/// The gate sequencer of one inverter.
#[derive(Clone, Debug)]
pub struct GateSequencer {
    sequencers: [LegSequencer; 3],
    start: Nanos,
    /// Whether the times of the requests' last changes are kept from command to command, for [`GateSequencer::changed`].
    notes_changes: bool,
}

impl GateSequencer {
    /// Makes a sequencer without requests. `notes_changes` must be true if [`GateSequencer::changed`] is used.
    pub fn new(timings: [GateTiming; 3], notes_changes: bool) -> Self {
        let leg = |timing| LegSequencer {
            timing,
            plan: LegPlan::NONE,
            left: VecDeque::new(),
            ahead: None,
            requested: Gate::Off,
            before: Gate::Off,
            changed: None,
            alternates: false,
            faulty: None,
        };
        Self { sequencers: timings.map(leg), start: Nanos::ZERO, notes_changes }
    }

    /// Prepares the requests of the next command, whose first request is at `start`. `carrier` is the period of the PWM.
    pub fn begin<V: Wide>(
        &mut self,
        legs: &mut Legs<V>,
        lane: usize,
        command: &Command<f64>,
        start: Nanos,
        carrier: Nanos,
    ) {
        let first = command.stage;
        let second = command.then.unwrap_or(Stage { legs: first.legs, duration: Nanos::ZERO });
        let ends = [start + first.duration, start + first.duration + second.duration];
        let (Abc(a), Abc(b)) = (first.legs, second.legs);
        let began = std::mem::replace(&mut self.start, start);
        for (k, leg) in self.sequencers.iter_mut().enumerate() {
            let gates = &mut legs.gates[k];
            leg.catch_up(gates, lane);
            if self.notes_changes {
                leg.changed = leg.changed_before(start, began);
            }
            let tasks = [a[k], b[k]];
            // Most legs of most commands keep their gates.
            if leg.is_idle() && tasks.iter().all(|task| kept(task) == Some(leg.requested)) {
                leg.before = leg.requested;
                leg.plan = LegPlan::held(leg.requested, start, ends, carrier);
                continue;
            }
            while let Some(request) = leg.plan.take() {
                leg.left.push_back(request);
            }
            let last = leg.left.back().or(leg.ahead.as_ref());
            leg.before = last.map_or(leg.requested, |(_, gate)| *gate);
            leg.plan = LegPlan::new(tasks.map(|task| Task::new(task, carrier)), start, ends, carrier);
            match gates.comes_on(lane) {
                None if gates.waits(lane) => leg.expect_next(gates, lane),
                Some(on) if leg.loses(on) => {
                    gates.lose(lane);
                    if let Some(Faulty { pending: Some((off, on, gate)), .. }) = &mut leg.faulty {
                        (*on, *gate) = (*off, Gate::Off);
                    }
                }
                None | Some(_) => {}
            }
        }
    }

    /// Replaces a leg's executed request by the next request.
    pub fn carry_out<V: Wide>(&mut self, legs: &mut Legs<V>, lane: usize, k: usize) {
        let (gates, leg) = (&mut legs.gates[k], &mut self.sequencers[k]);
        leg.catch_up(gates, lane);
        gates.carry_out(lane);
        if let Some(faulty) = &mut leg.faulty
            && let Some((_, on, gate)) = faulty.pending
        {
            faulty.under_way = (on, gate);
        }
        leg.expect_next(gates, lane);
    }

    /// Declares that switches of a leg may fail in this run, so that [`Self::lose`] and [`Self::intended`] work for it.
    pub fn may_lose(&mut self, k: usize) {
        self.sequencers[k].faulty = Some(Faulty::NONE);
    }

    /// Sets whether the lower and the upper switch of a leg fail to turn on from now on.
    pub fn lose<V: Wide>(&mut self, legs: &mut Legs<V>, lane: usize, k: usize, lost: [bool; 2]) {
        let Some(faulty) = &mut self.sequencers[k].faulty else { return };
        faulty.lost = lost;
        let (on, gate) = faulty.under_way;
        let gates = &mut legs.gates[k];
        gates.put_under_way(lane, (on, if faulty.loses(gate) { Gate::Off } else { gate }));
        gates.expect(lane, faulty.carried());
    }

    /// Returns the gate that a leg would have at a time in ns if its switches worked; none for legs whose switches
    /// cannot fail.
    pub fn intended(&self, k: usize, time: f64) -> Option<Gate> {
        let faulty = self.sequencers[k].faulty?;
        Some(match faulty.pending {
            Some((off, on, gate)) if time >= off => {
                if time >= on {
                    gate
                } else {
                    Gate::Off
                }
            }
            _ if time >= faulty.under_way.0 => faulty.under_way.1,
            _ => Gate::Off,
        })
    }

    /// Returns the next time in ns after `time` at which the result of [`Self::intended`] may change, as far as requests are known;
    /// [`NEVER`] if there is no such time.
    pub fn next_intended(&self, k: usize, time: f64) -> f64 {
        let Some(faulty) = self.sequencers[k].faulty else { return NEVER };
        let (off, on, _) = faulty.pending.unwrap_or((NEVER, NEVER, Gate::Off));
        [faulty.under_way.0, off, on].into_iter().filter(|at| *at > time).fold(NEVER, f64::min)
    }

    /// Returns the times of the last changes of the requests to the legs before `at`, a time of this command; none for
    /// a leg whose request has not changed since the start of the run.
    pub fn changed(&self, at: Nanos) -> [Option<Nanos>; 3] {
        self.sequencers.each_ref().map(|leg| leg.changed_before(at, self.start))
    }

    /// Returns the requests to the legs just before `at`, which is the begin of the present command or a later time
    /// within it.
    pub fn requested(&self, at: Nanos) -> [Gate; 3] {
        self.sequencers
            .each_ref()
            .map(|leg| if at > self.start { leg.plan.requested(at) } else { leg.before })
    }
}
