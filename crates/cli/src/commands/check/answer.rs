//! The answer of `check` as JSON, and the commands that are possible next.

use serde_json::{Map, Value, json};
use standstill_analysis::{
    Advice, Candidate, Condition, Demand, Demands, Effort, Setting, Suited, Wanting, most_work,
};

use super::checked::Checked;
use super::file::Written;
use super::words::{estimate_beyond, settings};
use crate::shell::command_line::{self, quoted};

/// Returns the lines on the next steps, with command lines; `written`: the scenario file that was written, if any.
pub fn next(asked: &Checked<'_>, written: Option<&Written>) -> Vec<String> {
    let found = asked.found;
    let mut lines = Vec::new();
    if !asked.meant.is_empty() {
        let keys = asked.keys.iter().filter(|(key, _)| !asked.meant.iter().any(|(other, _)| other == key));
        let keys = keys.chain(asked.meant).cloned().collect();
        lines.extend([
            "If the doubtful number is a slip:".to_owned(),
            again(&Checked { keys, ..*asked }, &[], asked.demands, asked.effort),
        ]);
    }
    if found.recommended().is_none() {
        lines.extend((!lines.is_empty()).then(String::new));
        lines.extend(unsuited(asked));
        return lines;
    }
    if let Some(fall) = estimate_beyond(asked) {
        let key = ("motor.nameplate.saturation", format!("{:.0} %", 100.0 * fall));
        lines.extend([
            String::new(),
            "At the estimated saturation alone:".to_owned(),
            again(asked, &[key], asked.demands, asked.effort),
        ]);
    }
    if matches!(found.condition, Some(Condition::Saturation { .. })) {
        lines.extend([
            String::new(),
            "Once the saturation is measured:".to_owned(),
            format!(
                "{} -s \"motor.nameplate.saturation=… %\"",
                again(asked, &[], asked.demands, asked.effort)
            ),
        ]);
    }
    lines.push(String::new());
    match written {
        Some(Written::Done(path)) => {
            lines.push(format!("{} has these settings. Go on with", path.display()));
            lines.push(format!("  standstill run {}", path.display()));
        }
        Some(Written::Failed(why)) => {
            lines.push(format!("No scenario is written: {why}. Go on with"));
            lines.push(in_a_line(asked));
        }
        Some(Written::InTheWay(path)) => {
            let path = path.display();
            lines.push(format!(
                "{path} is there already and says something else: it stays. --force replaces it, --write FILE"
            ));
            lines.push("names another. Or go on with".to_owned());
            lines.push(in_a_line(asked));
        }
        None => {
            lines.push("Go on with".to_owned());
            lines.push(in_a_line(asked));
        }
    }
    if !found.untried.is_empty() {
        lines.extend(["Or try what was not tried:".to_owned(), further(asked)]);
    }
    lines
}

/// Returns the lines on the next steps for a motor that no tried settings suit: commands with a change that helps, another way to start,
/// more starts, more effort, or settings that the user no longer fixes. If there is none of these, `bounds`.
fn unsuited(asked: &Checked<'_>) -> Vec<String> {
    let found = asked.found;
    let helps = found.advice.iter().filter(|advice| advice.helps.is_some());
    let mut commands: Vec<String> = helps.map(|advice| changed(asked, advice)).collect();
    commands.extend(found.alternatives.iter().map(|other| with_settings(asked, &other.setting, &[])));
    if let Some((open, Wanting { starts, seed })) = found.open().and_then(|open| Some((open, open.wanting?)))
    {
        commands
            .push(format!("{} --trials {starts} --seed {seed}", with_settings(asked, &open.setting, &[])));
    }
    if !found.untried.is_empty() {
        commands.push(further(asked));
    }
    // Settings that the user fixed were not searched.
    let is_fixed = |key: &str| key.starts_with("detector.") && key != "detector.method";
    let (fixed, keys): (Vec<_>, Vec<_>) = asked.keys.iter().cloned().partition(|(key, _)| is_fixed(key));
    if !fixed.is_empty() {
        let free = again(&Checked { keys, ..*asked }, &[], asked.demands, asked.effort);
        if !commands.contains(&free) {
            commands.push(free);
        }
    }
    let mut head = "Go on with one of";
    if commands.is_empty() {
        head = "No change that was tried suffices. The Cramér–Rao limit of a method's pulses with these sensors:";
        commands.push(format!(
            "  standstill bounds {}{}",
            quoted(asked.named),
            set(&without_detector(&asked.keys))
        ));
    } else if commands.len() == 1 {
        head = "Go on with";
    }
    std::iter::once(head.to_owned()).chain(commands).collect()
}

/// Returns the command line of this `check` with one of the changes that were tried.
fn changed(asked: &Checked<'_>, advice: &Advice) -> String {
    // Settings that the change frees are left out of the command's options. Settings in a file remain.
    let is_freed = |key: &str| advice.frees.iter().any(|freed| key.strip_prefix("detector.") == Some(freed));
    let keys = asked.keys.iter().filter(|(key, _)| !is_freed(key)).cloned().collect();
    let asked = &Checked { keys, ..*asked };
    again(asked, &advice.keys, advice.demands.as_ref().unwrap_or(asked.demands), asked.effort)
}

