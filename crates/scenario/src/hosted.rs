//! A detector inside the running program, such as a Python class: the key `detector.python`.

use std::fmt;
use std::sync::Arc;

use standstill_detect::Nameplate;
use standstill_interface::{Detector, Fault, Findings, Outcome, Own, Step};
use standstill_sim::{Ended, SensorSettings};
use toml::Value;

use super::document::{Document, FileError, Origin};
use super::keys::{DetectorTable, Table};
use crate::Record;

/// Key under which the record of a run stores the name of the detector's class.
const KEY: &str = "detector.python";

/// Origin of the key's value: the argument of the Python function.
const ARGUMENT: Origin = Origin::Option("the argument `detector`");

/// Keys of `[detector]` that have an effect on a Python class: the class name, the settings, two values of the nameplate, and the time
/// limit.
const REACHING: [&str; 5] =
    [KEY, "detector.config", "detector.signature", "detector.dead_time", "detector.time_limit"];

/// Fault of a detection that ended with [`gave_up`]. The highest fault codes are reserved for the test bench.
const GAVE_UP: Own = Own { code: u32::MAX - 3, text: "the detector's program raised an error" };

/// Factory of detectors that the running program provides, such as a Python class.
pub trait Provider: fmt::Debug + Send + Sync {
    /// Makes the detector of the trial with number `trial`. `seed` is the seed for the detector's own random numbers. It is drawn from the
    /// random numbers of the trial.
    fn detector(&self, given: &Arc<Given>, seed: u64, trial: u64) -> Box<dyn Detector<f64>>;
}

/// Data that a detector of the running program receives when it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// Nameplate: the data of motor, inverter and sensors that the drive knows.
    pub nameplate: Nameplate<f64>,
    /// The drive's sensors and their converters.
    pub sensors: SensorSettings,
    /// The keys of `detector.config` with their values.
    pub config: Vec<(String, Value)>,
}

/// A provider of detectors, with the data that its detectors receive in a scenario.
#[derive(Clone, Debug)]
pub struct Hosted {
    pub(crate) provider: Arc<dyn Provider>,
    pub(crate) given: Arc<Given>,
}

impl PartialEq for Hosted {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.provider, &other.provider) && self.given == other.given
    }
}

/// Returns the last step of a detector whose program has raised an error. With this step the detection fails, and the record of the trial
/// is void, see [`Record::is_void`].
pub fn gave_up() -> Step<f64> {
    Step::Done(Outcome::Failed { fault: Fault::Own(GAVE_UP), findings: Findings::default() })
}

impl Record {
    /// Returns true if the trial has no result because the detector's last step was [`gave_up`].
    pub fn is_void(&self) -> bool {
        // The text is compared too: a fault of a library may have the same code.
        matches!(&self.run.ended, Ended::Outcome(Outcome::Failed { fault: Fault::Own(own), .. }) if *own == GAVE_UP)
    }
}

impl Document {
    /// Sets a class of the running program as the detector. `class` is the name of the class in the record of the run:
    /// `module.Class@digest`.
    ///
    /// ```
    /// use standstill_interface::Detector;
    /// use standstill_scenario::{Document, Given, Provider, gave_up};
    /// use std::sync::Arc;
    ///
    /// #[derive(Debug)]
    /// struct Lines;
    /// impl Detector<f64> for Lines {
    ///     fn step(&mut self, _: &[standstill_interface::Reading<f64>]) -> standstill_interface::Step<f64> {
    ///         gave_up()
    ///     }
    /// }
    /// impl Provider for Lines {
    ///     fn detector(&self, _: &Arc<Given>, _seed: u64, _trial: u64) -> Box<dyn Detector<f64>> {
    ///         Box::new(Lines)
    ///     }
    /// }
    /// let mut document = Document::parse("s.toml".as_ref(), "[detector]\npython = \"own.Lines@1\"")?;
    /// document.host("own.Lines@1", &(Arc::new(Lines) as Arc<dyn Provider>))?;
    /// let refused = document.host("own.Lines@2", &(Arc::new(Lines) as Arc<dyn Provider>)).unwrap_err().to_string();
    /// assert!(refused.contains("found \"own.Lines@1\", needed \"own.Lines@2\""), "{refused}");
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    ///
    /// # Errors
    /// The scenario records another class, or another version of this class.
    pub fn host(&mut self, class: &str, provider: &Arc<dyn Provider>) -> Result<(), FileError> {
        if let Some(there) = self.get(KEY)
            && there.as_str() != Some(class)
        {
            let needed =
                format!("\"{class}\", the class of the argument `detector` as it is now, or no such key");
            return Err(self.refuse(KEY, &there.to_string(), &needed));
        }
        self.set_value(KEY, class.into(), ARGUMENT)?;
        self.hosted = Some(Arc::clone(provider));
        Ok(())
    }
}

