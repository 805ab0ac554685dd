//! Margins by which demands are met.

use std::cmp::Ordering;
use std::fmt;

use standstill_interface::choice;
use standstill_scenario::Rotor;

use super::Demands;
use super::starts::{COMFORTABLE, Starts};

choice! {
    /// The demands that a start makes on a detection.
    pub enum Demand {
        /// Error of the axis.
        Error = "error",
        /// Movement of a free rotor.
        Movement = "movement",
        /// Largest phase current.
        Current = "current",
        /// Time of a detection.
        Time = "time",
        /// Evidence for the right pole that 99 of 100 starts must exceed.
        Pole = "pole",
        /// Share of starts that end with an angle.
        Answers = "answers",
    }
}

impl fmt::Display for Demand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "the error of the axis",
            Self::Movement => "the free rotor's movement",
            Self::Current => "the current",
            Self::Time => "the time",
            Self::Pole => "the evidence for the pole",
            Self::Answers => "starts without an angle",
        })
    }
}

/// Margins by which the demands are met, as ratios of the allowed to the actual value. A demand with a margin of 1 is just met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Allowed error divided by the 95th percentile of the error. Infinite if this percentile is zero. If a method finds only a sector of
    /// angles, the error is measured from the border of the sector.
    pub error: f64,
    /// Allowed movement divided by the largest movement. Infinite if the rotor is not free.
    pub movement: f64,
    /// Allowed current divided by the largest current.
    pub current: f64,
    /// Allowed time divided by the time of the longest detection.
    pub time: f64,
    /// Evidence for the true pole that 99 of 100 starts reach, in units of the evidence that a decision needs. None if poles are not
    /// judged.
    pub pole: Option<f64>,
    /// 1 if enough starts end with an angle, else 0.
    pub answers: f64,
}

/// Margin of the movement that settings need in the search. It exceeds 1 because the largest movement in many fresh starts exceeds that in
/// few.
const ROOM_FOR_MOVEMENT: f64 = 1.1;
/// Margin of the current that settings need in the search. It exceeds 1 because the largest current in many fresh starts exceeds that in
/// few.
const ROOM_FOR_CURRENT: f64 = 1.005;
/// Margin of the pole evidence that settings need in the search. It is below 1 because more starts may show that the evidence suffices.
const ROOM_OF_POLE: f64 = 0.93;

impl Margins {
    pub(super) fn of(starts: &[&Starts], demands: &Demands, most_current: f64, has_pole: bool) -> Self {
        let worst = |of: &dyn Fn(&Starts) -> f64| {
            starts.iter().map(|starts| of(starts)).fold(f64::INFINITY, f64::min)
        };
        let no_less = |value: f64| if value.is_nan() { 0.0 } else { value };
        let share = |count: u64, starts: &Starts| {
            count as f64 <= demands.without_angle * starts.summary.trials as f64
        };
        Self {
            error: worst(&|starts| no_less(demands.error_deg / starts.summary.p95_deg.value)),
            movement: worst(&|starts| match starts.rotor {
                Rotor::Free => demands.movement_deg / starts.summary.max_moved_deg,
                _ => f64::INFINITY,
            }),
            current: worst(&|starts| most_current / starts.summary.peak_current_a),
            time: worst(&|starts| demands.time_s / starts.longest_s),
            pole: has_pole.then(|| {
                worst(&|starts| match starts.summary.wrong_poles {
                    0 => starts.least_evidence(),
                    _ => 0.0,
                })
            }),
            answers: worst(&|starts| f64::from(u8::from(share(starts.failed(), starts)))),
        }
    }

    /// Returns for each demand the smaller one of the margins in `self` and `other`.
    pub(super) fn least(&self, other: &Self) -> Self {
        Self {
            error: self.error.min(other.error),
            movement: self.movement.min(other.movement),
            current: self.current.min(other.current),
            time: self.time.min(other.time),
            pole: self.pole.zip(other.pole).map(|(a, b)| a.min(b)),
            answers: self.answers.min(other.answers),
        }
    }

    /// Returns each demand with its margin. The margin of the pole is infinite if poles are not judged. The margin of the answers is
    /// infinite if enough starts have an angle, else 0. It comes first, because without angles no other demand is met either.
    pub fn all(&self) -> [(Demand, f64); 6] {
        [
            (Demand::Answers, if self.answers < 1.0 { 0.0 } else { f64::INFINITY }),
            (Demand::Error, self.error),
            (Demand::Movement, self.movement),
            (Demand::Current, self.current),
            (Demand::Time, self.time),
            (Demand::Pole, self.pole.unwrap_or(f64::INFINITY)),
        ]
    }

    /// Returns the smaller of the margins of error and movement.
    pub fn spare(&self) -> f64 {
        self.error.min(self.movement)
    }

    /// Returns the smallest margin.
    pub(super) fn worst(&self) -> f64 {
        self.binding().1
    }

    /// Returns the demand with the smallest margin, and the margin.
    pub fn binding(&self) -> (Demand, f64) {
        self.all().into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Demand::Error, 0.0))
    }

    /// Returns true if each margin is as large as the search needs.
    pub(super) fn is_kept(&self) -> bool {
        self.all().iter().all(|(demand, margin)| *margin >= room(*demand))
    }

    /// Returns true if each margin except that of `lifted` is as large as the search needs.
    pub(super) fn is_kept_but(&self, lifted: Demand) -> bool {
        self.all().iter().all(|(demand, margin)| *demand == lifted || *margin >= room(*demand))
    }

    /// Returns true if movement and current are so far below their limits that many more starts are not expected to exceed these.
    pub(super) fn leaves_room(&self) -> bool {
        self.movement >= 1.03 && self.current >= 1.001
    }

    /// Returns true if all margins are ample, so that no further settings need to be tried.
    pub(super) fn is_easy(&self) -> bool {
        self.is_kept() && self.ease() >= 1.0
    }

    /// Divides each margin by the value at which it is ample. Returns the smallest of these ratios, at most 1.
    fn ease(&self) -> f64 {
        let eased = |(demand, margin): (Demand, f64)| match demand {
            Demand::Error | Demand::Movement => margin / 2.0,
            Demand::Pole => margin / COMFORTABLE,
            Demand::Current | Demand::Time | Demand::Answers => margin / room(demand),
        };
        self.all().into_iter().map(eased).fold(1.0, f64::min)
    }

    /// Compares the margins of two settings; the greater one is better. Settings that meet all demands are greater. Next, settings with
    /// margins nearer to ample are, then those with the larger [`Self::spare`].
    pub(super) fn compare(&self, other: &Self) -> Ordering {
        let kept = self.is_kept().cmp(&other.is_kept());
        kept.then(self.ease().total_cmp(&other.ease())).then(self.spare().total_cmp(&other.spare()))
    }
}

/// Returns the margin of a demand that settings need in the search.
pub(super) fn room(demand: Demand) -> f64 {
    match demand {
        Demand::Movement => ROOM_FOR_MOVEMENT,
        Demand::Current => ROOM_FOR_CURRENT,
        Demand::Pole => ROOM_OF_POLE,
        _ => 1.0,
    }
}