/// Returns the command line of this `check` with more effort. If there is no more, returns the command line that checks
/// only the method that came nearest.
fn further(asked: &Checked<'_>) -> String {
    let more = asked.effort.deeper().unwrap_or(asked.effort);
    let worst = |candidate: &&Candidate| candidate.margins.map_or(0.0, |margins| margins.binding().1);
    let nearest = asked.found.candidates.iter().max_by(|a, b| worst(a).total_cmp(&worst(b)));
    let keys: Vec<_> = nearest
        .filter(|_| asked.effort == more)
        .map(|candidate| ("detector.method", candidate.method().name().to_owned()))
        .into_iter()
        .collect();
    again(asked, &keys, asked.demands, more)
}

/// Returns the command line of this `check` with other demands, and with additional keys, which replace the same keys of the user.
fn again(asked: &Checked<'_>, keys: &[(&'static str, String)], demands: &Demands, effort: Effort) -> String {
    let kept = asked.keys.iter().filter(|(key, _)| !keys.iter().any(|(other, _)| other == key)).cloned();
    let all: Vec<_> =
        kept.chain(keys.iter().map(|(key, value)| ((*key).to_owned(), value.clone()))).collect();
    let effort = match effort {
        Effort::Normal => String::new(),
        other => format!(" --effort {}", other.name()),
    };
    format!("  standstill check {}{}{}{effort}", quoted(asked.named), set(&all), options(demands))
}

/// Returns the options for the demands that differ from the defaults.
fn options(demands: &Demands) -> String {
    let usual = Demands::DEFAULT;
    let differing = |name: &str, value: f64, usual: f64| {
        if value == usual { String::new() } else { format!(" {name} {value}") }
    };
    let milliseconds = |seconds: f64| standstill_quantity::rounded(1e3 * seconds, 6);
    let current = demands.current_a.map_or_else(String::new, |current| format!(" --current {current}"));
    differing("--tolerance", demands.error_deg, usual.error_deg)
        + &differing("--movement", demands.movement_deg, usual.movement_deg)
        + &differing("--time", milliseconds(demands.time_s), milliseconds(usual.time_s))
        + &current
}

/// Returns the keys that do not belong to the detector.
fn without_detector(keys: &[(String, String)]) -> Vec<(String, String)> {
    keys.iter().filter(|(key, _)| !key.starts_with("detector.")).cloned().collect()
}

/// Returns the command line that runs the recommended settings, given as options instead of in a scenario file.
fn in_a_line(asked: &Checked<'_>) -> String {
    let saturation = match &asked.found.condition {
        Some(Condition::Saturation { least, .. }) => {
            vec![("motor.nameplate.saturation", format!("{} %", standstill_quantity::rounded(*least, 2)))]
        }
        _ => Vec::new(),
    };
    let recommended = asked.found.recommended();
    recommended.map_or_else(String::new, |candidate| with_settings(asked, &candidate.setting, &saturation))
}

/// Returns the command line that runs these settings, with a free rotor unless the user asked for another state.
fn with_settings(asked: &Checked<'_>, setting: &Setting, more: &[(&'static str, String)]) -> String {
    let mut all = asked.keys.clone();
    if !all.iter().any(|(key, _)| key == "rotor.state") {
        all.push(("rotor.state".to_owned(), "free".to_owned()));
    }
    let own = more.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
    let own: Vec<_> = own.chain(setting.in_scenario()).collect();
    all.retain(|(key, _)| !own.iter().any(|(other, _)| other == key));
    all.extend(own);
    format!("  standstill run {}{}", quoted(asked.named), set(&all))
}

/// Formats keys as options of a command line.
fn set(keys: &[(String, String)]) -> String {
    keys.iter().map(|(key, value)| command_line::set(key, value)).collect()
}

fn object(setting: &Setting) -> Value {
    let keys = setting.in_scenario().into_iter().map(|(key, value)| (key, value.into()));
    keys.collect::<Map<String, Value>>().into()
}

