//! Comparison of a run's starts with the demands of `check`.

use standstill_analysis::{COUNTED, Demands};
use standstill_campaign::{Summary, binomial_interval};
use standstill_quantity::{at_most, count, number, short};
use standstill_scenario::Rotor;

use super::verdict::Poles;
use crate::results::{Begun, FinishedRun};
use crate::shell::command_line::quoted;
use crate::summary::share_of;

/// The demands by which a run is judged: the default demands of `check`.
pub const DEMANDS: Demands = Demands::DEFAULT;

/// Formats an upper limit of a share in per cent.
pub fn percent(limit: f64) -> String {
    format!("{} %", at_most(limit))
}

/// Formats a share of `starts` starts in per cent.
pub fn counted(share: f64, starts: u64) -> String {
    format!("{} %", share_of(share, starts))
}

/// Result of comparing a run's starts with a demand.
#[derive(Clone, Copy, PartialEq)]
pub enum Standing {
    Met,
    NotMet,
    /// The demand may be met, but there are too few starts to show it.
    NotShown,
}

impl Standing {
    /// Compares a value, and the upper end of its interval, with the allowed value.
    fn of(value: f64, high: f64, allowed: f64) -> Self {
        match () {
            () if value > allowed => Self::NotMet,
            () if high <= allowed => Self::Met,
            () => Self::NotShown,
        }
    }
}

/// Compares the starts with each demand. Returns the result of each comparison and a text with the numbers. `judged` states whether poles
/// are judged. `rotor` is the state of the rotor, and `rated` the motor's rated current in A, if it is known.
pub fn demands(s: &Summary, judged: Poles, rotor: Rotor, rated: Option<f64>) -> Vec<(Standing, String)> {
    let mut all = Vec::new();
    // Wrong poles are judged only if starts named a pole.
    if s.found > 0 && judged != Poles::Open {
        let (share, count) = (s.wrong_pole_probability, s.wrong_poles);
        let shown = Standing::of(share.value, share.high, DEMANDS.wrong_poles);
        let allowed = format!("{} % allowed", 100.0 * DEMANDS.wrong_poles);
        let starts = if s.found == s.trials { "starts" } else { "answers" };
        let counted = match count {
            0 => format!("none in {} {starts}", s.found),
            _ => format!("{count} in {} {starts}", s.found),
        };
        let text = match shown {
            Standing::NotMet => format!("wrong poles: {counted} ({allowed})"),
            _ => format!("wrong poles: {counted}, at most {} ({allowed})", percent(share.high)),
        };
        all.push((shown, judged.qualified(text)));
    }
    let without = if judged == Poles::Open { s.failed } else { s.failed + s.undetermined };
    let share = binomial_interval(without, s.trials);
    let shown = Standing::of(share.value, share.high, DEMANDS.without_angle);
    let what = if judged == Poles::Open { "an axis" } else { "an answer" };
    let most = if shown == Standing::NotShown {
        format!(", at most {}", percent(share.high))
    } else {
        String::new()
    };
    let value = counted(share.value, s.trials);
    all.push((shown, format!("{value} without {what}{most} ({} % allowed)", 100.0 * DEMANDS.without_angle)));
    if s.axes > 0 {
        let p95 = s.p95_deg;
        let shown = Standing::of(p95.value, p95.high, DEMANDS.error_deg);
        let beyond = if s.sectors.is_some() { " beyond the sector" } else { "" };
        let text = format!("95 of 100 within {}°{beyond} ({}° allowed)", p95.alone(), DEMANDS.error_deg);
        all.push((shown, text));
    }
    let moved = s.max_moved_deg;
    if rotor == Rotor::Brake && moved > 0.0 {
        let text = format!(
            "the rotor moved by {moved:.2}° at most in the play of its brake, which no demand counts"
        );
        all.push((Standing::Met, text));
    }
    if rotor == Rotor::Free {
        let text = format!("a free rotor moved by {moved:.2}° at most ({}° allowed)", DEMANDS.movement_deg);
        all.push((Standing::of(moved, moved, DEMANDS.movement_deg), text));
    }
    // Starts that end before their first pulse show nothing of the current.
    if let Some(rated) = rated.filter(|_| s.peak_current_a > 0.0) {
        let peak = s.peak_current_a;
        let text = format!(
            "{} A flowed at most ({} A allowed, the rated current)",
            beside(peak, rated),
            short(rated)
        );
        all.push((Standing::of(peak, peak, rated), text));
    }
    all
}

/// Formats a current with two decimals, or with six digits where it would look like another current, from which it differs.
fn beside(current: f64, other: f64) -> String {
    let usual = number(2, current);
    let is_alike = current != other && usual.parse() == Ok(other);
    if is_alike { short(current) } else { usual }
}

