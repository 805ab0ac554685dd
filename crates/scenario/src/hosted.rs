//! A detector inside the running program, such as a Python class: the key `detector.python`.

use super::document::{Document, FileError, Origin};
use super::keys::{DetectorTable, Table};

/// Key under which the record of a run stores the name of the detector's class.
const KEY: &str = "detector.python";

/// Origin of the key's value: the argument of the Python function.
const ARGUMENT: Origin = Origin::Option("the argument `detector`");

impl Document {
    /// Makes a class of the running program the detector. `class` is the name of the class in the record of the run:
    /// `module.Class@digest`.
    ///
    /// ```
    /// use standstill_scenario::Document;
    ///
    /// let mut document = Document::parse("s.toml".as_ref(), "[detector]\npython = \"own.Lines@1\"")?;
    /// document.host("own.Lines@1")?;
    /// let refused = document.host("own.Lines@2").unwrap_err().to_string();
    /// assert!(refused.contains("found \"own.Lines@1\", needed \"own.Lines@2\""), "{refused}");
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    ///
    /// # Errors
    /// The scenario records another class, or another version of this class.
    pub fn host(&mut self, class: &str) -> Result<(), FileError> {
        if let Some(there) = self.get(KEY)
            && there.as_str() != Some(class)
        {
            let needed =
                format!("\"{class}\", the class of the argument `detector` as it is now, or no such key");
            return Err(self.refuse(KEY, &there.to_string(), &needed));
        }
        self.set_value(KEY, class.into(), ARGUMENT)?;
        self.hosted = true;
        Ok(())
    }
}

impl DetectorTable {
    /// Returns true if a class is the detector. `hosted`: whether the running program provides the class.
    ///
    /// # Errors
    /// The program does not provide the class, or settings are given with `detector.python` that do not reach the
    /// class.
    pub(super) fn is_hosted(&self, hosted: bool) -> Result<bool, FileError> {
        let Some(class) = &self.python else { return Ok(false) };
        if !hosted {
            let found = format!("\"{class}\", a class that this run does not have");
            let name = self.name().rsplit('.').next().unwrap_or_default();
            let needed = format!(
                "`standstill.run(scenario, detector={name})` in Python, or no such key: then `detector.method` counts"
            );
            return Err(FileError::key(KEY, &found, &needed));
        }
        let other = self.set_values().find(|(key, _)| ![KEY, "detector.time_limit"].contains(&key.path));
        if let Some((key, _)) = other {
            let found =
                format!("a setting that does not reach the class {} (the argument `detector`)", self.name());
            let needed = "either a table [detector] or the argument; beside it only `time_limit`";
            return Err(FileError::key(key.path, &found, needed));
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Plan;

    fn hosted(text: &str) -> Result<Plan, FileError> {
        let mut document = Document::parse(Path::new("s.toml"), text)?;
        document.host("own.Lines@1")?;
        Plan::new(document)
    }

    /// The record named `bipolar`, and repeating it ran that.
    #[test]
    fn regress_a_run_with_a_class_is_recorded_as_one_and_nobody_else_runs_it() {
        let plan = hosted("trials = 3\ndetector.time_limit = 2").expect("valid");
        let text = plan.text().expect("TOML");
        assert!(text.contains("python = \"own.Lines@1\"") && !text.contains("method"), "{text}");
        assert_eq!(plan.file().detector.name(), "own.Lines");
        // The record runs again, with the class.
        assert_eq!(hosted(&text).expect("valid").text().expect("TOML"), text);
        let alone =
            Plan::new(Document::parse(Path::new("r.toml"), &text).expect("TOML")).unwrap_err().to_string();
        assert!(
            alone.contains("`detector.python`: found \"own.Lines@1\", a class that this run does not have"),
            "{alone}"
        );
        assert!(
            alone.starts_with("r.toml: line ") && alone.contains("standstill.run(scenario, detector=Lines)"),
            "{alone}"
        );
    }

    #[test]
    fn law_what_does_not_reach_a_class_is_refused_beside_it() {
        for (key, value) in [
            ("method", "\"bipolar\""),
            ("pulse", "\"80 us\""),
            ("polarity", "\"sequential\""),
            ("signature", "\"normal\""),
            ("dead_time", "\"2 us\""),
            ("library", "\"mine.so\""),
            ("call_timeout", "1"),
            ("config", "{ a = 1 }"),
        ] {
            let error =
                hosted(&format!("trials = 3\n[detector]\n{key} = {value}")).expect_err(key).to_string();
            let place = format!(
                "s.toml: line 3: `detector.{key}`: found a setting that does not reach the class own.Lines"
            );
            assert!(error.starts_with(&place), "{error}");
        }
        // Nor as an axis or a tolerance, of which each would be another class or none.
        for table in [
            "[axes]\n\"detector.pulse\" = [\"40 us\", \"80 us\"]",
            "[tolerances]\n\"detector.dead_time\" = { mean = \"2 us\", uniform = \"1 us\" }",
        ] {
            let error = hosted(table).expect_err(table).to_string();
            assert!(error.contains("does not reach the class own.Lines"), "{error}");
        }
        let error =
            hosted("[axes]\n\"detector.python\" = [\"a\", \"b\"]").expect_err("one class").to_string();
        assert!(error.contains("`axes.detector.python`: found a key of the run itself"), "{error}");
    }
}
