//! Faults of wires, switches and sensors: which part is broken, and when.
//!
//! A fault acts only where its part is simulated: an open wire in the equations of the legs, a switch that stays off in
//! the gates, a sensor that reads wrongly in its channel. The detector sees only the consequences.

use std::fmt;

use standstill_interface::Nanos;
use standstill_inverter::Gate;
use standstill_plant::Motor;

use crate::trace::Health;

/// Largest number of faults of a case.
pub const MOST_FAULTS: usize = 4;

/// A broken part. Legs, wires and phases are numbered from 0 for a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Broken {
    /// The wire from this leg's terminal to the winding is open. A current that flows when the wire breaks ends at once: the duration
    /// of the arc is not modelled.
    Wire(usize),
    /// A resistance in Ω in series with a phase, as of a weak contact in the motor's terminal box.
    Contact(usize, f64),
    /// Turns of a phase of the motor are shorted. They stay shorted.
    Shorted(usize, Short),
    /// Motor wires are exchanged: leg k feeds the phase whose number is element k. Possible only from the start of the run on.
    Wires([usize; 3]),
    /// This switch of a leg never turns on; [`Gate::Off`] stands for both switches. The diodes still work.
    Switch(usize, Gate),
    /// The sensor in this channel reads wrongly. Channels 0 to 2 are the phases (0 also the shunt in the DC link), 3 is
    /// the link's voltage.
    Sensor(usize, Misreading),
    /// Two current sensors are exchanged, so that each measures the phase of the other sensor.
    Exchanged(usize, usize),
    /// The reference voltage that all converters share drifts: readings grow by this share per second.
    Drift(f64),
    /// All comparators fail to trip.
    Deaf,
    /// The converter repeats the result of the previous sample.
    Stale,
    /// Commands reach the gates with this delay, while samples are taken at their commanded times.
    Late(Nanos),
    /// Duty cycles are limited to this share.
    Duty(f64),
}

/// A short between turns of a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Short {
    /// Share of the phase's turns that are shorted, above 0 and at most 1.
    pub share: f64,
    /// Resistance of the fault in Ω, zero or more.
    pub resistance: f64,
    /// Coupling factor between the shorted turns and their phase, above 0 and below 1.
    pub coupling: f64,
}

impl Short {
    /// Returns the leakage inductance L_l in H of the shorted turns: their self-inductance less the part that links the flux of the core
    /// (formula in `effect/shorted.rs`).
    pub(crate) fn leakage(&self, motor: &Motor) -> f64 {
        let winding = &motor.winding;
        let phase = winding.mean_inductance + winding.leakage;
        let mean = 1.5 * winding.mean_inductance + winding.leakage;
        self.share * self.share * (phase / (self.coupling * self.coupling) - 2.0 / 3.0 * mean)
    }

    /// Returns the time constant in s with which the current of the shorted turns settles while the flux of their phase is constant.
    pub fn time_constant(&self, motor: &Motor) -> f64 {
        self.leakage(motor) / (self.share * motor.resistance + self.resistance)
    }

    /// Returns the resistance of the fault in Ω that gives the shorted turns of a motor the time constant `constant` in s. Negative if the
    /// time constant without this resistance is already shorter.
    pub fn resistance_of(&self, motor: &Motor, constant: f64) -> f64 {
        self.leakage(motor) / constant - self.share * motor.resistance
    }
}

/// Kind of a sensor's wrong reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misreading {
    /// The amplifier's output is zero, apart from its offset.
    Dead,
    /// The sensor repeats its last value from before the fault. Without such a value, it repeats its first value.
    Frozen,
    /// The sensor reads this value in A or V, rounded by its converter.
    Stuck(f64),
    /// One bit of the converter's codes, counted from 0 for the lowest, is always set or always clear.
    Bit(u8, bool),
    /// The gain is multiplied by this factor.
    Gain(f64),
    /// The offset is larger by this value in A or V.
    Offset(f64),
}

/// A part that is broken from `from` until just before `until`. Both times count from the start of the run, or from the
/// begin of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// The broken part.
    pub broken: Broken,
    /// Number (from 1) of the command whose begin is the zero of both times. None if the start of the run is their zero.
    pub command: Option<u32>,
    /// Time at which the part breaks.
    pub from: Nanos,
    /// Time at which the part works again; `Nanos(u64::MAX)` for never.
    pub until: Nanos,
}

impl Fault {
    /// Makes a fault that exists before the run begins and never ends.
    pub const fn lasting(broken: Broken) -> Self {
        Self { broken, command: None, from: Nanos::ZERO, until: Nanos(u64::MAX) }
    }

