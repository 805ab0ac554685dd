//! Anatomy of an event: the draws that the starts in which the event happened have in common.
//!
//! Means are taken per sector of rotor angles and per sign of the error. Over all angles the draws of a symmetric event average to zero: a
//! gain that is too large turns the estimated axis forwards at one angle and backwards at another.

use std::collections::BTreeMap;

use standstill_numeric::whole;
use standstill_scenario::{FaultSettings, FileError, Record};
use standstill_sim::{Purpose, Tape};

use crate::{Event, Halt, Trials, Watch};

/// Least magnitude of a random draw's mean, in standard deviations of the draw. Draws with a smaller mean are not listed.
const LEAST_MEAN: f64 = 0.5;

/// Least number of simulated motor starts in a sector. Sectors with fewer starts are not listed.
const LEAST_STATES: usize = 20;
/// Least share of the event's probability in a sector. Sectors with a smaller share are not listed.
const LEAST_SHARE: f64 = 0.02;

/// Rotor angles and random draws of the simulated motor starts in which an event happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Anatomy {
    /// Sectors of the rotor angle in which the event happened in at least 20 starts, sorted by their share of the event's probability, the
    /// largest first.
    pub sectors: Vec<Sector>,
    /// Random draws of a typical start. It is the start in the sector with the largest share whose draws are nearest to the sector's means.
    /// None if no sector has enough starts.
    pub typical: Option<Tape>,
}

/// Starts in which the event happened, with rotor angles in one range and axis errors of one sign.
#[derive(Clone, Debug, PartialEq)]
pub struct Sector {
    /// Lower and upper limit of the electrical rotor angle in degrees. If the event is an axis error, the angle is taken modulo 180°.
    pub angles_deg: (f64, f64),
    /// True for a positive axis error, false for a negative one; none for events other than an axis error.
    pub positive: Option<bool>,
    /// Share of the event's probability in this sector.
    pub share: f64,
    /// Random draws whose mean over these starts is at least half a standard deviation away from zero, the largest mean first.
    pub draws: Vec<Draw>,
}

/// Statistics of a random draw over the starts in which the event happened, in standard deviations of the draw's own distribution.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Name of the random draw, such as `gain of b`.
    pub name: String,
    /// Mean over the starts in which the event happened. The mean over all starts is zero.
    pub mean: f64,
    /// Standard deviation over the starts in which the event happened. The standard deviation over all starts is 1.
    pub deviation: f64,
}

/// Key of a random draw: its purpose, its name and its index.
type Place = (u32, String, usize);

/// Sums over the starts of a sector. Each draw has three sums: of the weights, of the weighted values and of the weighted squares.
#[derive(Debug, Default)]
struct Sums {
    share: f64,
    members: Vec<usize>,
    draws: BTreeMap<Place, (Purpose, [f64; 3])>,
}

impl Anatomy {
    /// Computes the anatomy of an event from starts in which the event happened. `failures` has two values for each of these starts: its
    /// share of the event's probability, and its random draws.
    ///
    /// # Errors
    /// A drawn value is invalid, or the computation was interrupted.
    pub fn of(
        trials: &Trials<'_>,
        event: Event,
        failures: &[(f64, Tape)],
        watch: &dyn Watch,
    ) -> Result<Self, Halt<FileError>> {
        let records = trials.all_records(failures.iter().map(|(_, tape)| tape.clone()).collect(), watch)?;
        let mut sums: BTreeMap<(usize, Option<bool>), Sums> = BTreeMap::new();
        for (number, ((weight, tape), record)) in failures.iter().zip(&records).enumerate() {
            sums.entry(class(event, record)).or_default().add(number, *weight, tape);
        }
        let enough = |sums: &Sums| sums.members.len() >= LEAST_STATES && sums.share >= LEAST_SHARE;
        let mut sectors: Vec<((usize, Option<bool>), Sums)> =
            sums.into_iter().filter(|(_, sums)| enough(sums)).collect();
        sectors.sort_by(|(_, a), (_, b)| b.share.total_cmp(&a.share));
        let typical = sectors.first().and_then(|(_, sums)| sums.typical(failures));
        let faults = &trials.scenario().faults;
        let sector = |((number, positive), sums): &((usize, Option<bool>), Sums)| {
            let from = *number as f64 * width(event);
            let angles_deg = (from, from + width(event));
            Sector {
                angles_deg,
                positive: *positive,
                share: sums.share,
                draws: sums.means_away_from_zero(faults),
            }
        };
        Ok(Self { sectors: sectors.iter().map(sector).collect(), typical })
    }
}

/// Returns the width of a sector in degrees.
const fn width(event: Event) -> f64 {
    match event {
        Event::Error(_) => 15.0,
        _ => 30.0,
    }
}

/// Returns the class of a start: the index of the sector that contains its rotor angle, and whether its axis error is positive. Events
/// other than an axis error have no sign. For an axis error, the angle is taken modulo 180°.
fn class(event: Event, record: &Record) -> (usize, Option<bool>) {
    let (turn, positive) = match event {
        Event::Error(_) => (180.0, record.axis_error_deg().map(|error| error > 0.0)),
        _ => (360.0, None),
    };
    let angle = record.start_angle_deg().rem_euclid(turn);
    // At most 24.
    (whole(angle / width(event)), positive)
}

