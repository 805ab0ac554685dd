//! The gates of the three legs now, and the edges that are certain to come.

use standstill_interface::{Command, Nanos};
use standstill_inverter::{Conduction, Gate, GateTiming, Modes};

use crate::timeline::Timeline;

/// Edges of one leg that are known ahead: of three neighbouring edges at least one changes what conducts.
const ROOM: usize = 4;

/// Later than any instant.
pub const NEVER: f64 = f64::INFINITY;

/// An edge: when in ns, and what the gates do from then on.
pub type Edge = (f64, Gate);

#[derive(Clone, Copy, Debug)]
struct Leg {
    gate: Gate,
    /// Edges to come, in order of time.
    ahead: [Edge; ROOM],
    known: usize,
}

/// The gates of the three legs.
#[derive(Clone, Debug)]
pub struct Gates {
    timeline: Timeline,
    legs: [Leg; 3],
    /// No edge from here on is certain before the next command.
    end: Nanos,
}

/// Whether new gates of a leg change what it does: unless its current flows through the same device as before.
pub fn matters(mode: Conduction, gate: Gate) -> bool {
    let after = match mode.direction() {
        0.0 => return true,
        direction if direction > 0.0 => Conduction::outflow(gate),
        _ => Conduction::inflow(gate),
    };
    after != mode
}

impl Gates {
    /// All off.
    pub fn new(timings: [GateTiming; 3]) -> Self {
        let leg = Leg { gate: Gate::Off, ahead: [(NEVER, Gate::Off); ROOM], known: 0 };
        Self { timeline: Timeline::new(timings), legs: [leg; 3], end: Nanos::ZERO }
    }

    /// What the gates do now.
    pub fn now(&self) -> [Gate; 3] {
        self.legs.map(|leg| leg.gate)
    }

    /// Lays out the next command, which starts where the one before ended.
    pub fn begin(&mut self, command: &Command<f64>, start: Nanos, carrier: Nanos) {
        self.timeline.begin(command, start, carrier);
        self.end = start + command.duration();
    }

    /// What the legs are told just before a time of this command.
    pub fn told(&self, at: Nanos) -> [Gate; 3] {
        self.timeline.told(at)
    }

    /// The next edge in ns that changes what these modes conduct.
    pub fn next(&mut self, modes: Modes) -> f64 {
        let mut next = NEVER;
        for (k, mode) in modes.into_iter().enumerate() {
            next = next.min(self.next_of(k, mode));
        }
        next
    }

    fn next_of(&mut self, k: usize, mode: Conduction) -> f64 {
        let leg = &mut self.legs[k];
        let mut place = 0;
        loop {
            if place == leg.known {
                if leg.known == ROOM {
                    return leg.ahead[ROOM - 1].0;
                }
                let Some((at, gate)) = self.timeline.pop(k, self.end) else { return NEVER };
                leg.ahead[place] = (at.0 as f64, gate);
                leg.known += 1;
            }
            let (at, gate) = leg.ahead[place];
            if matters(mode, gate) {
                return at;
            }
            place += 1;
        }
    }

    /// The first known edge up to a time in ns: its leg and itself.
    pub fn due(&self, time: f64) -> Option<(usize, Edge)> {
        let mut first: Option<(usize, Edge)> = None;
        for (k, leg) in self.legs.iter().enumerate() {
            if leg.known > 0
                && leg.ahead[0].0 <= time
                && first.is_none_or(|(_, edge)| leg.ahead[0].0 < edge.0)
            {
                first = Some((k, leg.ahead[0]));
            }
        }
        first
    }

    /// Carries out the first known edge of a leg.
    pub fn take(&mut self, k: usize) {
        let leg = &mut self.legs[k];
        leg.gate = leg.ahead[0].1;
        leg.ahead.copy_within(1.., 0);
        leg.known -= 1;
    }
}
