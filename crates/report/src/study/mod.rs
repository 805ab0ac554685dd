//! Figures of a Monte-Carlo run or of a sweep, from plain data.
//!
//! A [`Study`] holds the results of each point of a sweep and an [`ErrorCloud`] of all single trials. [`figures`] draws
//! all figures for which it has data. All intervals are at 95 %, all angles in electrical degrees. The error is that of
//! the axis; wrong poles are counted separately.

mod angle;
mod cloud;
mod distribution;
mod heat;
mod methods;
mod odds;
mod periodic;
mod place;
mod scatter;
mod slices;
mod sweep;

pub use angle::error_over_angle;
pub use cloud::{ErrorCloud, Thinned};

use std::collections::BTreeMap;

use crate::figure::{Figure, Panel};
use distribution::distribution;
use heat::heat;
use methods::methods;
use odds::odds;
use scatter::scatter;
use sweep::sweep;

pub use standstill_quantity::Estimate;

/// Returns an estimate as a point of error bars.
fn bar(of: Estimate, x: f64) -> (f64, f64, f64, f64) {
    (x, of.value, of.low, of.high)
}

/// Position of a point on an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Coordinate {
    /// A number in the unit of the axis.
    Number(f64),
    /// A name of a method, a motor or a set of errors.
    Name(String),
}

/// An axis of a sweep: its key, words and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyAxis {
    /// Key in the scenario, such as `sensors.noise`; names of files are made of it.
    pub key: String,
    /// Label for readers; if empty, the key is shown.
    pub label: String,
    /// Unit, empty for pure numbers and names.
    pub unit: String,
    /// Whether neighbours have the same ratio. An axis with a value of zero or less is drawn with evenly spaced names
    /// instead.
    pub logarithmic: bool,
}

/// A point of a sweep, or a whole run.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyPoint {
    /// Coordinates on the axes of the study, in their order.
    pub coordinates: Vec<Coordinate>,
    /// Number of trials, to which the probabilities refer.
    pub trials: u64,
    /// Number of trials with an axis, to which the errors refer.
    pub axes: u64,
    /// Trials that named the wrong pole.
    pub wrong_poles: u64,
    /// Trials with an axis but no pole.
    pub undetermined: u64,
    /// Trials without an angle.
    pub failed: u64,
    /// Root mean square of the axis error in degrees.
    pub rms_deg: Estimate,
    /// Median of the axis error's magnitude in degrees.
    pub p50_deg: Estimate,
    /// 95th percentile of the magnitude of the axis error.
    pub p95_deg: Estimate,
    /// 99th percentile of the magnitude of the axis error.
    pub p99_deg: Estimate,
    /// Mean axis error in degrees.
    pub bias_deg: Estimate,
}

/// Arrangement of a study's points over its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Design {
    /// All combinations of the axes' values.
    #[default]
    Grid,
    /// Each point has its own values, as in a Latin hypercube or a Sobol sequence.
    Scattered,
}

/// A run or a sweep.
#[derive(Clone, Debug)]
pub struct Study {
    /// Subject of the study, for the titles. May be empty.
    pub title: String,
    /// The conditions, for the subtitles.
    pub subtitle: Option<String>,
    /// The keys varied.
    pub axes: Vec<StudyAxis>,
    /// Results at the points, in any order.
    pub points: Vec<StudyPoint>,
    /// Arrangement of the points.
    pub design: Design,
    /// Single trials of all points together; none if they were not collected.
    pub cloud: Option<ErrorCloud>,
    /// Index of the best point. Figures over some axes show the values of the other axes at this point. None: the first
    /// point.
    pub best: Option<usize>,
    /// True if poles are judged. If the motor's data do not determine them, a start with an axis counts as right, and
    /// points have neither wrong nor undetermined poles.
    pub poles_are_judged: bool,
    /// The exact interval of a probability from a count in a total.
    pub binomial: fn(u64, u64) -> Estimate,
}

/// The texts over a figure: the title, and the conditions.
struct Caption {
    title: String,
    subtitle: Option<String>,
}

impl Caption {
    /// Makes the title: the quantity shown, and the study if that has a title.
    fn of(what: &str, study: &str, subtitle: Option<String>) -> Self {
        let title = if study.is_empty() { what.to_owned() } else { format!("{what}: {study}") };
        Self { title, subtitle }
    }

    /// Returns a figure of the usual width, with remarks after the conditions.
    fn figure(&self, remarks: &[String], height: u32, mut panels: Vec<Panel>) -> Figure {
        // A panel without any datum says nothing.
        let (all, had) = (panels.len(), panels.iter().any(Panel::has_data));
        panels.retain(|panel| !had || panel.has_data());
        let height = if panels.len() < all { (height * 6 / 10).max(340) } else { height };
        if let Some(first) = panels.first_mut() {
            first.legend = true;
        }
        let parts: Vec<&str> = self.subtitle.iter().chain(remarks).map(String::as_str).collect();
        let subtitle = parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ");
        let subtitle = Some(subtitle).filter(|subtitle| !subtitle.is_empty());
        Figure { title: self.title.clone(), subtitle, width: Figure::WIDTH, height, panels }
    }
}

/// Share of starts without a right answer above which a point fails, regardless of its error.
const FAILING: f64 = 0.01;
/// Most pairs of axes that get a heat map.
const MOST_PAIRS: usize = 3;
/// Most axes that get their own figures.
const MOST_AXES: usize = 12;

