//! From what a leg is told to what its gates do: delays and dead time.

use standstill_interface::Nanos;

/// Which switch of a leg is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Gate {
    /// Neither.
    #[default]
    Off,
    /// The lower.
    Low,
    /// The upper.
    High,
}

/// Timing of one leg's gates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateTiming {
    /// From the command to switch off to the switch being off.
    pub turn_off_delay: Nanos,
    /// From the end of the dead time to the switch being on.
    pub turn_on_delay: Nanos,
    /// Every switch-on waits this long, whatever the leg did before, as hardware dead-time generators do.
    pub dead_time: Nanos,
}

/// One leg's gate driver: requests in, gate edges out, in order of time.
#[derive(Clone, Debug, Default)]
pub struct GateDriver {
    timing: GateTiming,
    requested: Gate,
    gate: Gate,
    // At most an edge to Off and one to on for the latest request, and one pair still due from the one before.
    edges: [(Nanos, Gate); ROOM],
    // Where in the ring the next one is, and how many follow each other from there.
    first: usize,
    pending: usize,
}

/// A power of two, so that places in the ring need no division.
const ROOM: usize = 4;

impl GateDriver {
    /// A driver with both switches off.
    pub fn new(timing: GateTiming) -> Self {
        Self { timing, ..Self::default() }
    }

    /// What the gates do now.
    pub fn gate(&self) -> Gate {
        self.gate
    }

    /// What the leg was told last: with requests of the future if it was told ahead.
    pub fn requested(&self) -> Gate {
        self.requested
    }

    /// The next edge, if one is due.
    #[inline]
    pub fn next_edge(&self) -> Option<Nanos> {
        (self.pending > 0).then(|| self.edge(0).0)
    }

    /// The next edge, if it comes whatever the leg is told from `at` on: a request withdraws what is to come after
    /// its own switch-off.
    #[inline]
    pub fn next_certain_edge(&self, at: Nanos) -> Option<Nanos> {
        self.next_edge().filter(|edge| *edge < at + self.timing.turn_off_delay)
    }

    /// Tells the leg at time `at` what to do from now on. Later requests must not come with earlier times.
    #[inline]
    pub fn request(&mut self, at: Nanos, wanted: Gate) {
        if wanted == self.requested {
            return;
        }
        self.requested = wanted;
        let off_at = at + self.timing.turn_off_delay;
        // A switch-on that has not happened by then will not: a pulse shorter than the dead time is lost.
        while self.pending > 0 && self.edge(self.pending - 1).0 >= off_at {
            self.pending -= 1;
        }
        self.push(off_at, Gate::Off);
        if wanted != Gate::Off {
            // The other switch is off by then even where delays are unequal: no shoot-through.
            let on_at = (at + self.timing.dead_time + self.timing.turn_on_delay).max(off_at);
            self.push(on_at, wanted);
        }
    }

    fn push(&mut self, at: Nanos, gate: Gate) {
        // Requests so fast that four edges are pending at once are within one delay: only the last two matter.
        if self.pending == ROOM {
            self.drop_first();
            self.drop_first();
        }
        self.edges[(self.first + self.pending) % ROOM] = (at, gate);
        self.pending += 1;
    }

    /// The pending edge with this number.
    #[inline]
    fn edge(&self, number: usize) -> (Nanos, Gate) {
        self.edges[(self.first + number) % ROOM]
    }

    #[inline]
    fn drop_first(&mut self) {
        self.first = (self.first + 1) % ROOM;
        self.pending -= 1;
    }

    /// Carries out the edges due at `now`; true if the gates changed.
    #[inline]
    pub fn advance(&mut self, now: Nanos) -> bool {
        let before = self.gate;
        while self.pending > 0 && self.edge(0).0 <= now {
            self.gate = self.edge(0).1;
            self.drop_first();
        }
        before != self.gate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges(driver: &mut GateDriver) -> Vec<(u64, Gate)> {
        let mut seen = Vec::new();
        while let Some(at) = driver.next_edge() {
            if driver.advance(at) {
                seen.push((at.0, driver.gate()));
            }
        }
        seen
    }

    fn driver() -> GateDriver {
        GateDriver::new(GateTiming {
            turn_off_delay: Nanos(300),
            turn_on_delay: Nanos(200),
            dead_time: Nanos(2000),
        })
    }

    #[test]
    fn analytic_edges_come_after_delay_and_dead_time() {
        let mut leg = driver();
        leg.request(Nanos(0), Gate::High);
        assert_eq!(edges(&mut leg), [(2200, Gate::High)]);
        leg.request(Nanos(80_000), Gate::Low);
        assert_eq!(edges(&mut leg), [(80_300, Gate::Off), (82_200, Gate::Low)]);
        leg.request(Nanos(90_000), Gate::Off);
        assert_eq!(edges(&mut leg), [(90_300, Gate::Off)]);
    }

    #[test]
    fn law_a_pulse_shorter_than_the_dead_time_is_lost() {
        let mut leg = driver();
        leg.request(Nanos(0), Gate::Low);
        edges(&mut leg);
        leg.request(Nanos(10_000), Gate::High);
        leg.request(Nanos(11_500), Gate::Low);
        assert_eq!(edges(&mut leg), [(10_300, Gate::Off), (13_700, Gate::Low)]);
    }

    #[test]
    fn law_high_and_low_are_always_separated_by_off() {
        for (off, on, dead) in [(300, 0, 0), (0, 0, 0), (500, 100, 2000), (900, 0, 100)] {
            let timing =
                GateTiming { turn_off_delay: Nanos(off), turn_on_delay: Nanos(on), dead_time: Nanos(dead) };
            let mut leg = GateDriver::new(timing);
            let mut last = Gate::Off;
            for step in 0..200_u64 {
                let wanted = [Gate::High, Gate::Low, Gate::Off][(step * step % 7 % 3) as usize];
                leg.request(Nanos(step * 731), wanted);
                while leg.next_edge().is_some_and(|at| at.0 < (step + 1) * 731) {
                    let at = leg.next_edge().unwrap_or_default();
                    // One edge at a time: two at the same instant would hide the Off between them.
                    let due = leg.edge(0).1;
                    assert!(last == Gate::Off || due == Gate::Off || last == due, "{last:?} to {due:?}");
                    last = due;
                    leg.gate = due;
                    leg.drop_first();
                    assert!(at.0 >= 731 * step.saturating_sub(5));
                }
            }
        }
    }
}
