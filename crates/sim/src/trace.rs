//! Observers of a run, which receive all waveforms and events.

use std::fmt;

use standstill_interface::{Phase, Reading};
use standstill_inverter::{Conduction, Gate, Modes};

use crate::faults::Broken;
use crate::physics::motion::Motion;

/// Snapshot of the machine at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// Time in s since the start of the run.
    pub time: f64,
    /// Phase currents in A into the winding; their sum is zero.
    pub current: [f64; 3],
    /// Terminal potentials in V against the negative rail.
    pub potential: [f64; 3],
    /// Voltage of the DC link in V.
    pub dc_link: f64,
    /// Electrical angle θ in rad, not wrapped.
    pub angle: f64,
    /// Electrical speed in rad/s.
    pub speed: f64,
    /// Electromagnetic torque in N·m, cogging included.
    pub torque: f64,
    /// Conduction mode of each leg.
    pub modes: Modes,
    /// State of the comparators. None for a drive without comparators.
    pub comparator: Option<ComparatorState>,
}

/// State of a drive's comparators at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparatorState {
    /// No comparator can trip, because no threshold is set.
    Idle,
    /// The comparators are ignored during the blanking time, which follows the beginning of a stage.
    Blanked,
    /// A comparator trips as soon as its current reaches the threshold.
    Watching,
    /// A comparator has tripped during this command.
    Tripped,
}

impl fmt::Display for ComparatorState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "idle",
            Self::Blanked => "blanked",
            Self::Watching => "watching",
            Self::Tripped => "tripped",
        })
    }
}

impl Snapshot {
    /// Returns the current in A from the DC link into the bridge. It is the sum of the currents of the legs whose upper device conducts.
    /// A shunt between link capacitor and bridge carries this current, and a comparator for the link monitors it.
    ///
    /// ```
    /// use standstill_inverter::Conduction::{LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
    /// # let now = standstill_sim::Snapshot {
    /// #     time: 0.0,
    /// #     current: [2.0, -1.5, -0.5],
    /// #     potential: [550.0, 0.0, 0.0],
    /// #     dc_link: 550.0,
    /// #     angle: 0.0,
    /// #     speed: 0.0,
    /// #     torque: 0.0,
    /// #     modes: [UpperSwitch, LowerSwitch, LowerSwitch],
    /// #     comparator: None,
    /// # };
    /// assert_eq!(now.link_current(), 2.0);
    /// // All switches open: diodes return the current.
    /// let off = standstill_sim::Snapshot { modes: [LowerDiode, UpperDiode, UpperDiode], ..now };
    /// assert_eq!(off.link_current(), -2.0);
    /// ```
    pub fn link_current(&self) -> f64 {
        (0..3).filter(|k| self.modes[*k].is_upper()).map(|k| self.current[k]).sum()
    }

    /// Returns the current in A through each leg's devices, positive towards the motor. For a conducting leg it is the phase current; the
    /// small current that charges the terminal's capacitance is neglected. For a leg without a conducting device it is zero, and a phase
    /// current there charges the terminal's capacitance.
    ///
    /// ```
    /// use standstill_inverter::Conduction::{Blocked, LowerSwitch, UpperSwitch};
    /// use standstill_sim::Snapshot;
    ///
    /// // The open leg's terminal has a capacitance, which swings.
    /// let now = Snapshot {
    ///     time: 0.0,
    ///     current: [2.0, -1.5, -0.5],
    ///     potential: [550.0, 0.0, 240.0],
    ///     dc_link: 550.0,
    ///     angle: 0.0,
    ///     speed: 0.0,
    ///     torque: 0.0,
    ///     modes: [UpperSwitch, LowerSwitch, Blocked],
    ///     comparator: None,
    /// };
    /// assert_eq!(now.leg_current(), [2.0, -1.5, 0.0]);
    /// ```
    pub fn leg_current(&self) -> [f64; 3] {
        std::array::from_fn(|k| if self.modes[k] == Conduction::Blocked { 0.0 } else { self.current[k] })
    }
}

/// State of a part of the drive or motor after a fault has begun or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// The part has broken.
    Broken,
    /// The part works again.
    Whole,
}

/// An event at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The detector gave a command.
    Command,
    /// The gates of this leg changed to this state.
    Gate(Phase, Gate),
    /// This leg changed to this conduction mode.
    Conduction(Phase, Conduction),
    /// The rotor began to move, stopped, or reached an end of the brake's play. The value is its new state of motion.
    Motion(Motion),
    /// The currents left the range of the motor's flux map. The run ends.
    LeftMap,
    /// A comparator of this phase tripped. Phase a also stands for the comparator in the DC link.
    Trip(Phase),
    /// This part broke or works again.
    Fault(Broken, Health),
    /// The drive took a sample and obtained this reading.
    Sample(Reading<f64>),
}

/// An observer that receives snapshots and events of a run.
pub trait Probe {
    /// Returns the longest time in s between two snapshots. None if the observer needs no snapshots; then the run computes none.
    fn resolution(&self) -> Option<f64>;
    /// Returns whether the observer uses snapshots or events. If it uses neither, the run does not prepare them and takes no longer.
    fn watches(&self) -> bool {
        true
    }
    /// Receives one snapshot. At an instant with a change there are two snapshots with the same time: one before and one after the
    /// change.
    fn snapshot(&mut self, snapshot: &Snapshot);
    /// Receives one event and its time in s.
    fn event(&mut self, time: f64, event: Event);
}

/// An observer that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    fn resolution(&self) -> Option<f64> {
        None
    }
    fn watches(&self) -> bool {
        false
    }
    fn snapshot(&mut self, _: &Snapshot) {}
    fn event(&mut self, _: f64, _: Event) {}
}

/// An observer that stores all snapshots and events.
#[derive(Clone, Debug)]
pub struct Trace {
    resolution: f64,
    /// Snapshots in order of time.
    pub snapshots: Vec<Snapshot>,
    /// Events in order of time, each with its time in s.
    pub events: Vec<(f64, Event)>,
    /// Channels and log of the user's detector.
    pub own: Own,
}

/// Channels and log of a user's detector during a run. All times are in s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Own {
    /// Names of the channels.
    pub names: Vec<String>,
    /// Values of all channels after each step of the detector, each row with its time.
    pub rows: Vec<(f64, Vec<f64>)>,
    /// Lines of the log, each with its time.
    pub log: Vec<(f64, String)>,
}

impl Trace {
    /// Makes an observer with snapshots at most `resolution` seconds apart.
    ///
    /// ```
    /// use standstill_sim::{Event, Probe, Trace};
    ///
    /// let mut trace = Trace::new(5e-6);
    /// assert_eq!(trace.resolution(), Some(5e-6));
    /// trace.event(1e-3, Event::Command);
    /// assert_eq!(trace.events, [(1e-3, Event::Command)]);
    /// ```
    pub fn new(resolution: f64) -> Self {
        Self { resolution, snapshots: Vec::new(), events: Vec::new(), own: Own::default() }
    }
}

impl Probe for Trace {
    fn resolution(&self) -> Option<f64> {
        Some(self.resolution)
    }

    fn snapshot(&mut self, snapshot: &Snapshot) {
        // Two equal snapshots in a row, as at a sample, count as one.
        if self.snapshots.last() != Some(snapshot) {
            self.snapshots.push(*snapshot);
        }
    }

    fn event(&mut self, time: f64, event: Event) {
        self.events.push((time, event));
    }
}
