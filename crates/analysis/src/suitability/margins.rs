//! By how much demands are kept.

use std::cmp::Ordering;
use std::fmt;

use standstill_scenario::Rotor;

use super::Demands;
use super::starts::{COMFORTABLE, Starts};

/// What a start demands of a detection, one demand after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// The axis' error.
    Error,
    /// A free rotor's movement.
    Movement,
    /// The largest phase current.
    Current,
    /// The time of a detection.
    Time,
    /// Evidence for the pole, in 99 of 100 starts.
    Pole,
    /// Starts that end with an angle.
    Answers,
}

impl Demand {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Movement => "movement",
            Self::Current => "current",
            Self::Time => "time",
            Self::Pole => "pole",
            Self::Answers => "answers",
        }
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

/// How many times better than demanded: 1 is just enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Demanded error over the 95th percentile.
    pub error: f64,
    /// Allowed movement over the furthest; infinite of a rotor that is held.
    pub movement: f64,
    /// Allowed current over the largest.
    pub current: f64,
    /// Allowed time over the longest.
    pub time: f64,
    /// Evidence for the right pole over what a decision needs, in 99 of 100 starts. None where poles are not judged.
    pub pole: Option<f64>,
    /// 1 where as many starts end with an angle as demanded, else 0.
    pub answers: f64,
}

/// What fresh starts must not exceed is kept a little further away: the furthest of few starts is not the furthest of many.
const ROOM_FOR_MOVEMENT: f64 = 1.1;
const ROOM_FOR_CURRENT: f64 = 1.005;
/// How far the evidence of few starts may seem too little: many may show that it is enough.
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

    /// All of them by name.
    pub fn all(&self) -> [(Demand, f64); 6] {
        [
            (Demand::Error, self.error),
            (Demand::Movement, self.movement),
            (Demand::Current, self.current),
            (Demand::Time, self.time),
            (Demand::Pole, self.pole.unwrap_or(f64::INFINITY)),
            (Demand::Answers, if self.answers < 1.0 { 0.0 } else { f64::INFINITY }),
        ]
    }

    /// In error and in movement, whichever is less.
    pub fn spare(&self) -> f64 {
        self.error.min(self.movement)
    }

    /// How much of the demand that is kept least is kept.
    pub(super) fn worst(&self) -> f64 {
        self.binding().1
    }

    /// The demand that is kept least.
    pub fn binding(&self) -> (Demand, f64) {
        self.all().into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Demand::Error, 0.0))
    }

    /// Whether all are kept, with the room that fresh starts need.
    pub(super) fn is_kept(&self) -> bool {
        self.all().iter().all(|(demand, margin)| *margin >= room(*demand))
    }

    /// Whether fresh starts keep movement and current far enough away for the furthest of many more.
    pub(super) fn leaves_room(&self) -> bool {
        self.movement >= 1.03 && self.current >= 1.001
    }

    /// Whether all are kept with ease, so that nothing more needs to be looked for.
    pub(super) fn is_easy(&self) -> bool {
        self.is_kept() && self.ease() >= 1.0
    }

    /// How near all are to being kept with ease, at most 1.
    fn ease(&self) -> f64 {
        let eased = |(demand, margin): (Demand, f64)| match demand {
            Demand::Error | Demand::Movement => margin / 2.0,
            Demand::Pole => margin / COMFORTABLE,
            Demand::Current | Demand::Time | Demand::Answers => margin / room(demand),
        };
        self.all().into_iter().map(eased).fold(1.0, f64::min)
    }

    /// Which of two is to be preferred: first what keeps all demands, then what does so with ease, then what errs and moves less.
    pub(super) fn compare(&self, other: &Self) -> Ordering {
        let kept = self.is_kept().cmp(&other.is_kept());
        kept.then(self.ease().total_cmp(&other.ease())).then(self.spare().total_cmp(&other.spare()))
    }
}

fn room(demand: Demand) -> f64 {
    match demand {
        Demand::Movement => ROOM_FOR_MOVEMENT,
        Demand::Current => ROOM_FOR_CURRENT,
        Demand::Pole => ROOM_OF_POLE,
        _ => 1.0,
    }
}
