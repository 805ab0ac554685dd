//! The answer of `check` as text and tables.

mod motor;
mod recommended;
mod turning;
mod unsuited;

use standstill_analysis::{Candidate, Condition, Demand, Suited};
use standstill_detect::Method;
use standstill_report::page::{Block, Column, Table, Tone};
use standstill_scenario::Rotor;

use super::checked::{Checked, amperes, keys, milliseconds, percent};
use crate::shell::values::without_setting;

pub use self::motor::estimate_beyond;
use self::motor::{assumptions, condition, poles, published, saliency, single, terminals};

impl Checked<'_> {
    /// Returns the tone of the verdict, and the verdict in one word.
    pub fn word(&self) -> (Tone, &'static str) {
        match self.found.suited() {
            // A verdict on a data sheet with doubtful numbers is a warning, even if settings suit.
            Suited::Yes if !self.doubts.is_empty() => (Tone::Warning, "suited"),
            Suited::Yes => (Tone::Good, "suited"),
            Suited::If => (Tone::Warning, "suited"),
            Suited::No => (Tone::Bad, "NOT suited"),
            Suited::Undecided => (Tone::Warning, "not decided"),
            Suited::Unknown => (Tone::Bad, "cannot be judged"),
        }
    }

    /// Returns the verdict as a sentence.
    pub fn head(&self) -> String {
        let found = self.found;
        let what = if found.pole_is_open() { "rotor's axis" } else { "rotor position" };
        let note = match &found.condition {
            Some(Condition::Saturation { least, most, .. }) => format!(
                "; if the north pole's inductance falls by at least {} (and at most {}) at rated current",
                percent(*least),
                percent(*most)
            ),
            _ => found
                .pole
                .note()
                .filter(|_| found.has_magnet)
                .map_or_else(String::new, |note| format!("; {note}")),
        };
        if found.suited() == Suited::Unknown {
            return format!(
                "{}: detection of the {what} at standstill {}: the data sheet gives one inductance for both axes (error set {})",
                self.motor.name,
                self.word().1,
                self.errors.name()
            );
        }
        if found.suited() == Suited::Undecided {
            return format!(
                "{}: whether the {what} can be detected at standstill is {} (error set {}): {}",
                self.motor.name,
                self.word().1,
                self.errors.name(),
                match found.open() {
                    Some(_) =>
                        "the fresh starts of the best settings meet all demands, but are too few to show it",
                    None => "no settings that were tried suffice, and not all were tried",
                }
            );
        }
        let given = found.candidates.iter().find_map(|of| of.given).filter(|_| found.suited() == Suited::No);
        let given = given.map_or_else(String::new, |key| format!("; `detector.{key}` was as given"));
        let note = note + &given + &turning::note(self);
        let doubt = self.motor.doubtful().map(|doubt| doubt.what).or_else(|| self.doubts.first().cloned());
        let note = match doubt {
            Some(doubt) => format!("{note}; if its numbers are meant: {doubt}"),
            None => note,
        };
        format!(
            "{}: {} to detection of the {what} at standstill (error set {}){note}",
            self.motor.name,
            self.word().1,
            self.errors.name()
        )
    }

    /// Returns the reasons of the verdict.
    pub fn reasons(&self) -> Vec<String> {
        let mut reasons: Vec<String> =
            self.doubts.iter().map(|doubt| format!("Doubtful numbers: {doubt}")).collect();
        reasons.extend([saliency(self.found, self.demands, self.errors), poles(self.found)]);
        reasons.extend(self.signature.map(|doubt| format!("Signature: {doubt}.")));
        reasons.extend(self.found.read_up_to_a.map(|range| {
            format!(
                "Current: at most {} A are tried, as the current sensors read up to {} A: `-s sensors.range=…` has others.",
                amperes(self.found.most_current_a),
                amperes(range)
            )
        }));
        reasons.extend(self.found.left_speed.as_ref().map(|speed| {
            format!(
                "Speed: the scenario's rotor.speed, {speed}, is left out, as a rotor is judged that stands; `-s rotor.state=driven` judges its motion."
            )
        }));
        reasons.extend(self.found.left_angle.as_ref().map(|angle| {
            format!("Angle: the scenario's rotor.angle, {angle}, is left out, as all angles are judged.")
        }));
        reasons.extend(condition(self));
        reasons.extend(single(self));
        reasons.extend(published(self));
        reasons.extend(terminals(self));
        reasons.extend(self.motor.map_note().map(|note| format!("Map: {note}.")));
        reasons
    }
}

/// Returns the part of the answer below the verdict as blocks. `next` has the lines on the next steps.
pub fn blocks(asked: &Checked<'_>, next: &[String]) -> Vec<Block> {
    let found = asked.found;
    let reasons = asked.reasons().into_iter().chain(assumptions(asked.sheet)).collect();
    let table = Table::new(columns_of_check(found.rotor)).judged(found.candidates.iter().map(cells));
    let mut blocks = vec![Block::List(reasons), Block::Table(table)];
    if let Some(candidate) = found.recommended() {
        let settings = settings(&candidate.settings, found.has_magnet && !found.pole_is_open());
        let settings = settings.into_iter().map(|(name, value)| (name.to_owned(), value));
        let said = recommended::sentence(candidate, found) + &recommended::with_more_room(candidate, found);
        blocks.extend([Block::Text(said), Block::Facts(settings.collect())]);
        blocks.extend(recommended::confirmed(found).map(Block::Text));
        blocks.extend(turning::said(asked).map(Block::Text));
    }
    blocks.extend(unsuited::blocks(found));
    blocks.extend(untried(asked).map(Block::Text));
    let left_out = found.left_out.iter().map(|of| (of.method.name(), &of.lacks[..]));
    blocks.extend(without_setting(left_out).into_iter().map(Block::Text));
    let caption = "How to go on".to_owned();
    blocks.push(Block::Code { caption, text: next.join("\n").trim_start().to_owned() + "\n" });
    blocks
}