    /// Returns whether the part is broken at a time in ns.
    pub(crate) fn is_there(&self, time: f64) -> bool {
        self.command.is_none() && self.from.0 as f64 <= time && time < self.until.0 as f64
    }
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let phase = |k: usize| ["a", "b", "c"].get(k).copied().unwrap_or("?");
        match *self {
            Self::Wire(k) => write!(f, "wire to phase {} open", phase(k)),
            Self::Contact(k, ohms) => write!(f, "{ohms:.4} Ω in series with phase {}", phase(k)),
            Self::Shorted(k, Short { share, resistance, coupling }) => write!(
                f,
                "{:.2} % of the turns of phase {} shorted by {} Ω, coupling {coupling:.3}",
                share * 100.0,
                phase(k),
                significant(resistance)
            ),
            Self::Wires(wires) => write!(f, "legs a, b, c feed phases {}", wires.map(phase).join(", ")),
            Self::Switch(k, Gate::High) => write!(f, "upper switch of leg {} stays off", phase(k)),
            Self::Switch(k, Gate::Low) => write!(f, "lower switch of leg {} stays off", phase(k)),
            Self::Switch(k, Gate::Off) => write!(f, "leg {} stays off", phase(k)),
            Self::Sensor(3, how) => write!(f, "link's sensor {how}"),
            Self::Sensor(k, how) => write!(f, "current sensor {} {how}", phase(k)),
            Self::Exchanged(a, b) => write!(f, "current sensors {} and {} exchanged", phase(a), phase(b)),
            Self::Drift(rate) => write!(f, "readings drift by {:+.1} % a second", rate * 100.0),
            Self::Deaf => f.write_str("no comparator trips"),
            Self::Stale => f.write_str("readings are those of the sample before"),
            Self::Late(late) => write!(f, "commands late by {:.1} µs", late.seconds() * 1e6),
            Self::Duty(most) => write!(f, "duty cycles at most {:.1} %", most * 100.0),
        }
    }
}

/// Formats a number of zero or more with four significant digits; one below 1e-4 or from 1e6 on with its power of ten.
fn significant(number: f64) -> String {
    let text = format!("{number:.3e}");
    match text.split_once('e').and_then(|(_, power)| power.parse().ok()) {
        _ if number == 0.0 => "0".to_owned(),
        Some(power @ -4..6_i32) => format!("{number:.*}", usize::try_from(3 - power).unwrap_or(0)),
        _ => text,
    }
}

impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Dead => f.write_str("dead"),
            Self::Frozen => f.write_str("frozen"),
            Self::Stuck(value) => write!(f, "stuck at {value:.4}"),
            Self::Bit(bit, true) => write!(f, "has bit {bit} always set"),
            Self::Bit(bit, false) => write!(f, "has bit {bit} always clear"),
            Self::Gain(factor) => write!(f, "has {factor:.4} times its gain"),
            Self::Offset(more) => write!(f, "is off by {more:+.4}"),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.broken)?;
        if let Some(command) = self.command {
            write!(f, ", from command {command} on")?;
        }
        if self.from > Nanos::ZERO {
            write!(f, ", from {:.3} ms", self.from.seconds() * 1e3)?;
        }
        if self.until != Nanos(u64::MAX) {
            write!(f, ", until {:.3} ms", self.until.seconds() * 1e3)?;
        }
        Ok(())
    }
}

/// The faults of a case, at most [`MOST_FAULTS`].
///
/// ```
/// use standstill_interface::Nanos;
/// use standstill_sim::{Broken, Fault, Faults};
///
/// let mut faults = Faults::default();
/// faults.push(Fault { from: Nanos(1000), until: Nanos(51_000), ..Fault::lasting(Broken::Wire(1)) });
/// assert_eq!(faults.at(0.0).count(), 0);
/// assert_eq!(faults.at(1000.0).next(), Some(Broken::Wire(1)));
/// // It breaks at 1 µs, and is whole again at 51 µs.
/// assert_eq!([faults.next(0.0), faults.next(1000.0), faults.next(51_000.0)], [1000.0, 51_000.0, f64::INFINITY]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults([Option<Fault>; MOST_FAULTS]);

impl Faults {
    /// Adds a fault. Returns false if there are [`MOST_FAULTS`] already.
    pub fn push(&mut self, fault: Fault) -> bool {
        let Some(free) = self.0.iter_mut().find(|place| place.is_none()) else { return false };
        *free = Some(fault);
        true
    }

    /// Returns whether nothing is broken.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// Iterates over all faults.
    pub fn iter(&self) -> impl Iterator<Item = Fault> {
        self.0.into_iter().flatten()
    }

    /// Iterates over the parts that are broken at a time in ns.
    pub fn at(&self, time: f64) -> impl Iterator<Item = Broken> {
        self.0.into_iter().flatten().filter(move |fault| fault.is_there(time)).map(|fault| fault.broken)
    }

    /// Returns the next time in ns after `time` at which a part breaks or works again; infinite if there is none.
    pub fn next(&self, time: f64) -> f64 {
        self.iter()
            .filter(|fault| fault.command.is_none())
            .flat_map(|fault| [fault.from, fault.until])
            .filter(|at| at.0 != u64::MAX && at.0 as f64 > time)
            .map(|at| at.0 as f64)
            .fold(f64::INFINITY, f64::min)
    }

