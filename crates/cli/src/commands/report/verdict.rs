//! The verdict on a run as one line, and its reasons.

use standstill_campaign::Summary;
use standstill_quantity::count;
use standstill_report::page::Tone;
use standstill_scenario::written;

use super::demands::{DEMANDS, Standing, counted, demands, more, percent, rare, whose, why};
use crate::results::{FinishedRun, PointSummary, SummaryFile};
use crate::shell::command_line::{quoted, set};
use crate::shell::values::{Shown, describe, range};
use crate::summary::{FAILING, Ranking, good, sectors_in_words};

/// Returns words to be added to an error if answers are sectors. The error of a sector is measured from the sector's border.
const fn beyond(s: &Summary) -> &'static str {
    if s.sectors.is_some() { " beyond the sector" } else { "" }
}

/// Formats the rms error in degrees, with no more digits than its interval supports.
fn rms(s: &Summary) -> String {
    format!("{}° rms{}", s.rms_deg.alone(), beyond(s))
}

/// Returns the verdict's tone, headline and details.
pub fn verdict(run: &FinishedRun) -> (Tone, String, Vec<String>) {
    let summary = &run.summary;
    let (mut tone, headline, mut details) =
        summary.whole().map_or_else(|| of_sweep(summary), |s| of_run(run, s));
    if let Some(note) = &summary.run.pole_note {
        details.push(format!("Poles: {note}"));
    }
    if let Some(note) = &summary.run.map_note {
        details.push(format!("Map: {note}"));
    }
    if let Some(note) = &summary.run.motor_note {
        details.push(format!("Motor: {note}"));
        tone = if tone == Tone::Bad { tone } else { Tone::Warning };
    }
    if summary.errors() > 0 {
        details.push(format!("{} trials could not be simulated", summary.errors()));
    }
    details.extend(summary.unreached());
    (tone, headline, details)
}

/// Returns the number of starts without an answer and the most frequent reason. Returns none if `check` allows this number.
fn silence(s: &Summary) -> Option<String> {
    let silent = s.undetermined + s.failed;
    if silent as f64 <= DEMANDS.without_angle * s.trials as f64 {
        return None;
    }
    let what = match (s.failed, s.undetermined) {
        (_, 0) => "failed",
        (0, _) => "had an axis but no pole",
        _ => "had no answer",
    };
    // Among equally frequent reasons, the first by name.
    let most = s.reasons.iter().rev().max_by_key(|(_, times)| times.count);
    let why = most.map_or_else(String::new, |(reason, times)| {
        if times.count == silent { format!(" ({reason})") } else { format!(" (most often: {reason})") }
    });
    Some(format!("{} of {} starts {what}{why}", count(silent), count(s.trials)))
}

/// Whether poles are judged, and on what basis.
#[derive(Clone, Copy, PartialEq)]
pub enum Poles {
    Known,
    /// Poles are judged by an assumption that all cores fitted to the flux map share.
    Assumed,
    /// Poles are not judged; only the axis of a start counts.
    Open,
}

impl Poles {
    fn of(summary: &SummaryFile) -> Self {
        match &summary.run.pole_note {
            None => Self::Known,
            Some(_) if summary.run.pole_is_open => Self::Open,
            Some(_) => Self::Assumed,
        }
    }

    /// Returns the share of correct starts. If poles are not judged, a start with an axis is correct.
    fn right(self, s: &Summary) -> f64 {
        good(s, self == Self::Open)
    }

    /// Returns the phrase for correct starts.
    const fn did(self) -> &'static str {
        if matches!(self, Self::Open) { "with an axis" } else { "answered rightly" }
    }

    /// Returns the text, followed by `(poles as assumed)` if the pole was judged by an assumption.
    pub fn qualified(self, text: String) -> String {
        if self == Self::Assumed { format!("{text} (poles as assumed)") } else { text }
    }
}

/// Returns the commands that go on from a run, each with its purpose. None if a detail of the verdict has the command, because a demand is
/// not met or not shown yet.
pub fn next(run: &FinishedRun, tone: Tone) -> Vec<(String, String)> {
    let (mut begun, note) = run.begun();
    let open = run.summary.run.pole_is_open;
    if run.summary.whole().is_some() {
        if tone != Tone::Good {
            return Vec::new();
        }
        let (event, rare) = rare(open);
        let scenario = &begun.line;
        return vec![
            (
                format!("how rare {rare} are, far below 0.01 %, with some 400,000 trials{note}"),
                format!("standstill odds {scenario} --event {event}"),
            ),
            (
                format!("which errors of drive and sensors make the error, and what each may be{note}"),
                format!("standstill budget {scenario}"),
            ),
        ];
    }
    let points = &run.summary.points;
    let ranking = Ranking::of(points.iter().map(|point| &point.summary), open);
    let best = (0..points.len()).min_by(|a, b| ranking.compare(&points[*a].summary, &points[*b].summary));
    // The points of the file are in the same order.
    let place = best.and_then(|best| run.file.points().ok()?.into_iter().nth(best));
    let Some((place, trials)) = place.zip(best.map(|best| points[best].summary.trials)) else {
        return Vec::new();
    };
    begun.line += &set("axes", "{}");
    begun.line.extend(place.values.iter().map(|(key, value)| set(key, &written(value))));
    let folder = quoted(&run.folder.display().to_string());
    vec![
        (
            format!("ten times as many starts at the best point{note}"),
            format!("standstill run {} --trials {}", begun.line, 10 * trials),
        ),
        ("why the start with the largest error ended so".to_owned(), format!("standstill explain {folder}")),
    ]
}