/// Returns the sentence that lists what was not tried because `--effort` allows no more computing work. None if everything was tried.
fn untried(asked: &Checked<'_>) -> Option<String> {
    let (untried, effort) = (&asked.found.untried, asked.effort.name());
    (!untried.is_empty()).then(|| {
        format!(
            "Not tried, as it would take more than the work of --effort {effort}: {}.",
            untried.join("; ")
        )
    })
}

/// Formats the verdict on a method as a table cell. The cell has the settings, the objections, and the demand that limits the settings,
/// marked *binds*.
pub fn verdict(candidate: &Candidate) -> String {
    let keys = keys(&candidate.setting);
    let at = if keys.is_empty() { String::new() } else { format!("{keys}: ") };
    let given = candidate.given.filter(|_| !candidate.objections.is_empty());
    let binds = match candidate.binding {
        // Nothing was run with these settings.
        _ if !candidate.is_judged() => String::new(),
        Some(Demand::Current) if given.is_some() => {
            format!("; the given {} binds", given.unwrap_or_default().replace('_', " "))
        }
        Some(demand) => format!("; {} binds", short(demand)),
        None => "; the link drives no more current".to_owned(),
    };
    if candidate.objections.is_empty() {
        return format!("{at}suited{binds}");
    }
    format!("{at}{}{binds}", candidate.objections.join("; "))
}

const fn short(demand: Demand) -> &'static str {
    match demand {
        Demand::Error => "error",
        Demand::Movement => "movement",
        Demand::Current => "current",
        Demand::Time => "time",
        Demand::Pole => "pole",
        Demand::Answers => "saliency or converter",
    }
}

/// Returns the columns of the table. `rotor` is the state of the rotor if only one state was judged.
fn columns_of_check(rotor: Option<Rotor>) -> [Column; 7] {
    let loose = rotor.filter(|rotor| *rotor != Rotor::Locked).unwrap_or(Rotor::Free);
    [
        Column::word("method"),
        Column::number("p95 ° locked"),
        Column::number(format!("p95 ° {}", loose.name())).rank(1),
        Column::number("ms").rank(3),
        Column::number("peak A").rank(1),
        Column::number("moved °").rank(2),
        Column::prose("verdict").judged(),
    ]
}

fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { format!("{value:.digits$}") } else { "–".to_owned() }
}

fn cells(candidate: &Candidate) -> (Tone, Vec<String>) {
    let (locked, free) = (&candidate.locked, &candidate.free);
    let tone = if candidate.objections.is_empty() { Tone::Good } else { Tone::Bad };
    let cells = vec![
        candidate.method().name().to_owned(),
        locked.p95_deg.alone(),
        free.p95_deg.alone(),
        milliseconds(free.mean_duration_s),
        amperes(locked.peak_current_a.max(free.peak_current_a)),
        if free.trials > 0 { number(free.max_moved_deg, 2) } else { "–".to_owned() },
        verdict(candidate),
    ];
    (tone, cells)
}

/// Returns the relevant settings by name. Settings of the polarity test are included only if the motor's poles are
/// known.
pub fn settings(method: &Method<f64>, has_poles: bool) -> Vec<(&'static str, String)> {
    let mut all = Vec::new();
    method.describe(&mut |name, value| all.push((name, value.to_string())));
    all.retain(|(name, _)| has_poles || !(name.starts_with("polarity") || *name == "signature"));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shell::table::Print as _;

    #[test]
    fn law_the_free_column_has_the_name_of_the_state_that_is_judged() {
        let heads = |rotor| Table::new(columns_of_check(rotor)).judged([]).within(140, false);
        assert!(
            heads(Some(Rotor::Brake)).contains("p95 ° brake")
                && heads(Some(Rotor::Locked)).contains("p95 ° free")
        );
    }

    #[test]
    fn regress_what_decides_stays_where_there_is_little_room() {
        let cells =
            ["maximum-likelihood-adaptive", "0.08", "0.09", "7.5", "60", "0.12", "suited; current binds"];
        let row = || std::iter::once((Tone::Good, cells.map(str::to_owned).to_vec()));
        let said = |columns: usize| Table::new(columns_of_check(None)).judged(row()).within(columns, false);
        for name in ["p95 ° locked", "p95 ° free", "ms", "peak A", "moved °"] {
            assert!(said(140).contains(name), "{}", said(140));
        }
        let narrow = said(80);
        // Headings may stand in several lines.
        assert!(narrow.contains("free") && narrow.contains("peak") && !narrow.contains(" ms "), "{narrow}");
    }
}
