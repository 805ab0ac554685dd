//! The program, as its users have it: what `check` prints, and the command that it prints next.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;
use standstill_analysis::{Effort, Suited};
use standstill_interface::Choice;

use crate::{Case, Error};

/// The program `standstill`, and a folder in which it works.
pub struct Program {
    path: PathBuf,
    folder: tempfile::TempDir,
}

/// What `check` says of a motor.
pub struct Checked {
    pub suited: Suited,
    /// The verdict, with its condition.
    pub verdict: String,
    /// Smallest and largest saturation of the condition.
    pub saturation: Option<[f64; 2]>,
    /// Whether poles were judged, of a motor that has any.
    pub judges_poles: bool,
    /// The recommended keys of the detector.
    pub recommended: Option<Vec<(String, String)>>,
    /// Largest allowed phase current in A.
    pub most_current_a: f64,
    /// The changes that help.
    pub helps: Vec<String>,
    pub untried: Vec<String>,
    /// The commands that it prints at its end.
    pub next: Vec<String>,
    /// Processor time in s.
    pub seconds: f64,
}

impl Program {
    /// The program of the same build, or that which `STANDSTILL` names.
    pub fn beside() -> Result<Self, Error> {
        let own = std::env::current_exe()?;
        let beside =
            own.parent().and_then(|examples| examples.parent()).map(|folder| folder.join("standstill"));
        let path =
            std::env::var_os("STANDSTILL").map(PathBuf::from).or(beside).ok_or("no folder of the build")?;
        if !path.is_file() {
            return Err(format!(
                "{}: not there; `cargo build --release --bin standstill` makes it",
                path.display()
            )
            .into());
        }
        Ok(Self { path: std::path::absolute(path)?, folder: tempfile::tempdir()? })
    }

    /// What it prints as JSON.
    fn json(&self, words: &[String]) -> Result<Value, Error> {
        let output =
            Command::new(&self.path).args(words).arg("--json").current_dir(self.folder.path()).output()?;
        // 0: all is well; 1: demands are not met. Else there is no answer.
        if !matches!(output.status.code(), Some(0 | 1)) {
            return Err(format!(
                "standstill {}: {}",
                words.join(" "),
                String::from_utf8_lossy(&output.stderr)
            )
            .into());
        }
        Ok(serde_json::from_slice(&output.stdout)?)
    }

    /// `standstill check`.
    pub fn check(&self, case: &Case, effort: Effort) -> Result<Checked, Error> {
        let mut words = vec!["check".to_owned(), case.sheet.display().to_string()];
        if case.errors != standstill_scenario::ErrorSet::default() {
            words.extend(["--errors".to_owned(), case.errors.name().to_owned()]);
        }
        if effort != Effort::Normal {
            words.extend(["--effort".to_owned(), effort.name().to_owned()]);
        }
        for (key, value) in &case.keys {
            words.extend(["-s".to_owned(), format!("{key}={value}")]);
        }
        let began = processor_seconds();
        let answer = self.json(&words)?;
        let seconds = processor_seconds() - began;
        let texts = |of: &Value| -> Vec<String> {
            let all = of.as_array().into_iter().flatten();
            all.filter_map(|text| text.as_str().map(str::to_owned)).collect()
        };
        let number = |of: &Value| of.as_f64().ok_or("a number is missing");
        let suited = answer["verdict"].as_str().and_then(Suited::named).ok_or("no verdict")?;
        let condition = &answer["condition"];
        let saturation = match condition["kind"].as_str() {
            Some("saturation") => Some([number(&condition["least"])?, number(&condition["most"])?]),
            _ => None,
        };
        let verdict = match (saturation, condition.is_null()) {
            (Some([least, most]), _) => {
                format!("suited if saturation is {:.2} to {:.0} %", 100.0 * least, 100.0 * most)
            }
            (None, false) if suited == Suited::If => "axis only".to_owned(),
            _ => suited.name().replace('-', " "),
        };
        let advice = answer["advice"].as_array().into_iter().flatten();
        let keys = answer["recommended"]["keys"].as_object();
        Ok(Checked {
            suited,
            verdict,
            saturation,
            judges_poles: answer["pole_judged"] == true,
            recommended: keys.map(|keys| {
                keys.iter()
                    .filter_map(|(key, value)| Some((key.clone(), value.as_str()?.to_owned())))
                    .collect()
            }),
            most_current_a: number(&answer["demands"]["current_A"])?,
            helps: advice
                .filter(|advice| !advice["keys"].is_null())
                .filter_map(|advice| advice["change"].as_str().map(str::to_owned))
                .collect(),
            untried: texts(&answer["untried"]),
            next: texts(&answer["next"]),
            seconds,
        })
    }

    /// Carries out the command that `check` prints next. Returns it, and what came of it; none if it did not do what it is printed for.
    pub fn go_on(&self, checked: &Checked) -> Result<(String, Option<String>), Error> {
        // After the first line of "once the saturation is measured", which has a gap for the number, that with the settings.
        let next = checked.next.iter().find(|command| !command.contains('…')).ok_or("no next command")?;
        let words = words(next)?;
        let then = match words.first().map(String::as_str) {
            Some("check") => {
                let verdict = self.json(&words)?["verdict"].as_str().unwrap_or_default().to_owned();
                let helps = !checked.helps.is_empty();
                (!helps || verdict.starts_with("suited")).then_some(verdict)
            }
            Some("run") => {
                let mut words = words.clone();
                words.extend(["--trials", "200", "--force"].map(str::to_owned));
                let axes = &self.json(&words)?["summary"]["axes"];
                axes.as_u64().filter(|axes| *axes > 100).map(|axes| format!("{axes} of 200 with an axis"))
            }
            Some("bounds") => self.json(&words).ok().map(|_| "prints".to_owned()),
            _ => None,
        };
        Ok((next.clone(), then))
    }
}

/// The words of a command line of this program, without its name.
fn words(command: &str) -> Result<Vec<String>, Error> {
    let (mut all, mut word, mut quote) = (Vec::new(), String::new(), None);
    for letter in command.chars().chain([' ']) {
        match quote {
            Some(end) if letter == end => quote = None,
            None if letter == '"' || letter == '\'' => quote = Some(letter),
            None if letter == ' ' => {
                if !word.is_empty() {
                    all.push(std::mem::take(&mut word));
                }
            }
            _ => word.push(letter),
        }
    }
    if all.first().is_none_or(|name| name != "standstill") {
        return Err(format!("no command of the program: {command}").into());
    }
    all.remove(0);
    Ok(all)
}

/// Processor time of the programs that this process has waited for, in s, on Linux: fields 16 and 17 of `/proc/self/stat`, in hundredths.
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace().skip(13).take(2);
    fields.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}
