//! The text before the first trial of a run.

use std::fmt::Write as _;

use standstill_campaign::store::{Identity, Shard};
use standstill_quantity::count;
use standstill_scenario::{DesignKind, Plan, Point};

use crate::shell::setup::setting;
use crate::shell::terminal::paragraph;
use crate::shell::values::each_once;

/// Returns motor, method, conditions and trials in a few lines.
pub fn text(plan: &Plan, identity: &Identity, shard: Shard) -> String {
    let file = plan.file();
    let mut said = format!("Simulating {}: ", setting(file));
    let trials = |number: u64| {
        if number == 1 { "1 trial".to_owned() } else { format!("{} trials", count(number)) }
    };
    if file.axes.is_empty() {
        said += &trials(identity.trials);
    } else {
        let axes: Vec<String> = match file.design.kind.0 {
            DesignKind::Grid => {
                let value = |point: &Point, key: &String| {
                    let value = point.values.iter().find(|(other, _)| other == key);
                    value.map(|(_, value)| value.to_string()).unwrap_or_default()
                };
                let values = |key| each_once(plan.points().iter().map(|point| value(point, key))).len();
                file.axes.keys().map(|key| format!("{key} ({} values)", values(key))).collect()
            }
            _ => file.axes.keys().cloned().collect(),
        };
        let _ = write!(
            said,
            "{} points over {}, {} at each",
            count(identity.points),
            axes.join(", "),
            trials(identity.trials)
        );
    }
    if !identity.stop_at.is_empty() {
        said += " at most, fewer where stop_at is met";
    }
    if shard != Shard::WHOLE {
        let _ = write!(said, "; of these shard {shard}");
    }
    if plan.has_tolerances() {
        let _ = write!(
            said,
            "; drawn anew each time: {}",
            file.tolerances.keys().cloned().collect::<Vec<_>>().join(", ")
        );
    }
    paragraph("", &said)
}