impl DetectorTable {
    /// Returns the provider of the class that `detector.python` names. Returns none if the detector is a method or a library. `hosted` is
    /// the provider of the running program, if the program has one.
    ///
    /// # Errors
    /// The program does not provide the class, or the file sets a key of `[detector]` that has no effect on the class.
    pub(super) fn provider<'a>(
        &self,
        hosted: Option<&'a Arc<dyn Provider>>,
    ) -> Result<Option<&'a Arc<dyn Provider>>, FileError> {
        let Some(class) = &self.python else { return Ok(None) };
        let Some(provider) = hosted else {
            let found = format!("\"{class}\", a class that this run does not have");
            let name = self.name().rsplit('.').next().unwrap_or_default();
            let needed = format!(
                "`standstill.run(scenario, detector={name})` in Python, or no such key: then `detector.method` counts"
            );
            return Err(FileError::key(KEY, &found, &needed));
        };
        let other = self.set_values().find(|(key, _)| !REACHING.contains(&key.path));
        if let Some((key, _)) = other {
            let found =
                format!("a setting that does not reach the class {} (the argument `detector`)", self.name());
            let needed = "either a method's table [detector] or the argument; beside it only `config`, `signature`, `dead_time` and `time_limit`";
            return Err(FileError::key(key.path, &found, needed));
        }
        Ok(Some(provider))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Mutex;

    use standstill_interface::Reading;

    use super::*;
    use crate::Plan;

    #[test]
    fn law_a_class_is_given_the_drives_data_its_settings_and_a_seed() {
        let text = "trials = 3\n[detector]\nsignature = \"inverted\"\nconfig = { gain = 2, name = \"a\" }\n\
            [axes]\n\"detector.config.gain\" = [2, 3]\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }";
        let mut document = Document::parse(Path::new("s.toml"), text).expect("TOML");
        let sees = Arc::new(Sees::default());
        document.host("own.Lines@1", &(Arc::clone(&sees) as Arc<dyn Provider>)).expect("no other class");
        let plan = Plan::new(document).expect("valid");
        assert!(sees.0.lock().expect("no panic").is_empty(), "no detector is made before the first trial");
        for point in 0..2 {
            let single = plan.single(point, 1).expect("a trial").scenario;
            let nominal = plan.scenario(point).expect("valid");
            assert!(nominal.trial(1).expect("no settings").is_void());
            // The drawn motor differs from the nameplate that the detector receives.
            assert_ne!(single.motor.resistance, nominal.motor.resistance);
            assert!(single.trial(1).expect("no settings").is_void());
        }
        let seen = sees.0.lock().expect("no panic");
        assert_eq!(seen.iter().map(|(_, _, trial)| *trial).collect::<Vec<_>>(), [1; 4]);
        assert!(seen.iter().all(|(_, seed, _)| *seed == seen[0].1 && *seed > u64::from(u32::MAX)));
        let gain = |k: usize| seen[k].0.config[0].1.as_integer();
        assert_eq!([0, 1, 2, 3].map(gain), [Some(2), Some(2), Some(3), Some(3)]);
        assert_eq!(seen[0].0, seen[1].0);
        assert_eq!(seen[0].0.nameplate.signature, standstill_detect::Signature::Inverted);
        assert_eq!(seen[0].0.nameplate.dc_link, 550.0);
    }

    /// A provider that stores the data it receives; its detectors end at once.
    #[derive(Debug, Default)]
    struct Sees(Mutex<Vec<(Arc<Given>, u64, u64)>>);

    struct Ends;

    impl Detector<f64> for Ends {
        fn step(&mut self, _: &[Reading<f64>]) -> Step<f64> {
            gave_up()
        }
    }

    impl Provider for Sees {
        fn detector(&self, given: &Arc<Given>, seed: u64, trial: u64) -> Box<dyn Detector<f64>> {
            self.0.lock().expect("no panic").push((Arc::clone(given), seed, trial));
            Box::new(Ends)
        }
    }

    fn hosted(text: &str) -> Result<Plan, FileError> {
        let mut document = Document::parse(Path::new("s.toml"), text)?;
        document.host("own.Lines@1", &(Arc::new(Sees::default()) as Arc<dyn Provider>))?;
        Plan::new(document)
    }

    /// Once, the record named the method `bipolar`, and repeating the run used this method.
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
            ("library", "\"mine.so\""),
            ("call_timeout", "1"),
        ] {
            let error =
                hosted(&format!("trials = 3\n[detector]\n{key} = {value}")).expect_err(key).to_string();
            let place = format!(
                "s.toml: line 3: `detector.{key}`: found a setting that does not reach the class own.Lines"
            );
            assert!(error.starts_with(&place), "{error}");
        }
        // Nor as an axis.
        let error =
            hosted("[axes]\n\"detector.pulse\" = [\"40 us\", \"80 us\"]").expect_err("no such setting");
        assert!(error.to_string().contains("does not reach the class own.Lines"), "{error}");
        let error =
            hosted("[axes]\n\"detector.python\" = [\"a\", \"b\"]").expect_err("one class").to_string();
        assert!(error.contains("`axes.detector.python`: found a key of the run itself"), "{error}");
    }
}