/// Returns the sentence that names the source of the demands.
pub fn whose() -> String {
    format!(
        "Demands: those of `standstill check` without options, on angle, pole, answers, a free rotor and the current: 95 of 100 errors within {}°, {} % wrong poles, {} % without an answer, {}° of movement, no more than rated current. Its --tolerance, --movement and --current judge settings by others",
        DEMANDS.error_deg,
        100.0 * DEMANDS.wrong_poles,
        100.0 * DEMANDS.without_angle,
        DEMANDS.movement_deg
    )
}

/// Returns a sentence with the command that shows why a demand is not met. `wrong` is true if wrong poles are the cause. `silent` is true
/// if starts without an answer are the cause. `is_current` is true if no other demand than that on the current is missed.
pub fn why(run: &FinishedRun, wrong: bool, silent: bool, is_current: bool) -> String {
    let check = run.begun().0.check.filter(|_| is_current);
    if let Some(check) = check {
        return format!("More starts draw no less current. Settings that do: `{check}`");
    }
    let folder = quoted(&run.folder.display().to_string());
    let of = match (wrong, silent) {
        (true, _) => " --wrong-poles",
        (_, true) => " --unanswered",
        _ => "",
    };
    format!("More starts do not mend what is not met. Why: `standstill explain {folder}{of}`")
}

/// Returns the event of `odds` that decides on a run, and its name in words. `is_open`: poles are not judged.
pub const fn rare(is_open: bool) -> (&'static str, &'static str) {
    if is_open { ("'|e| > 5 deg'", "large errors") } else { ("wrong-pole", "wrong poles") }
}

/// Returns a sentence with two commands: one adds starts to the run, and `odds` computes the probability of a rare event.
pub fn more(run: &FinishedRun) -> String {
    let folder = quoted(&run.folder.display().to_string());
    let (Begun { line: scenario, .. }, note) = run.begun();
    let (event, rare) = rare(run.summary.run.pole_is_open);
    format!(
        "{} starts show all of it if they go on so: `standstill run {scenario} --trials {COUNTED} --resume{} --out {folder}`{note}; `standstill odds {scenario} --event {event}` bounds how rare {rare} are, far below 0.01 %, with some 400,000 trials",
        count(COUNTED),
        run.format_option()
    )
}

#[cfg(test)]
mod tests {
    use standstill_campaign::Statistics;

    use super::Standing::{Met, NotMet, NotShown};
    use super::*;

    #[test]
    fn law_a_run_is_judged_by_the_demands_of_check() {
        let of = |trials: u64, undetermined: u64, wrong: u64, p95: [f64; 2]| {
            let mut s = Statistics::default().summary();
            (s.trials, s.undetermined, s.wrong_poles) = (trials, undetermined, wrong);
            (s.found, s.axes) = (trials - undetermined, trials);
            s.wrong_pole_probability = binomial_interval(wrong, trials);
            (s.p95_deg.value, s.p95_deg.low, s.p95_deg.high) = (p95[0], p95[0], p95[1]);
            s.peak_current_a = 8.0;
            let judged = demands(&s, Poles::Known, Rotor::Locked, None);
            judged.into_iter().map(|(shown, _)| shown).collect::<Vec<_>>()
        };
        // More than rated current is refused, as `check` refuses it.
        let drawn = |peak: f64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.peak_current_a) = (1, peak);
            demands(&s, Poles::Known, Rotor::Locked, Some(8.0)).pop().expect("a demand")
        };
        assert!(drawn(8.0).0 == Met && drawn(8.01).0 == NotMet);
        assert!(drawn(8.001).1.starts_with("8.001 A") && drawn(64.777_7).1.starts_with("64.78 A"));
        assert_eq!(drawn(8.01).1, "8.01 A flowed at most (8 A allowed, the rated current)");
        // 0.35 % undetermined starts are within the 1 % that `check` allows. No wrong pole in 2,000 starts does not show that at most 0.01
        // % are wrong.
        assert!(of(2000, 7, 0, [0.4, 0.5]) == [NotShown, Met, Met]);
        assert!(of(37_000, 100, 0, [0.4, 0.5]) == [Met, Met, Met]);
        assert!(of(2000, 0, 1, [0.4, 0.5]) == [NotMet, Met, Met]);
        assert!(of(200, 3, 0, [6.0, 7.0]) == [NotShown, NotMet, NotMet]);
        assert!(of(30, 0, 0, [0.4, f64::INFINITY]) == [NotShown, NotShown, NotShown]);
    }
}