fn of_run(run: &FinishedRun, s: &Summary) -> (Tone, String, Vec<String>) {
    let judged = Poles::of(&run.summary);
    let open = judged == Poles::Open;
    let silent = (s.undetermined + s.failed) as f64 / s.trials as f64;
    let rated = run.rated_current();
    let all = demands(s, judged, run.file.rotor.state(), rated);
    let any = |wanted: Standing| all.iter().any(|(shown, _)| *shown == wanted);
    let are_wrong = !open && s.wrong_pole_probability.value > DEMANDS.wrong_poles;
    let tone = if are_wrong || s.errors > 0 || (if open { s.axes } else { s.found }) == 0 {
        Tone::Bad
    } else if any(Standing::NotMet) || judged != Poles::Known {
        Tone::Warning
    } else if any(Standing::NotShown) {
        Tone::Neutral
    } else {
        Tone::Good
    };
    let rms = if s.axes == 0 { "no axis found".to_owned() } else { rms(s) };
    let unjudged = (open && s.found > 0).then(|| "poles not judged".to_owned());
    let listed = |head: &str, wanted: Standing| {
        let of: Vec<&str> =
            all.iter().filter(|(shown, _)| *shown == wanted).map(|(_, text)| text.as_str()).collect();
        (!of.is_empty()).then(|| format!("{head}: {}", of.join(", ")))
    };
    let parts = if any(Standing::NotMet) || any(Standing::NotShown) {
        let [missed, not] =
            [listed("not met", Standing::NotMet), listed("not shown by so few starts", Standing::NotShown)];
        [silence(s), missed, not, listed("met", Standing::Met), unjudged, Some(rms)]
    } else {
        [None, listed("demands met", Standing::Met), None, None, unjudged, Some(rms)]
    };
    let mut details = vec![whose()];
    if s.found > 0 && !open {
        let most = percent(s.wrong_pole_probability.high);
        details.push(judged.qualified(format!("Probability of a wrong pole: {most} at most (97.5 %)")));
    }
    details.push(format!(
        "Starts without an answer: {} undetermined, {} failed ({} together)",
        s.undetermined,
        s.failed,
        counted(silent, s.trials)
    ));
    if s.beyond_limit.value.is_finite() {
        let beyond = counted(s.beyond_limit.value, s.found);
        let of = if s.sectors.is_some() { "rotor is beyond the sector named" } else { "angle is off" };
        details.push(format!("The {of} by more than {}° in {beyond} of starts with an angle", s.limit_deg));
    }
    details.extend(
        s.sectors
            .filter(|of| of.named > 0)
            .map(|of| format!("Sectors: {}", sectors_in_words(&of, s.limit_deg))),
    );
    if any(Standing::NotMet) {
        let missed = all.iter().filter(|(shown, _)| *shown == Standing::NotMet).count();
        let is_current = missed == 1 && rated.is_some_and(|rated| s.peak_current_a > rated);
        details.push(why(run, are_wrong, silent > DEMANDS.without_angle, is_current));
    } else if any(Standing::NotShown) && s.found > 0 {
        details.push(more(run));
    }
    (tone, sentence(parts), details)
}

