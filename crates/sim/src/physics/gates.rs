//! The gates of several inverters side by side: times and bit masks that are evaluated for all lanes at once.
//!
//! A request turns both switches of a leg off at once, and the requested one on after the dead time. Each leg stores
//! two requests: `from`, which is being carried out, and `to`, the pending one:
//! ```text
//!          done            off       on
//!   … off   │  from (on)    │  off    │  to (on) …
//!   ────────┴───────────────┴─────────┴──────────► time
//! ```
//! If the next request comes before the dead time of a request is over, the gate of that request never turns on. It is
//! then replaced by a request for both switches off.
//!
//! In the middle of a stage with pulse-width modulation, requests alternate at two fixed intervals. Each leg also
//! stores these intervals and the time until which they apply, so that its next request is computed for all lanes at
//! once.

use standstill_inverter::Gate;
use standstill_numeric::{Mask, Wide};

/// A time in ns that never comes.
pub const NEVER: f64 = f64::INFINITY;

/// The switches of one leg that are on. Each field is a mask with one bit per machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct On<M = u32> {
    /// The upper switch.
    pub high: M,
    /// The lower switch.
    pub low: M,
}

impl On {
    fn put(&mut self, lane: usize, gate: Gate) {
        let bit = |to: &mut u32, on: bool| *to = *to & !(1 << lane) | u32::from(on) << lane;
        bit(&mut self.high, gate == Gate::High);
        bit(&mut self.low, gate == Gate::Low);
    }

    fn of(self, lane: usize) -> Gate {
        if self.high >> lane & 1 == 1 {
            Gate::High
        } else if self.low >> lane & 1 == 1 {
            Gate::Low
        } else {
            Gate::Off
        }
    }

    fn masks<M: Mask>(self) -> On<M> {
        On { high: M::of_bits(self.high), low: M::of_bits(self.low) }
    }
}

impl<M: Mask> On<M> {
    /// Returns the machines in which turning these switches on or off affects the leg's conduction. `out` and `into` are the machines
    /// whose current flows out of the leg and into it. `both` are the machines whose switches conduct in both directions; in the other
    /// machines a diode's current does not depend on the parallel switch.
    #[inline(always)]
    fn matter(self, out: M, into: M, both: M) -> M {
        (out & self.high) | (into & self.low) | ((both | !(out | into)) & (self.high | self.low))
    }
}

/// The gates of one leg in each machine. All times are in ns.
#[derive(Clone, Copy, Debug, Default)]
pub struct LegGates<V> {
    /// Time at which the gate becomes `from`. It remains `from` until the time `off`.
    done: V,
    /// Time at which the pending request turns both switches off.
    off: V,
    /// Time at which the pending request turns the requested switch on.
    on: V,
    /// Gate state that the request being carried out has requested.
    from: On,
    /// Gate state that the pending request has requested.
    to: On,
    /// Duration from a request for the upper switch to the next request for the lower switch.
    high_for: V,
    /// Duration from a request for the lower switch to the next request for the upper switch.
    low_for: V,
    /// Time between the turn-off and the turn-on of one request.
    dead: V,
    /// Latest turn-off time of any alternating request.
    alternates_until: V,
}

/// Alternating requests for the two switches of a leg. Each request lasts long enough to turn its switch on. All times are in ns.
#[derive(Clone, Copy, Debug)]
pub struct Alternation {
    /// Duration from a request for the upper switch to the next request for the lower switch.
    pub high_for: f64,
    /// Duration from a request for the lower switch to the next request for the upper switch.
    pub low_for: f64,
    /// Time between the turn-off and the turn-on of one request.
    pub dead: f64,
    /// Latest turn-off time of any alternating request.
    pub until: f64,
}

impl<V: Wide> LegGates<V> {
    /// Makes gates in the off state, without pending requests.
    pub fn new() -> Self {
        let mut gates = Self::default();
        (0..V::LANES).for_each(|lane| gates.clear(lane));
        gates
    }

    /// Sets that, after the pending request of a lane, requests for the upper and the lower switch alternate at the intervals `by`.
    pub fn alternate(&mut self, lane: usize, by: Alternation) {
        self.high_for.put(lane, by.high_for);
        self.low_for.put(lane, by.low_for);
        self.dead.put(lane, by.dead);
        self.alternates_until.put(lane, by.until);
    }

