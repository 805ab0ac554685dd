//! States as bytes: parameters, times, and all that the machine was told, which is done again where the bytes are read.

use crate::instance::{Instance, Outcome, Phase, State};
use crate::model::{BASIS, hash};
use crate::past::{Past, taken};

/// How such bytes begin, with the number of their form.
const BEGIN: [u8; 16] = *b"standstill-fmu:1";

fn number(from: &mut &[u8]) -> Option<f64> {
    taken(from).map(f64::from_le_bytes)
}

impl Instance {
    /// A state of this instance as bytes.
    ///
    /// # Errors
    /// A state in which a step failed, and too many steps.
    pub fn serialised(&self, state: &State) -> Outcome<Vec<u8>> {
        if state.phase == Phase::Failed {
            return Err("a state as bytes: a step of it failed; needed: a state from before".to_owned());
        }
        let mut all = BEGIN.to_vec();
        let token = self.model.token();
        all.extend((token.len() as u64).to_le_bytes());
        all.extend_from_slice(token.as_bytes());
        let place = Phase::ALL.iter().position(|phase| *phase == state.phase).unwrap_or_default();
        let flags = [state.tick, state.tolerance.is_some(), state.rig.is_some()];
        #[expect(clippy::cast_possible_truncation, reason = "there are fewer than ten phases")]
        all.push(place as u8);
        all.extend(flags.map(u8::from));
        let times = [state.tolerance.unwrap_or(0.0), state.start_time, state.time];
        all.extend(times.iter().chain(&state.values).flat_map(|value| value.to_le_bytes()));
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
        let mut rest = all.strip_prefix(&BEGIN).ok_or_else(|| {
            "a state from bytes: found something else, or a state of another version of Standstill; needed: one of this FMU".to_owned()
        })?;
        if hash(BASIS, all.iter().copied()) != u64::from_le_bytes(*written) {
            return Err(damaged());
        }
        let from = &mut rest;
        let length = taken(from).map(u64::from_le_bytes).and_then(|length| usize::try_from(length).ok());
        let token = length.and_then(|length| from.split_off(..length)).ok_or_else(damaged)?;
        let own = self.model.token();
        if token != own.as_bytes() {
            let found = String::from_utf8_lossy(token);
            return Err(format!(
                "a state from bytes: found one of the FMU {found}, needed one of {own}, this FMU"
            ));
        }
        let (state, is_built) = self.parsed(from).ok_or_else(damaged)?;
        let before = std::mem::replace(&mut self.state, state);
        let outcome = if is_built { self.retold(from) } else { Ok(()) };
        let state = std::mem::replace(&mut self.state, before);
        outcome.map(|()| state)
    }

    /// A state without its machine, and whether it has one.
    fn parsed(&self, from: &mut &[u8]) -> Option<(State, bool)> {
        let mut state = State::new(&self.model);
        let [phase, tick, exact, is_built] = taken(from)?;
        state.phase = *Phase::ALL.get(usize::from(phase))?;
        state.tick = tick != 0;
        let tolerance = number(from)?;
        state.tolerance = (exact != 0).then_some(tolerance);
        (state.start_time, state.time) = (number(from)?, number(from)?);
        for value in &mut state.values {
            *value = number(from)?;
        }
        Some((state, is_built != 0))
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
