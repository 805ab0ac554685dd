//! Answers that are sectors, by where the rotor stood.
//!
//! An answer of half width h names all angles from its middle less h to its middle plus h. An answer whose rotor stands in it is right,
//! however far from its middle. At the border of two sectors the readings of both are alike: the next sector is then named in half of all
//! starts, which costs a start nothing, so an answer that misses its rotor by no more than a limit is counted by itself. From 90° on
//! the torque of a current across the angle has the wrong sign: these are the wrong poles.

use serde::{Deserialize, Serialize};

/// Counts of the answers that name a sector with a pole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sectors {
    /// Half the width of the sectors in degrees; if widths differ, half of the widest.
    pub half_width_deg: f64,
    /// Starts that named a sector.
    pub named: u64,
    /// Starts whose rotor stood in the sector that they named.
    pub right: u64,
    /// Starts that named the next sector, whose border was no further than the limit.
    pub at_border: u64,
    /// Other starts that named the next sector.
    pub next: u64,
    /// Starts that named a sector further away; those beyond 90° are wrong poles, too.
    pub further: u64,
}

impl Sectors {
    /// Notes that answers have this half width in degrees, whether or not a pole is named.
    pub(super) fn note(&mut self, half: f64) {
        self.half_width_deg = self.half_width_deg.max(half);
    }

    /// Adds a start that named a sector of this half width with this error of its middle, all in degrees.
    pub(super) fn add(&mut self, half: f64, error: f64, limit: f64) {
        let error = error.abs();
        self.note(half);
        self.named += 1;
        *match error {
            error if error <= half => &mut self.right,
            error if error > 3.0 * half => &mut self.further,
            error if error <= half + limit => &mut self.at_border,
            _ => &mut self.next,
        } += 1;
    }

    /// Returns whether these can be the counts of so many starts.
    pub(super) fn is_sound(&self, starts: u64) -> bool {
        let parts = [self.right, self.at_border, self.next, self.further];
        self.half_width_deg.is_finite()
            && self.named <= starts
            && parts.into_iter().try_fold(0, u64::checked_add) == Some(self.named)
    }

    /// Adds the starts of another.
    pub(super) fn merge(&mut self, other: &Self) {
        self.note(other.half_width_deg);
        self.named += other.named;
        self.right += other.right;
        self.at_border += other.at_border;
        self.next += other.next;
        self.further += other.further;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_each_error_is_counted_once() {
        let mut sectors = Sectors::default();
        for error in [0.0, -29.9, 30.0, 31.9, -32.0, 32.1, -89.9, 90.0, 90.1, 180.0] {
            sectors.add(30.0, error, 2.0);
        }
        let expected =
            Sectors { half_width_deg: 30.0, named: 10, right: 3, at_border: 2, next: 3, further: 2 };
        assert_eq!(sectors, expected);
        // Sectors of 30°: two away begins at 45°, and is no wrong pole before 90°.
        let mut narrow = Sectors::default();
        narrow.add(15.0, 44.9, 2.0);
        narrow.add(15.0, 45.1, 2.0);
        assert_eq!((narrow.next, narrow.further), (1, 1));
        narrow.merge(&sectors);
        assert_eq!((narrow.named, narrow.half_width_deg, narrow.further), (12, 30.0, 3));
    }
}