    /// Iterates over the parts that break at a time in ns, and over the parts that work again.
    pub(crate) fn changes(&self, time: f64) -> impl Iterator<Item = (Broken, Health)> {
        let changes = |fault: Fault| {
            [(fault.from, Health::Broken), (fault.until, Health::Whole)].map(|of| (fault.broken, of))
        };
        let all = self.iter().filter(|fault| fault.command.is_none()).flat_map(changes);
        all.filter(move |(_, (at, _))| at.0 as f64 == time).map(|(broken, (_, health))| (broken, health))
    }

    /// Starts the faults whose times count from the begin of the command with this number. Returns whether there are
    /// any.
    pub(crate) fn begin(&mut self, command: u32, start: Nanos) -> bool {
        let mut any = false;
        for fault in self.0.iter_mut().flatten().filter(|fault| fault.command == Some(command)) {
            let until = if fault.until == Nanos(u64::MAX) { fault.until } else { start + fault.until };
            *fault = Fault { command: None, from: start + fault.from, until, ..*fault };
            any = true;
        }
        any
    }

    /// Returns the delay with which a command given at a time in ns reaches the gates.
    pub(crate) fn late(&self, time: f64) -> Nanos {
        let of = |broken| if let Broken::Late(late) = broken { late } else { Nanos::ZERO };
        self.at(time).map(of).fold(Nanos::ZERO, Nanos::max)
    }

    /// Returns the largest duty cycle at a time in ns.
    pub(crate) fn most_duty(&self, time: f64) -> f64 {
        self.at(time)
            .map(|broken| if let Broken::Duty(most) = broken { most } else { 1.0 })
            .fold(1.0, f64::min)
    }

    /// Returns the phase (0 for a) and the data of the turns that are shorted at a time in ns; none if no turns are shorted.
    pub(crate) fn short(&self, time: f64) -> Option<(usize, Short)> {
        self.at(time)
            .find_map(|broken| if let Broken::Shorted(k, short) = broken { Some((k, short)) } else { None })
    }

    /// Returns whether turns are shorted at any time.
    pub(crate) fn short_turns(&self) -> bool {
        self.iter().any(|fault| matches!(fault.broken, Broken::Shorted(..)))
    }

    /// Returns the number of the phase that each leg feeds: [0, 1, 2] unless wires are exchanged.
    pub(crate) fn wires(&self) -> [usize; 3] {
        let exchanged = self.iter().find_map(|fault| match fault.broken {
            Broken::Wires(wires) => Some(wires),
            _ => None,
        });
        exchanged.unwrap_or([0, 1, 2])
    }

    /// Returns whether the lower and the upper switch of a leg fail to turn on at a time in ns. Both count as failed if
    /// the leg's wire is open, because they have no effect behind it.
    pub(crate) fn lost(&self, leg: usize, time: f64) -> [bool; 2] {
        let mut lost = [false; 2];
        for broken in self.at(time) {
            match broken {
                Broken::Wire(k) if k == leg => lost = [true; 2],
                Broken::Switch(k, gate) if k == leg => {
                    lost[0] |= gate != Gate::High;
                    lost[1] |= gate != Gate::Low;
                }
                _ => {}
            }
        }
        lost
    }

    /// Returns whether a fault may keep the gates of a leg from following their requests.
    pub(crate) fn concern_gates(&self, leg: usize) -> bool {
        self.iter().any(|fault| matches!(fault.broken, Broken::Wire(k) | Broken::Switch(k, _) if k == leg))
    }

    /// Returns for each leg whether its wire is open at a time in ns.
    pub(crate) fn open(&self, time: f64) -> [bool; 3] {
        let mut open = [false; 3];
        for broken in self.at(time) {
            if let Broken::Wire(k) = broken {
                open[k] = true;
            }
        }
        open
    }

    /// Returns the added series resistance in Ω of each phase at a time in ns ([`Broken::Contact`]).
    pub(crate) fn contacts(&self, time: f64) -> [f64; 3] {
        let mut contacts = [0.0; 3];
        for broken in self.at(time) {
            if let Broken::Contact(k, resistance) = broken {
                contacts[k] += resistance;
            }
        }
        contacts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_short_is_printed_with_all_that_was_drawn() {
        for (resistance, expected) in [
            (0.0, "0"),
            (2.3456e-6, "2.346e-6"),
            (0.012_344, "0.01234"),
            (3.456_78, "3.457"),
            (9876.4, "9876"),
            (2e6, "2.000e6"),
        ] {
            let short = Broken::Shorted(1, Short { share: 0.0512, resistance, coupling: 0.87654 });
            let printed = format!("5.12 % of the turns of phase b shorted by {expected} Ω, coupling 0.877");
            assert_eq!(short.to_string(), printed);
        }
    }
}
