//! One play cell while the flux moves on paths in the plane.

use standstill_plant::{Cell, MOST_CELLS};

use super::Cells;
use crate::physics::plane::Plane;

/// Returns the cells of a machine with a single cell, of reach 1 mWb and stiffness 10 1/H, at a flux in Wb.
fn one(flux: Plane) -> Cells<f64> {
    let mut cells = [Cell::default(); MOST_CELLS];
    cells[1] = Cell { stiffness: 10.0, reach: 1e-3 };
    let mut memory = Cells::idle();
    memory.put(0, &cells, flux, 10e-3, 1e-9, None);
    memory
}

/// Moves the flux on a straight line or a parabola between two points; `slopes`: slopes at both ends in Wb per piece. Returns work and
/// loss, both divided by 3/2, in J, by Simpson's rule.
fn go(memory: &mut Cells<f64>, from: Plane, to: Plane, slopes: [Plane; 2]) -> (f64, f64) {
    memory.find_modes(true, from, |_| slopes[0]);
    let [begin, end] = slopes;
    let (bend, way) = (to - from - begin, to - from);
    let mut sums = (0.0, 0.0);
    for (share, weight) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
        let flux = from + begin * share + bend * (share * share);
        let away = memory.away_at(flux, Some(begin * share));
        let rise = begin + bend * (2.0 * share);
        sums.0 += weight * memory.point(away).current.dot(rise);
        sums.1 += weight * memory.loss(0, &away, rise);
    }
    let away = memory.away_at(to, Some(begin));
    let moved = memory.moved((away, memory.point(away).stiffness), way, [begin, end], Plane::default());
    assert!(moved.off >= 0.0);
    memory.take(true, to, &moved);
    sums
}

/// A flux that rotates with the magnitude Ψ drags the pinned flux along a circle of radius √(Ψ² − r²), like a weight on a string. A turn
/// in either direction loses K r 2π √(Ψ² − r²).
#[test]
fn analytic_a_turning_flux_loses_what_the_pinned_one_rubs() {
    for direction in [1.0, -1.0] {
        for size in [1.5e-3, 4e-3, 20e-3] {
            let parts = 2000;
            let step = direction * std::f64::consts::TAU / f64::from(parts);
            let at = |n: u32| {
                let (sin, cos) = (step * f64::from(n)).sin_cos();
                Plane::new(size * cos, size * sin)
            };
            let mut memory = one(at(0));
            let mut last = 0.0;
            for turn in 0..4 {
                last = 0.0;
                for n in 0..parts {
                    let (from, to) = (at(n), at(n + 1));
                    let slopes = [from, to].map(|flux| flux.quarter_turn() * step);
                    let (_, lost) = go(&mut memory, from, to, slopes);
                    assert!(lost >= 0.0, "{turn}");
                    last += lost;
                }
            }
            let expected = 10.0 * 1e-3 * std::f64::consts::TAU * (size * size - 1e-6).sqrt();
            assert!((last / expected - 1.0).abs() < 1e-4, "{size} {last} {expected}");
        }
    }
}

/// On a random path, the work is equal to stored energy plus loss, and no energy is gained.
#[test]
fn law_work_is_stored_or_lost() {
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut at = Plane::new(0.0, 0.0);
    let mut memory = one(at);
    let (mut work, mut lost) = (0.0, 0.0);
    for _ in 0..200 {
        let way = Plane::new(random(), random()) * 6e-3;
        for _ in 0..1600 {
            let part = way * (1.0 / 1600.0);
            let (put_in, rubbed) = go(&mut memory, at, at + part, [part, part]);
            assert!(rubbed >= 0.0);
            (at, work, lost) = (at + part, work + put_in, lost + rubbed);
            assert!(memory.energy(0, at) <= work + 1e-9);
        }
    }
    let stored = memory.energy(0, at);
    assert!(lost > 100.0 * stored && ((work - stored - lost) / lost).abs() < 2e-3, "{work} {stored} {lost}");
}

/// One step on a parabola gives the result of thousands of straight steps.
#[test]
fn analytic_a_parabola_in_one_step() {
    let (from, begin, bend) = (Plane::new(0.0, 0.0), Plane::new(1.0e-3, 1.5e-3), Plane::new(0.8e-3, -0.7e-3));
    let end = from + begin + bend;
    let start = || {
        let mut memory = one(Plane::new(-2e-3, -0.3e-3));
        let way = Plane::new(2e-3, 0.3e-3);
        for n in 0..1000 {
            let at = Plane::new(-2e-3, -0.3e-3) + way * (f64::from(n) / 1000.0);
            go(&mut memory, at, at + way * 1e-3, [way * 1e-3, way * 1e-3]);
        }
        memory.find_modes(true, from, |_| begin);
        memory
    };
    let whole = start().away_at(end, Some(begin))[1];
    let mut memory = start();
    let parts = 4000;
    for n in 0..parts {
        let share = |n: i32| f64::from(n) / f64::from(parts);
        let at = |x: f64| from + begin * x + bend * (x * x);
        let slope = |x: f64| (begin + bend * (2.0 * x)) * share(1);
        go(&mut memory, at(share(n)), at(share(n + 1)), [slope(share(n)), slope(share(n + 1))]);
    }
    let fine = memory.away_at(end, None)[1];
    assert!((fine.dot(fine).sqrt() / 1e-3 - 1.0).abs() < 1e-9);
    let (off, chord) = (whole - fine, start().away_at(end, None)[1] - fine);
    assert!(off.dot(off).sqrt() < 2e-4 * 1e-3, "{off:?}");
    // On the chord instead of the parabola, the result would be far off.
    assert!(chord.dot(chord) > 1e4 * off.dot(off), "{chord:?} {off:?}");
}

/// A stopped cell exceeds its reach by rounding only. This must not let it slide, or it would begin and stop over and over.
#[test]
fn regress_rounding_does_not_let_a_stopped_cell_slide() {
    let out = Plane::new(0.6, 0.8);
    for (beyond, slides) in [(0.0, false), (1e-15, false), (1e-9, true)] {
        let mut memory = one(Plane::new(0.0, 0.0));
        memory.away[1] = out * (1e-3 * (1.0 + beyond));
        memory.find_modes(true, Plane::new(0.0, 0.0), |_| out);
        assert_eq!(memory.slides[1], slides, "{beyond}");
    }
}