impl StudyAxis {
    /// Returns the words for readers.
    fn name(&self) -> &str {
        if self.label.is_empty() { &self.key } else { &self.label }
    }

    /// Returns the words with the unit, for an axis.
    fn title(&self) -> String {
        if self.unit.is_empty() { self.name().to_owned() } else { format!("{} ({})", self.name(), self.unit) }
    }

    fn is_method(&self) -> bool {
        self.key == "method" || self.key == "method.name" || self.key.ends_with(".method")
    }

    /// Returns the key as a part of a file's name.
    fn stem(&self) -> String {
        let plain = |c: char| if c.is_alphanumeric() || matches!(c, '.' | '-' | '_') { c } else { '_' };
        self.key.chars().map(plain).collect()
    }
}

impl StudyPoint {
    /// Trials that named a pole.
    fn named(&self) -> u64 {
        self.trials.saturating_sub(self.undetermined + self.failed)
    }

    /// Returns whether more than one start in a hundred has no right answer.
    fn fails(&self) -> bool {
        (self.wrong_poles + self.undetermined + self.failed) as f64 > FAILING * self.trials as f64
    }
}

impl Study {
    /// Returns the indices of the axes that have more than one value.
    fn varied(&self) -> Vec<usize> {
        (0..self.axes.len()).filter(|axis| slices::values(self, *axis).len() > 1).collect()
    }

    /// Returns the ways to go wrong that are judged.
    fn kinds(&self) -> &'static [odds::Kind] {
        if self.poles_are_judged { &odds::KINDS } else { &odds::KINDS[2..] }
    }

    /// Returns the legend entry of failing points.
    fn no_answer(&self) -> &'static str {
        if self.poles_are_judged {
            "more than 1 % without a right answer"
        } else {
            "more than 1 % without an axis"
        }
    }

    fn caption(&self, what: &str) -> Caption {
        Caption::of(what, &self.title, self.subtitle.clone())
    }
}

/// Returns the figures that a study has data for, with the stems of their files' names; one without any datum is left
/// out.
///
/// | with | figures |
/// |---|---|
/// | a cloud of one point | `error_over_angle`, `distribution` |
/// | an axis of a grid | `sweep_KEY`, `wrong_poles_KEY` |
/// | two and more | `heat_KEY_KEY` for up to three pairs, those first whose axes change the rms error most |
/// | methods and nothing else | `methods` in place of these |
/// | a scattered design | `scatter` in place of sweeps and maps |
pub fn figures(study: &Study) -> Vec<(String, Figure)> {
    let mut all = Vec::new();
    let mut add = |name: String, figure: Figure| {
        if figure.has_data() {
            all.push((name, figure));
        }
    };
    let varied = study.varied();
    // Over axes that are varied on purpose, what all trials say together depends on how the points were chosen.
    if let Some(cloud) = study.cloud.as_ref().filter(|_| varied.is_empty()) {
        let over_angle = error_over_angle(&study.title, study.subtitle.clone(), cloud);
        add("error_over_angle".into(), over_angle);
        if let Some(point) = study.points.first() {
            let caption = study.caption("Distribution of the error");
            add("distribution".into(), distribution(&caption, cloud, point));
        }
    }
    if let [axis] = varied[..]
        && study.axes[axis].is_method()
    {
        add("methods".into(), methods(&study.caption("Methods compared"), study, axis));
        return all;
    }
    if study.design == Design::Scattered {
        if !varied.is_empty() {
            add("scatter".into(), scatter(&study.caption("Error over each axis"), study));
        }
        return all;
    }
    for &axis in varied.iter().take(MOST_AXES) {
        let (name, stem) = (study.axes[axis].name(), study.axes[axis].stem());
        let caption = study.caption(&format!("Error over {name}"));
        add(format!("sweep_{stem}"), sweep(&caption, study, axis));
        let caption = study.caption(&format!("Starts without a right answer over {name}"));
        add(format!("wrong_poles_{stem}"), odds(&caption, study, axis));
    }
    for (x, y) in pairs(study, &varied) {
        let (a, b) = (&study.axes[x], &study.axes[y]);
        let caption = study.caption(&format!("Rms error over {} and {}", a.name(), b.name()));
        add(format!("heat_{}_{}", a.stem(), b.stem()), heat(&caption, study, x, y));
    }
    all
}

/// Returns the pairs of axes that change the rms error most.
fn pairs(study: &Study, varied: &[usize]) -> Vec<(usize, usize)> {
    let effect = |axis: usize| {
        // The range along each line of points that differ in this axis alone.
        let mut lines: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        for point in study.points.iter().filter(|point| point.rms_deg.value > 0.0) {
            let others = point.coordinates.iter().enumerate().filter(|(other, _)| *other != axis);
            let rms = point.rms_deg.value.ln();
            let line = lines.entry(format!("{:?}", others.collect::<Vec<_>>())).or_insert((rms, rms));
            *line = (line.0.min(rms), line.1.max(rms));
        }
        lines.values().map(|(low, high)| high - low).sum::<f64>() / lines.len().max(1) as f64
    };
    let effects: Vec<(usize, f64)> = varied.iter().map(|&axis| (axis, effect(axis))).collect();
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    for (index, &(x, first)) in effects.iter().enumerate() {
        pairs.extend(effects[index + 1..].iter().map(|&(y, second)| (x, y, first + second)));
    }
    pairs.sort_by(|a, b| b.2.total_cmp(&a.2));
    pairs.into_iter().take(MOST_PAIRS).map(|(x, y, _)| (x, y)).collect()
}
