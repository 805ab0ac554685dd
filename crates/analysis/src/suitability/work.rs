//! Limit on the work of a check, so that its verdict takes at most about a minute of processor time.
//!
//! Work is counted in evaluations of the machine's equations and in instants at which something changes, never in time,
//! so that a verdict does not depend on the speed or the load of a machine.

use std::cell::Cell;

use standstill_inverter::Bridge;
use standstill_numeric::whole;
use standstill_odds::subset::Effort;
use standstill_sim::Work;

/// Number of segments and events that take as long as one evaluation of the equations. It follows from starts on the paper's motor.
/// `bipolar`: 473 evaluations, 372 segments and events, 162 µs. `line-inductance-fast`: 273, 125, 90 µs. Rotating injection: 10,315, 3,008,
/// 3.1 ms. Maximum likelihood: 828, 1,123, 420 µs. (`standstill run paper-5k5 -s detector.method=M --trials 4000`, processor time on a busy
/// computer.)
const PER_EVALUATION: u64 = 3;

/// Number of evaluations without terminal capacitances that take as long as one evaluation with them. The error set `field` has terminal
/// capacitances. On a gimbal's motor, an evaluation with them took 1.0 to 1.2 µs in a check, and an evaluation without them 0.31 µs
/// (`standstill check gimbal-2804.toml -s errors=field`, processor time).
const OF_TERMINALS: u64 = 4;

/// Work of [`Effort::Normal`] in evaluations. It takes about a minute at 0.33 µs per evaluation.
const NORMAL: u64 = 180_000_000;

/// Returns the largest allowed work of a check, in evaluations of the machine's equations. A check with normal effort takes at most about a
/// minute of processor time. With quick effort it takes a quarter of that, with high effort sixteen times as much.
pub const fn most(effort: Effort) -> u64 {
    match effort {
        Effort::Quick => NORMAL / 4,
        Effort::Normal => NORMAL,
        Effort::High => NORMAL * 16,
    }
}

/// Returns the work of one simulated motor start with this bridge, in evaluations of the equations without terminal capacitances.
pub(super) fn of_start(work: &Work, bridge: &Bridge) -> u64 {
    let each = if bridge.terminal_capacitance > 0.0 { OF_TERMINALS } else { 1 };
    each * work.derivatives + (work.segments + work.events) / PER_EVALUATION
}

/// Budget for the work of a check or of a part of a check.
#[derive(Debug)]
pub(super) struct Allowance {
    done: Cell<u64>,
    limit: Cell<u64>,
    cut: Cell<bool>,
}

impl Allowance {
    pub const fn new(most: u64) -> Self {
        Self { done: Cell::new(0), limit: Cell::new(most), cut: Cell::new(false) }
    }

    /// Returns the work done so far.
    pub const fn done(&self) -> u64 {
        self.done.get()
    }

    /// Returns the work that is left.
    pub const fn left(&self) -> u64 {
        self.limit.get().saturating_sub(self.done.get())
    }

    /// Adds work to the work done so far. Returns true if some of the budget is left.
    pub fn spend(&self, work: u64) -> bool {
        self.done.set(self.done.get() + work);
        self.has(0)
    }

    /// Returns true if more than this work is left. If not, the present part of the check is marked as cut.
    pub fn has(&self, work: u64) -> bool {
        let has = work < self.left();
        if !has {
            self.cut.set(true);
        }
        has
    }

    /// Carries out a part of the check with at most this share of the remaining work. Returns the result of the part, and true if the part
    /// was cut. A part that encloses a cut part counts as cut, too.
    pub fn within<T>(&self, share: f64, part: impl FnOnce() -> T) -> (T, bool) {
        let (limit, cut) = (self.limit.get(), self.cut.replace(false));
        let most = whole(share * self.left() as f64);
        self.limit.set(self.done.get().saturating_add(most));
        let done = part();
        self.limit.set(limit);
        let was_cut = self.cut.get();
        self.cut.set(cut || was_cut);
        (done, was_cut)
    }

    /// Carries out a part of the check with all work that is left except `kept`. The part gets at least the share `least` of the work that is
    /// left. Returns the result and whether the part was cut, as [`Self::within`] does.
    pub fn within_all_but<T>(&self, kept: f64, least: f64, part: impl FnOnce() -> T) -> (T, bool) {
        self.within((1.0 - kept / self.left() as f64).max(least), part)
    }

    /// Returns true if the present part of the check left something out because the budget was used up.
    pub const fn is_cut(&self) -> bool {
        self.cut.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part that ends early leaves its work to the next one. After parts that used theirs, a part still has its least share.
    #[test]
    fn law_a_part_may_use_all_but_what_is_kept() {
        let work = Allowance::new(1000);
        let ((), cut) = work.within_all_but(100.0, 0.4, || assert!(work.spend(200)));
        assert!(!cut);
        let ((), cut) =
            work.within_all_but(100.0, 0.4, || assert!(work.has(699) && work.spend(650) && !work.has(50)));
        assert!(cut && work.left() == 150);
        let ((), _) = work.within_all_but(100.0, 0.4, || assert!(work.has(59) && !work.has(60)));
        work.spend(150);
        let ((), cut) = work.within_all_but(100.0, 0.4, || assert!(!work.has(0)));
        assert!(cut && work.left() == 0);
    }

    /// A part gets its share of the work that is left. When a part has used its share, the other parts go on.
    #[test]
    fn law_a_part_of_the_work_has_its_share_and_no_more() {
        let work = Allowance::new(1000);
        assert!(work.spend(200));
        let (done, cut) = work.within(0.5, || {
            assert!(work.has(399) && !work.has(400) && work.is_cut());
            let (inner, cut) = work.within(0.25, || work.spend(99) && !work.spend(1));
            assert!(inner && cut && work.spend(200));
            !work.spend(100)
        });
        assert!(done && cut && work.is_cut() && work.done() == 600 && work.has(399) && !work.has(400));
        // If a part within a part is cut, the outer part counts as cut, too, although it has work left.
        let work = Allowance::new(1000);
        let ((), cut) = work.within(0.5, || {
            let (_, inner) = work.within(0.1, || work.spend(60));
            assert!(inner && work.has(400));
        });
        assert!(cut && work.is_cut());
        // If a part is not cut, neither is the whole.
        let work = Allowance::new(1000);
        assert_eq!(work.within(0.1, || work.spend(99)), (true, false));
        assert!(!work.is_cut());
    }
}