    /// Returns the turn-off time in ns and the gate state of the pending request.
    pub fn coming(&self, lane: usize) -> (f64, Gate) {
        (self.off.get(lane), self.to.of(lane))
    }

    /// In lanes with alternating requests, replaces executed requests by the next ones. Returns the other lanes with an executed request:
    /// for these the caller must set the next request.
    #[inline(always)]
    pub fn follow_on(&mut self, carried_out: V::Mask) -> V::Mask {
        let next = self.off + V::choose(V::Mask::of_bits(self.to.high), self.high_for, self.low_for);
        let follows = carried_out & !next.above(self.alternates_until);
        self.done = V::choose(follows, self.on, self.done);
        self.off = V::choose(follows, next, self.off);
        self.on = V::choose(follows, next + self.dead, self.on);
        let bits = follows.bits();
        self.from.high = self.from.high & !bits | self.to.high & bits;
        self.from.low = self.from.low & !bits | self.to.low & bits;
        self.to.high ^= bits;
        self.to.low ^= bits;
        carried_out & !follows
    }

    /// Turns the gates of a lane off and removes the pending request.
    pub fn clear(&mut self, lane: usize) {
        self.done.put(lane, -NEVER);
        self.from.put(lane, Gate::Off);
        self.expect(lane, None);
    }

    /// Returns whether no request is pending.
    pub fn waits(&self, lane: usize) -> bool {
        self.off.get(lane) == NEVER
    }

    /// Sets the pending request of a lane: its turn-off time in ns, its turn-on time in ns, and its gate state. `None` means no request.
    pub fn expect(&mut self, lane: usize, request: Option<(f64, f64, Gate)>) {
        let (off, on, gate) = request.unwrap_or((NEVER, NEVER, Gate::Off));
        self.off.put(lane, off);
        self.on.put(lane, on);
        self.to.put(lane, gate);
        self.alternates_until.put(lane, -NEVER);
    }

    /// Returns the time in ns at which the pending request turns a switch on. None if it requests both switches off.
    pub fn comes_on(&self, lane: usize) -> Option<f64> {
        (self.to.of(lane) != Gate::Off).then(|| self.on.get(lane))
    }

    /// Cancels the turn-on of the pending request. It would come too late, because the next request turns the leg off earlier.
    pub fn lose(&mut self, lane: usize) {
        let off = self.off.get(lane);
        self.expect(lane, Some((off, off, Gate::Off)));
    }

    /// Replaces the request that is being carried out. The pair contains the new request's turn-on time in ns and its gate state.
    pub fn put_under_way(&mut self, lane: usize, (on, gate): (f64, Gate)) {
        self.done.put(lane, if gate == Gate::Off { -NEVER } else { on });
        self.from.put(lane, gate);
    }

    /// Replaces the executed request by the pending one. The caller must then set the new pending request.
    pub fn carry_out(&mut self, lane: usize) {
        let to = self.to.of(lane);
        self.done.put(lane, if to == Gate::Off { -NEVER } else { self.on.get(lane) });
        self.from.put(lane, to);
    }

    /// Returns the switches that are on. `time` contains for each lane its own time in ns.
    #[inline(always)]
    pub fn at(&self, time: V) -> On<V::Mask> {
        let (from, to) = (self.from.masks::<V::Mask>(), self.to.masks::<V::Mask>());
        let before = self.off.above(time);
        let first = before & !self.done.above(time);
        let second = !before & !self.on.above(time);
        On { high: (first & from.high) | (second & to.high), low: (first & from.low) | (second & to.low) }
    }

    /// Returns the gate state of one lane at a time in ns.
    pub fn of(&self, lane: usize, time: f64) -> Gate {
        if time < self.off.get(lane) {
            if time < self.done.get(lane) { Gate::Off } else { self.from.of(lane) }
        } else if time < self.on.get(lane) {
            Gate::Off
        } else {
            self.to.of(lane)
        }
    }

    /// Returns the time in ns of the next gate edge after `time` that may affect the leg's conduction. `out` and `into` are the lanes
    /// whose current flows out of the leg and into it. `both` are the lanes whose switches conduct in both directions. No edge with an
    /// effect is left out, but a returned edge may have no effect.
    #[inline(always)]
    pub fn next_edge(&self, time: V, out: V::Mask, into: V::Mask, both: V::Mask) -> V {
        let from = self.from.masks::<V::Mask>().matter(out, into, both);
        let later = V::choose(from & self.off.above(time), self.off, self.on);
        V::choose(from & self.done.above(time), self.done.least(later), later)
    }

