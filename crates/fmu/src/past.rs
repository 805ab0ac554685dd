//! All that a machine was told, step by step, by which another one comes to the same bits.
//!
//! The machine's own state is spread over motor, iron, inverter, converters and draws, and each effect has its own. What it was told is
//! short, and a run is a function of it: so a state as bytes is the parameters with these steps, and restoring it is simulating them again.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::rig::Legs;

/// One step of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Move {
    /// Of a drive: what the legs do in half a PWM period, or in a whole one.
    Legs {
        /// Modes and duties; a duty without effect is 0.
        legs: Legs,
        /// Whether it is a whole period.
        whole: bool,
    },
    /// Of a motor: potentials in V of its terminals.
    Fed {
        /// Of each terminal.
        potential: [f64; 3],
        /// How long they are held, in ns.
        duration: u64,
    },
}

/// A value as bytes; of what is written here, all can be.
pub(crate) fn bytes(of: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(of).unwrap_or_default()
}

/// Most bytes that the steps of an instance may take: a few million steps, each unlike the one before it.
const ROOM: usize = 256 << 20;

/// Most bytes of the number before a step.
const MOST: usize = 5;

/// Bytes of a part that copies share.
const PART: usize = 64 << 10;

/// All steps so far; equal ones in a row stand once, with their number.
#[derive(Clone, Debug)]
pub(crate) struct Past {
    /// What copies share.
    full: Vec<Arc<[u8]>>,
    open: Vec<u8>,
    /// The last step as it is written, and how often in a row.
    last: (Vec<u8>, u32),
    /// Bytes that are left; none where there was no room for all.
    room: Option<usize>,
}

impl Default for Past {
    fn default() -> Self {
        Self::within(ROOM)
    }
}

impl Past {
    fn within(room: usize) -> Self {
        Self { full: Vec::new(), open: Vec::new(), last: (Vec::new(), 0), room: Some(room) }
    }

    /// One more step.
    pub fn push(&mut self, step: &Move) {
        let Some(room) = self.room else { return };
        let written = bytes(step);
        let (last, times) = &mut self.last;
        if *last == written && *times < u32::MAX {
            *times += 1;
            return;
        }
        let Some(left) = room.checked_sub(written.len() + MOST) else {
            // Half of it would be of no use.
            *self = Self { room: None, ..Self::within(0) };
            return;
        };
        self.room = Some(left);
        close(&mut self.open, &self.last);
        self.last = (written, 1);
        if self.open.len() >= PART {
            self.full.push(std::mem::take(&mut self.open).into());
        }
    }

    /// As bytes.
    ///
    /// # Errors
    /// Too many steps for that.
    pub fn written(&self) -> Result<Vec<u8>, String> {
        if self.room.is_none() {
            return Err(format!(
                "a state as bytes: the steps so far take more than {} MiB; needed: fewer steps, or the state itself, which has no limit",
                ROOM >> 20
            ));
        }
        let mut all = self.full.concat();
        all.extend_from_slice(&self.open);
        close(&mut all, &self.last);
        Ok(all)
    }

    /// Steps as they were written, each with how often in a row; none where the bytes are no steps.
    pub fn read(mut bytes: &[u8]) -> impl Iterator<Item = Option<(u32, Move)>> {
        std::iter::from_fn(move || {
            (!bytes.is_empty()).then(|| {
                let (step, rest) = postcard::take_from_bytes(bytes).ok().unzip();
                bytes = rest.unwrap_or_default();
                step
            })
        })
    }
}

fn close(to: &mut Vec<u8>, (step, times): &(Vec<u8>, u32)) {
    if *times > 0 {
        to.extend(bytes(times));
        to.extend_from_slice(step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn legs(n: u32) -> Move {
        let duty = f64::from(n % 97) / 97.0;
        Move::Legs {
            legs: Legs { mode: [3, (n % 3) as u8, 0], duty: [duty, 0.0, 0.0] },
            whole: n.is_multiple_of(2),
        }
    }

    fn fed(n: u32) -> Move {
        Move::Fed { potential: [f64::from(n), -0.0, 1e-300], duration: u64::from(n) + (1 << 32) }
    }

    #[test]
    fn law_steps_come_back_in_their_order_and_copies_go_on_by_themselves() {
        let mut past = Past::default();
        let mut all = Vec::new();
        for n in 0..20_000 {
            let step = if n % 3 == 0 { fed(n) } else { legs(n / 5) };
            past.push(&step);
            all.push(step);
        }
        let (copy, before) = (past.clone(), all.len());
        past.push(&fed(7));
        let back = |past: &Past| -> Vec<Move> {
            let bytes = past.written().expect("few");
            let steps = Past::read(&bytes).map(|step| step.expect("a step"));
            steps.flat_map(|(times, step)| std::iter::repeat_n(step, times as usize)).collect()
        };
        assert_eq!(back(&copy), all);
        assert_eq!(back(&past).len(), before + 1);
        assert!(copy.full.len() > 2, "parts are shared: {}", copy.full.len());
    }

    /// What is zero and has a sign is another step: the bits count.
    #[test]
    fn law_equal_steps_in_a_row_take_no_room() {
        let mut past = Past::default();
        let zero = |zero: f64| Move::Fed { potential: [zero; 3], duration: 1 };
        (0..1_000_000).for_each(|_| past.push(&zero(0.0)));
        let bytes = past.written().expect("few");
        let one = bytes.len();
        assert!(one < 40, "{one}");
        assert_eq!(Past::read(&bytes).collect::<Vec<_>>(), [Some((1_000_000, zero(0.0)))]);
        past.push(&zero(-0.0));
        assert!(past.written().expect("few").len() > one + 24);
    }

    #[test]
    fn law_steps_beyond_the_room_are_refused_and_cost_none() {
        let mut past = Past::within(3 * 37);
        (0..3).for_each(|n| past.push(&fed(n)));
        assert!(past.written().is_ok());
        past.push(&fed(3));
        past.push(&fed(3));
        assert!(past.written().expect_err("too many").contains("256 MiB"));
        assert!(past.open.is_empty() && past.last.0.is_empty());
    }

    #[test]
    fn law_bytes_that_are_no_steps_are_told_from_steps() {
        let mut past = Past::default();
        (0..9).for_each(|n| past.push(&legs(n)));
        let bytes = past.written().expect("few");
        for end in 1..bytes.len() {
            let steps: Vec<_> = Past::read(&bytes[..end]).collect();
            assert!(steps.len() <= 9 && (steps.len() < 9 || steps[8].is_none()), "{end}");
        }
        assert!(Past::read(&[1, 0, 0, 0, 0xff]).any(|step| step.is_none()));
    }
}
