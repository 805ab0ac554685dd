//! Command lines for the page's settings: they compute the same numbers.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::setting::Setting;

/// Name of a setting's scenario on a command line.
pub(crate) struct Written {
    pub file: Option<PathBuf>,
    pub keys: Vec<(String, String)>,
}

/// Name under which the page's scenario is saved if it has no file.
pub(crate) const SAVED: &str = "scenario.toml";

/// Returns a word in quotes if a shell would change it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:%+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Returns the command line of `standstill trace` with these keys, for one trial.
pub(crate) fn trace(
    written: &Written,
    setting: &Setting,
    method: &str,
    trial: u64,
    angle: Option<f64>,
) -> String {
    let mut words = vec!["standstill".to_owned(), "trace".to_owned()];
    words.extend(written.file.as_ref().map(|file| quoted(&file.display().to_string())));
    let names_method = setting.set.contains_key("detector.method")
        || written.keys.iter().any(|(key, _)| key == "detector.method");
    // Without a scenario, `trace` shows the paper's method unless another one is set.
    if written.file.is_none() && !names_method {
        words.extend(["-s".to_owned(), quoted(&format!("detector.method={method}"))]);
    }
    words.extend(keys(written, setting));
    if setting.point > 0 {
        words.extend(["--point".to_owned(), setting.point.to_string()]);
    }
    words.extend(["--trial".to_owned(), trial.to_string()]);
    words.extend(angle.into_iter().flat_map(|angle| ["--angle".to_owned(), angle.to_string()]));
    words.extend(["--out".to_owned(), "standstill-out/trace".to_owned()]);
    words.join(" ")
}

/// Returns the command line of `standstill run` for many trials; a scenario without file must be saved as [`SAVED`]
/// first.
pub(crate) fn run(written: &Written, setting: &Setting, trials: u64) -> String {
    let mut words = vec!["standstill".to_owned(), "run".to_owned()];
    match &written.file {
        Some(file) => {
            words.push(quoted(&file.display().to_string()));
            words.extend(keys(written, setting));
        }
        None => words.push(SAVED.to_owned()),
    }
    words.extend(["--trials".to_owned(), trials.to_string()]);
    words.join(" ")
}

/// `standstill convert` of these numbers.
pub(crate) fn convert(numbers: &BTreeMap<String, String>) -> String {
    let numbers = numbers.iter().map(|(key, value)| quoted(&format!("{key}={value}")));
    ["standstill".to_owned(), "convert".to_owned()].into_iter().chain(numbers).collect::<Vec<_>>().join(" ")
}

fn keys(written: &Written, setting: &Setting) -> Vec<String> {
    let given = written.keys.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    // What the page sets comes last, and so it counts.
    given
        .chain(setting.in_order())
        .flat_map(|(key, value)| ["-s".to_owned(), quoted(&format!("{key}={value}"))])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_command_lines_survive_a_shell() {
        let set = [("sensors.noise", "20 mA"), ("motor", "ma'in"), ("errors", "harsh")];
        let setting = Setting {
            set: set.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect(),
            ..Setting::default()
        };
        let none = Written { file: None, keys: Vec::new() };
        assert_eq!(
            trace(&none, &setting, "bipolar", 7, Some(43.2)),
            "standstill trace -s detector.method=bipolar -s 'motor=ma'\\''in' -s errors=harsh -s 'sensors.noise=20 mA' \
             --trial 7 --angle 43.2 --out standstill-out/trace"
        );
        let file = Written { file: Some("a b.toml".into()), keys: vec![("seed".to_owned(), "3".to_owned())] };
        assert!(
            trace(&file, &setting, "bipolar", 0, None)
                .starts_with("standstill trace 'a b.toml' -s seed=3 -s 'motor=")
        );
        assert_eq!(run(&none, &setting, 500), "standstill run scenario.toml --trials 500");
    }
}
