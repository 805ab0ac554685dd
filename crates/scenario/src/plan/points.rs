//! Checks the points of a plan before the first trial.

use super::{Note, Plan, WatchPoints};
use crate::Scenario;
use crate::document::FileError;

/// Number of points between two calls of the function that watches the check.
const AT_A_TIME: usize = 64;

impl Plan {
    /// Makes the scenario of each point, so that an error at any point is reported now, and collects the remarks on the motors.
    pub(super) fn check_points(&mut self, watch: WatchPoints<'_>) -> Result<(), FileError> {
        let count = self.points.len();
        for number in 0..count {
            if number % AT_A_TIME == 0 {
                watch(number, count)?;
            }
            let Scenario { motor, foreign, .. } = self.scenario(number)?;
            self.notes[Note::Libraries as usize]
                .extend(foreign.and_then(|foreign| foreign.library().shared_note()));
            // A motor that all points share is checked once.
            if number == 0 || self.motor.is_none() {
                self.notes[Note::Maps as usize].extend(motor.map_note());
                let doubt = motor.doubtful().map(|doubt| format!("{}: {}", motor.name, doubt.said()));
                self.notes[Note::Numbers as usize].extend(doubt);
                if motor.has_magnet() {
                    self.has_poles = true;
                    let known = motor.pole_knowledge();
                    self.notes[Note::Poles as usize].extend(known.note().map(str::to_owned));
                    self.pole_is_open |= known.is_open();
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::{Document, FileError, Plan};

    #[test]
    fn law_an_error_of_who_watches_ends_the_check_of_the_points() {
        let text = "axes = { \"sensors.noise\" = { from = 0.01, to = 0.03, points = 1000 } }";
        let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
        let mut calls = 0;
        let error = Plan::watched(document.clone(), None, &mut |checked, all| {
            calls += 1;
            assert!(checked == 64 * (calls - 1) && all == 1000);
            if calls < 3 { Ok(()) } else { Err(FileError::key("axes", "too many", "fewer")) }
        })
        .unwrap_err();
        assert!(calls == 3 && error.to_string().contains("found too many, needed fewer"), "{calls}: {error}");
        // A motor that is known is not made anew, and the plan is the same.
        let plan = Plan::new(document.clone()).expect("valid");
        let again = plan.changed(document).expect("valid");
        assert_eq!(again.points().len(), 1000);
        let of = |plan: &Plan| plan.scenario(999).expect("valid").motor.name.clone();
        assert_eq!(of(&again), of(&plan));
    }
}