    /// Returns the lanes in which the pending request can have no further effect on the leg's conduction at `time` in ns. The masks are
    /// those of [`Self::next_edge`].
    #[inline(always)]
    pub fn carried_out(&self, time: V, out: V::Mask, into: V::Mask, both: V::Mask) -> V::Mask {
        let to = self.to.masks::<V::Mask>().matter(out, into, both);
        !self.on.above(time) | (!self.off.above(time) & !self.done.above(time) & !to)
    }

    /// Returns the time in ns of a lane's next gate edge after `time`, and the gate state after this edge.
    pub fn next_of(&self, lane: usize, time: f64) -> (f64, Gate) {
        let (done, off, on) = (self.done.get(lane), self.off.get(lane), self.on.get(lane));
        if time < done && done < off {
            (done, self.from.of(lane))
        } else if time < off && self.from.of(lane) != Gate::Off && done < off {
            (off, Gate::Off)
        } else {
            (on, self.to.of(lane))
        }
    }

    /// Returns the result of [`Self::carried_out`] for one lane. `direction` is +1 for a current into the motor, −1 for a current out of
    /// it, and 0 for none. `both` says whether the switches conduct in both directions.
    pub fn is_carried_out(&self, lane: usize, time: f64, direction: f64, both: bool) -> bool {
        let to = self.to.of(lane);
        let matters = match to {
            Gate::Off => false,
            Gate::High => both || direction >= 0.0,
            Gate::Low => both || direction <= 0.0,
        };
        let carried_out = self.off.get(lane) <= time && self.done.get(lane) <= time;
        self.on.get(lane) <= time || carried_out && !matters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leg with a request for high at 0 and for low at 10 µs, with 0.3 µs to switch off and 2.2 µs to switch on.
    fn leg() -> LegGates<f64> {
        let mut leg = LegGates::new();
        leg.expect(0, Some((300.0, 2200.0, Gate::High)));
        leg.carry_out(0);
        leg.expect(0, Some((10_300.0, 12_200.0, Gate::Low)));
        leg
    }

    #[test]
    fn analytic_gates_come_after_the_dead_time() {
        let leg = leg();
        let gates: Vec<_> =
            [2199.0, 2200.0, 10_299.0, 10_300.0, 12_199.0, 12_200.0].map(|t| leg.of(0, t)).into();
        assert_eq!(gates, [Gate::Off, Gate::High, Gate::High, Gate::Off, Gate::Off, Gate::Low]);
        for time in [0.0, 2200.0, 5000.0, 10_300.0, 11_000.0, 12_200.0, 13_000.0] {
            let on = leg.at(time);
            assert_eq!(On { high: u32::from(on.high), low: u32::from(on.low) }.of(0), leg.of(0, time));
        }
    }

    #[test]
    fn analytic_only_edges_that_change_a_device_count() {
        let leg = leg();
        // A current out of the leg flows through the upper switch or the lower diode.
        assert_eq!(leg.next_edge(3000.0, true, false, false), 10_300.0);
        assert!(leg.carried_out(10_300.0, true, false, false), "the lower switch changes nothing");
        // A current into the leg flows through the upper diode until the lower switch turns on.
        assert_eq!(leg.next_edge(3000.0, false, true, false), 12_200.0);
        assert!(
            !leg.carried_out(10_300.0, false, true, false) && leg.carried_out(12_200.0, false, true, false)
        );
        // Where the lower switch conducts both ways, it takes the current over from the diode.
        assert_eq!(leg.next_edge(10_300.0, true, false, true), 12_200.0);
        assert!(!leg.carried_out(10_300.0, true, false, true) && !leg.is_carried_out(0, 10_300.0, 1.0, true));
        // Without current, all edges count.
        assert_eq!(leg.next_edge(0.0, false, false, false), 2200.0);
        assert_eq!(leg.next_edge(2200.0, false, false, false), 10_300.0);
        assert_eq!(leg.next_edge(10_300.0, false, false, false), 12_200.0);
    }
}
