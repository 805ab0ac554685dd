//! States as bytes: parameters, times, and all that the machine was told, which is done again where the bytes are read.

use crate::instance::{Instance, Outcome, Phase, State};
use crate::model::{BASIS, hash};
use crate::past::{Past, bytes};

/// How such bytes begin, with the number of their form.
const BEGIN: [u8; 16] = *b"standstill-fmu:2";

/// A state without its machine: the token of the FMU, the place of the phase among all, whether the clock ticks, the tolerance, when
/// the instance began and where it is, the values of the variables, and whether there is a machine.
type Saved = (String, usize, bool, Option<f64>, [f64; 2], Vec<f64>, bool);

impl Instance {
    /// A state of this instance as bytes.
    ///
    /// # Errors
    /// A state in which a step failed, and too many steps.
    pub fn serialised(&self, state: &State) -> Outcome<Vec<u8>> {
        if state.phase == Phase::Failed {
            return Err("a state as bytes: a step of it failed; needed: a state from before".to_owned());
        }
        let place = Phase::ALL.iter().position(|phase| *phase == state.phase).unwrap_or_default();
        let times = [state.start_time, state.time];
        let saved = (
            self.model.token(),
            place,
            state.tick,
            state.tolerance,
            times,
            &state.values,
            state.rig.is_some(),
        );
        let mut all = [BEGIN.to_vec(), bytes(&saved)].concat();
        if let Some(rig) = &state.rig {
            all.extend(rig.past().written()?);
        }
        all.extend(hash(BASIS, all.iter().copied()).to_le_bytes());
        Ok(all)
    }

    /// The state that was written as bytes, by an instance of the same FMU. What its machine was told is simulated again.
    ///
    /// # Errors
    /// Bytes of something else, of another FMU or damaged ones.
    pub fn deserialised(&mut self, bytes: &[u8]) -> Outcome<State> {
        let damaged =
            || "a state from bytes: they are damaged; needed: all bytes of a state of this FMU".to_owned();
        let (all, written) = bytes.split_last_chunk().ok_or_else(damaged)?;
        let rest = all.strip_prefix(&BEGIN).ok_or_else(|| {
            "a state from bytes: found something else, or a state of another version of Standstill; needed: one of this FMU".to_owned()
        })?;
        if hash(BASIS, all.iter().copied()) != u64::from_le_bytes(*written) {
            return Err(damaged());
        }
        let saved: Option<(Saved, &[u8])> = postcard::take_from_bytes(rest).ok();
        let ((token, phase, tick, tolerance, [start_time, time], values, is_built), steps) =
            saved.ok_or_else(damaged)?;
        let own = self.model.token();
        if token != own {
            return Err(format!(
                "a state from bytes: found one of the FMU {token}, needed one of {own}, this FMU"
            ));
        }
        let phase = Phase::ALL.get(phase).filter(|_| values.len() == self.state.values.len());
        let phase = *phase.ok_or_else(damaged)?;
        let state = State { phase, values, rig: None, tolerance, start_time, time, tick };
        let before = std::mem::replace(&mut self.state, state);
        let outcome = if is_built { self.retold(steps) } else { Ok(()) };
        let state = std::mem::replace(&mut self.state, before);
        outcome.map(|()| state)
    }

    /// Makes the machine of the present state, and does what it was told.
    fn retold(&mut self, steps: &[u8]) -> Outcome {
        self.build()?;
        let Some(rig) = &mut self.state.rig else { return Err("a state from bytes: no machine".to_owned()) };
        for step in Past::read(steps) {
            let (times, step) = step.ok_or("a state from bytes: found what is no step")?;
            for _ in 0..times {
                rig.go(&step)?;
            }
        }
        Ok(())
    }
}