/// Returns true for draws that the anatomy lists. It does not list the rotor angle, because the sector states it. Nor does it list other
/// angles (phase of the ripple, direction of the last magnetisation), or draws that are no errors (order of a design, seed of a detector).
fn is_told(purpose: Purpose) -> bool {
    !matches!(
        purpose,
        Purpose::Angle | Purpose::Ripple | Purpose::Memory | Purpose::Design | Purpose::Detector
    )
}

impl Sums {
    fn add(&mut self, number: usize, weight: f64, tape: &Tape) {
        self.share += weight;
        self.members.push(number);
        for strip in tape.clone().strips().iter().filter(|strip| is_told(strip.purpose)) {
            for (k, x) in strip.normals.iter().enumerate() {
                let place = (strip.purpose as u32, strip.name.clone(), k);
                let (_, sums) = self.draws.entry(place).or_insert((strip.purpose, [0.0; 3]));
                *sums = [sums[0] + weight, sums[1] + weight * x, sums[2] + weight * x * x];
            }
        }
    }

    fn means(&self) -> impl Iterator<Item = (&Place, Purpose, f64, f64)> {
        // Draws that less than half of the starts' weight has are left out.
        let common = self.draws.iter().filter(|(_, (_, sums))| sums[0] > 0.5 * self.share);
        common.map(|(place, (purpose, [weight, sum, squares]))| {
            let mean = sum / weight;
            (place, *purpose, mean, (squares / weight - mean * mean).max(0.0).sqrt())
        })
    }

    fn means_away_from_zero(&self, faults: &[FaultSettings]) -> Vec<Draw> {
        let far = self.means().filter(|(_, _, mean, _)| mean.abs() >= LEAST_MEAN);
        let mut draws: Vec<Draw> = far
            .map(|(place, purpose, mean, deviation)| Draw {
                name: name(purpose, &place.1, place.2, faults),
                mean,
                deviation,
            })
            .collect();
        draws.sort_by(|a, b| b.mean.abs().total_cmp(&a.mean.abs()));
        draws
    }

    /// Returns the tape of the start whose draws are nearest to the sector's means. The distance counts only draws whose mean differs from
    /// zero by at least half a standard deviation.
    fn typical(&self, failures: &[(f64, Tape)]) -> Option<Tape> {
        let far: BTreeMap<&Place, f64> = self
            .means()
            .filter(|(_, _, mean, _)| mean.abs() >= LEAST_MEAN)
            .map(|(place, _, mean, _)| (place, mean))
            .collect();
        let distance = |number: &usize| {
            let mut tape = failures[*number].1.clone();
            let mut sum = 0.0;
            for strip in tape.strips() {
                for (k, x) in strip.normals.iter().enumerate() {
                    let place = (strip.purpose as u32, strip.name.clone(), k);
                    sum += far.get(&place).map_or(0.0, |mean| (x - mean) * (x - mean));
                }
            }
            sum
        };
        let nearest = self.members.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|number| failures[*number].1.clone())
    }
}

/// Returns the name of a random draw in words, such as `gain of b`. `number` is the draw's index among the draws of its purpose. `faults`
/// are the scenario's faults.
pub(crate) fn name(purpose: Purpose, key: &str, number: usize, faults: &[FaultSettings]) -> String {
    let phase = |number: usize| ["a", "b", "c"][number % 3];
    match purpose {
        Purpose::CurrentGain => format!("gain of {}", phase(number)),
        Purpose::CurrentOffset => format!("offset of {}", phase(number)),
        Purpose::CurrentNoise => format!("noise of {} in sample {}", phase(number), number / 3 + 1),
        Purpose::LinkError if number == 0 => "gain of the DC link".to_owned(),
        Purpose::LinkError => "offset of the DC link".to_owned(),
        Purpose::LinkNoise => format!("noise of the DC link in sample {}", number + 1),
        Purpose::Bandwidth if number == 0 => "bandwidth of all sensors".to_owned(),
        Purpose::Bandwidth => format!("bandwidth of {}", phase(number - 1)),
        Purpose::Jitter => format!("jitter of sample {}", number + 1),
        Purpose::GateDelay if number.is_multiple_of(2) => {
            format!("switch-off delay of {}", phase(number / 2))
        }
        Purpose::GateDelay => format!("switch-on delay of {}", phase(number / 2)),
        Purpose::TerminalGain => format!("gain of the divider of {}", phase(number)),
        Purpose::TerminalOffset => format!("offset of the divider of {}", phase(number)),
        Purpose::TerminalNoise => {
            format!("noise of the terminal of {} in sample {}", phase(number), number / 3 + 1)
        }
        Purpose::ComparatorOffset => format!("offset of comparator {}", number + 1),
        Purpose::ComparatorDelay => format!("delay of comparator {}", number + 1),
        Purpose::CaptureTimer if number == 0 => "clock of the timer".to_owned(),
        Purpose::CaptureTimer => "phase of the timer".to_owned(),
        Purpose::ComparatorNoise => format!("noise of threshold {}", number + 1),
        Purpose::Fault => {
            let mut all = faults
                .iter()
                .enumerate()
                .flat_map(|(k, fault)| fault.draws().map(move |draw| (draw.name(), k)));
            let (draw, k) = all.nth(number).unwrap_or(("a draw", faults.len()));
            format!("{draw} of fault {k}")
        }
        Purpose::Resolver => "resolver".to_owned(),
        Purpose::Backlash => "place within the brake's play".to_owned(),
        Purpose::Tolerance => key.to_owned(),
        Purpose::Angle | Purpose::Ripple | Purpose::Memory | Purpose::Design | Purpose::Detector => {
            format!("{purpose:?} {number}")
        }
    }
}