/// Returns the verdict on a sweep. It does not combine the points, because the user chose them and a common share would
/// depend on this choice.
fn of_sweep(summary: &SummaryFile) -> (Tone, String, Vec<String>) {
    let (points, judged) = (&summary.points, Poles::of(summary));
    let open = judged == Poles::Open;
    let right = |s: &Summary| judged.right(s);
    let each = || summary.each();
    let named = || each().filter(|s| s.found > 0);
    let wrong = !open && each().any(|s| s.wrong_poles > 0);
    let tone = if wrong || summary.errors() > 0 || each().any(|s| right(s) <= 0.0) {
        Tone::Bad
    } else if each().any(|s| 1.0 - right(s) > FAILING) {
        Tone::Warning
    } else {
        Tone::Neutral
    };
    let answered = range(each().map(|s| (right(s), s.trials)))
        .map(|range| format!("{range} {}, by point", judged.did()));
    let poles = match each().filter(|s| s.wrong_poles > 0).count() {
        _ if named().count() == 0 => None,
        _ if open => Some("poles not judged".to_owned()),
        0 if named().count() < points.len() => {
            Some(format!("no wrong pole at the {} of {} points that name one", named().count(), points.len()))
        }
        0 => Some(format!("no wrong pole at any of {} points", points.len())),
        many => Some(format!("wrong poles at {many} of {} points", points.len())),
    };
    let poles = poles.map(|text| judged.qualified(text));
    let ranking = Ranking::of(points.iter().map(|point| &point.summary), open);
    let by = |a: &&PointSummary, b: &&PointSummary| ranking.compare(&a.summary, &b.summary);
    let best = points.iter().min_by(by);
    let rms = best.map(|best| match best.summary.axes {
        0 => "no axis found".to_owned(),
        _ => format!("best point {}", rms(&best.summary)),
    });
    let mut details = Vec::new();
    let limits = || named().map(|s| s.wrong_pole_probability.high);
    if named().count() > 0 && !open {
        let most = percent(limits().fold(0.0, f64::max));
        details.push(judged.qualified(format!(
            "Probability of a wrong pole: {most} at most where it is known least (97.5 %, each point by itself)"
        )));
    }
    let without = |s: &Summary| 1.0 - s.found as f64 / s.trials as f64;
    if let Some(range) = range(each().map(|s| (without(s), s.trials))) {
        details.push(format!("Starts without an answer: {range}, by point"));
    }
    if let (Some(range), Some(s)) = (range(each().map(|s| (s.beyond_limit.value, s.found))), each().next()) {
        let of = match each().filter(|s| s.sectors.is_some()).count() {
            0 => "The angle is off",
            many if many == points.len() => "The rotor is beyond the sector named",
            _ => "The angle is off, or the rotor beyond the sector named,",
        };
        details
            .push(format!("{of} by more than {}° in {range} of starts with an angle, by point", s.limit_deg));
    }
    if !open && !wrong && limits().any(|high| high > DEMANDS.wrong_poles) {
        let most = 100.0 * DEMANDS.wrong_poles;
        details.push(format!("Too few starts at each point to show that at most {most} % are wrong poles"));
    }
    let shown = Shown::of(points);
    let of_point = |point: &PointSummary| {
        let s = &point.summary;
        let rms = match s.axes {
            0 => "no start found an axis".to_owned(),
            axes => format!("rms {}° over {axes} axes{}", s.rms_deg, beyond(s)),
        };
        let did = if open { "with an axis" } else { "right" };
        format!("{} {did}, {rms}, at {}", counted(right(s), s.trials), describe(point, &shown))
    };
    if let (Some(best), Some(worst)) = (best, points.iter().max_by(by)) {
        let name = if 1.0 - right(&best.summary) > FAILING {
            if open {
                "No point has an axis in 99 % of its starts; nearest"
            } else {
                "No point answers 99 % of its starts; nearest"
            }
        } else {
            "Best point"
        };
        details.push(format!("{name}: {}", of_point(best)));
        details.push(format!("Worst point: {}", of_point(worst)));
        details.push(format!("Points are ranked {}", ranking.in_words(best.summary.limit_deg)));
    }
    let most = points.iter().max_by(|a, b| without(&a.summary).total_cmp(&without(&b.summary)));
    if let Some(point) = most.filter(|point| without(&point.summary) > 0.0) {
        let share = counted(without(&point.summary), point.summary.trials);
        details.push(format!("Most starts without an answer: {share} at {}", describe(point, &shown)));
    }
    details.push("Trials of the same number share their random numbers at all points: how points differ is surer than their intervals say".to_owned());
    (tone, sentence([answered, poles, rms]), details)
}

/// Joins all parts that are not none into one sentence, which begins with a capital letter.
fn sentence<const N: usize>(parts: [Option<String>; N]) -> String {
    let text = parts.into_iter().flatten().collect::<Vec<_>>().join("; ");
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use standstill_campaign::{Occurrence, Statistics, binomial_interval};

    use super::*;

    #[test]
    fn law_starts_without_an_answer_are_said_with_the_commonest_reason() {
        let of = |undetermined: u64, failed: u64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.undetermined, s.failed) = (200, undetermined, failed);
            for (reason, count) in [("axis unclear", undetermined), ("clipped", failed)] {
                let probability = binomial_interval(count, 200);
                s.reasons.insert(reason.to_owned(), Occurrence { count, probability });
            }
            silence(&s)
        };
        let said = |text: &str| Some(text.to_owned());
        // 1 % is not yet many.
        assert_eq!((of(1, 1), of(0, 0)), (None, None));
        assert_eq!(of(0, 3), said("3 of 200 starts failed (clipped)"));
        assert_eq!(of(3, 0), said("3 of 200 starts had an axis but no pole (axis unclear)"));
        assert_eq!(of(2, 5), said("7 of 200 starts had no answer (most often: clipped)"));
        assert_eq!(of(2, 2), said("4 of 200 starts had no answer (most often: axis unclear)"));
    }

    #[test]
    fn law_a_range_leaves_out_what_is_none() {
        let of = |all: &[(f64, u64)]| range(all.iter().copied());
        assert_eq!(of(&[(0.5, 1000), (f64::NAN, 9), (0.0, 100)]).as_deref(), Some("0 % to 50.0 %"));
        assert_eq!(of(&[(0.5, 100), (f64::NAN, 9)]).as_deref(), Some("50 %"));
        assert_eq!(of(&[(f64::NAN, 9)]), None);
    }
}