/// Returns the whole answer as JSON.
pub fn json(asked: &Checked<'_>, written: Option<&Written>, next: &[String]) -> Value {
    let found = asked.found;
    let has_poles = found.has_magnet && !found.pole_is_open();
    let margins = |candidate: &Candidate| {
        let all = candidate.margins?.all().into_iter().filter(|(_, margin)| margin.is_finite());
        Some(
            all.map(|(demand, margin)| (demand.name().to_owned(), margin.into()))
                .collect::<Map<String, Value>>(),
        )
    };
    let candidates: Vec<Value> = found
        .candidates
        .iter()
        .map(|candidate| {
            json!({
                "method": candidate.method().name(),
                "keys": object(&candidate.setting),
                "suited": candidate.objections.is_empty(),
                "objections": candidate.objections,
                "binding": candidate.binding.map(Demand::name),
                "margin": candidate.margin(),
                "margins": margins(candidate),
                "settings_tried": candidate.looks,
                "locked": candidate.locked,
                "free": candidate.free,
            })
        })
        .collect();
    let recommended = found.recommended().zip(found.confirmed()).map(|(candidate, fresh)| {
        let settings: Map<String, Value> = settings(&candidate.settings, has_poles)
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value.into()))
            .collect();
        let mut confirmed = json!(fresh);
        confirmed["wrong_poles_by"] =
            if fresh.counted.is_some() { "count" } else { "normal evidence" }.into();
        json!({
            "method": candidate.method().name(),
            "keys": object(&candidate.setting),
            "margin": candidate.margin(),
            "binding": candidate.binding.map(Demand::name),
            "settings": settings,
            "confirmed": confirmed,
        })
    });
    let turning = found.turning.map(|speeds| {
        let mut turning = json!(speeds);
        turning["notices_in_time"] = speeds.notices_in_time().into();
        turning
    });
    let condition = found.condition.as_ref().map(|condition| match condition {
        Condition::Saturation { least, most, minus_d } => {
            json!({ "kind": "saturation", "least": least, "most": most, "minus_d": minus_d, "q": 0.0 })
        }
        Condition::Pole => json!({ "kind": "pole" }),
    });
    let left_out: Vec<Value> =
        found.left_out.iter().map(|of| json!({ "method": of.method.name(), "lacks": of.lacks })).collect();
    let advice: Vec<Value> = found
        .advice
        .iter()
        .map(|advice| {
            let keys = advice.helps.as_ref().map(object);
            json!({ "change": advice.change, "command": changed(asked, advice).trim(), "keys": keys, "frees": advice.frees })
        })
        .collect();
    let alternatives: Vec<Value> = found
        .alternatives
        .iter()
        .map(|of| json!({ "way": of.way.name(), "keys": object(&of.setting), "starts": of.starts }))
        .collect();
    let commands: Vec<&str> = next.iter().filter_map(|line| line.strip_prefix("  ")).collect();
    json!({
        "motor": asked.motor.name,
        "errors": asked.errors.name(),
        "verdict": found.suited().name(),
        "suited": found.suited() == Suited::Yes,
        "condition": condition,
        "pole_judged": !found.pole_is_open(),
        "pole": found.pole,
        "reasons": asked.reasons(),
        "doubts": (!asked.doubts.is_empty()).then(|| asked.doubts.join("; ")),
        "demands": Demands { current_a: Some(found.most_current_a), ..*asked.demands },
        "saliency_ratio": found.saliency_ratio,
        "limit_deg": found.limit.map(|bound| bound.scheme_deg),
        "limit_on_a_specimen_deg": found.limit.and_then(|bound| bound.hybrid_deg),
        "polarity_difference": found.polarity_difference,
        "pulse_polarity_difference": found.pulse_difference,
        "poles_alike_up_to_A": found.alike_up_to_a,
        "candidates": candidates,
        "left_out": left_out,
        "recommended": recommended,
        "turning": turning,
        "advice": advice,
        "alternatives": alternatives,
        "untried": found.untried,
        "work": { "done": found.work, "of": most_work(asked.effort) },
        "scenario": written.and_then(Written::path).map(|path| path.display().to_string()),
        "next": commands,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_analysis::Suitability;
    use standstill_scenario::{Document, ErrorSet};

    use super::*;

    /// The estimate of this motor is 25 %.
    #[test]
    fn regress_an_estimate_beyond_the_range_is_judged_by_a_command() {
        let text = "errors = \"none\"\ndetector.method = \"bipolar\"\nmotor.nameplate = { pole_pairs = 7, resistance = \"21 mΩ\", L_d = \"16 uH\", L_q = \"20 uH\", rated_current = \"60 A\", magnet_flux = \"5.2 mWb\", dc_link = \"48 V\" }\n";
        let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
        let (motor, sheet) = (document.motor().expect("a motor"), document.data_sheet().expect("a sheet"));
        let demands = Demands::default();
        let found = Suitability::of(&document, &demands, Effort::Quick, |_| {}).expect("judged");
        let commands = |most: f64| {
            let condition = Some(Condition::Saturation { least: 0.02, most, minus_d: -0.01 });
            let found = &Suitability { condition, ..found.clone() };
            let asked = Checked {
                motor: &motor,
                named: "s.toml",
                errors: ErrorSet::None,
                sheet: &sheet,
                demands: &demands,
                effort: Effort::Normal,
                found,
                signature: None,
                doubts: &[],
                meant: &[],
                keys: Vec::new(),
            };
            next(&asked, None)
        };
        let alone = "  standstill check s.toml -s 'motor.nameplate.saturation=25 %'".to_owned();
        assert!(commands(0.15).contains(&alone), "{:?}", commands(0.15));
        assert!(!commands(0.26).contains(&alone), "{:?}", commands(0.26));
    }
}
