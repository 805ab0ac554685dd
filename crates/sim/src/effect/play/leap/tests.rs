//! Jumps of the flux, compared with many small steps on the same path, and with limits of the equations.

use standstill_plant::Cell;

use super::*;

const REACH: f64 = 1e-3;

/// Play by its definition, in small parts: the pinned flux follows as far as the distance exceeds the reach. Returns the elastic flux, and
/// the path length of the pinned flux: the loss divided by stiffness and reach.
fn in_parts(mut away: Plane, path: Plane, parts: u32) -> (Plane, f64) {
    let mut moved = 0.0;
    for _ in 0..parts {
        let next = away + path * (1.0 / f64::from(parts));
        let size = next.dot(next).sqrt();
        away = next;
        if size > REACH {
            away = next * (REACH / size);
            moved += size - REACH;
        }
    }
    (away, moved)
}

#[test]
fn analytic_a_jump_is_a_straight_path_of_any_length() {
    for (away, path) in [
        // Stuck on the whole path; from zero outwards; across; back through zero; along the circle |e| = r; far, at an angle.
        ((0.2, 0.1), (-0.5, 0.3)),
        ((0.0, 0.0), (2.0, 1.0)),
        ((0.5, -0.8), (0.4, 1.7)),
        ((0.9, 0.3), (-2.5, -0.7)),
        ((1.0, 0.0), (0.0, 1.5)),
        ((-0.6, 0.8), (7.0, 2.0)),
        // A jump of zero length, for a cell that is beyond its reach by the error of a step.
        ((0.6, 0.8 + 1e-6), (0.0, 0.0)),
    ] {
        let of = |(x, y): (f64, f64)| Plane::new(x * REACH, y * REACH);
        let (found, logarithm) = straight(of(away), of(path), REACH);
        let (expected, moved) = in_parts(of(away), of(path), 100_000);
        let miss = found - expected;
        assert!(miss.dot(miss).sqrt() < 2e-5 * REACH, "{away:?} {path:?}: {found:?}, not {expected:?}");
        let loss = logarithm * REACH;
        assert!((loss - moved).abs() < 2e-4 * REACH, "{away:?} {path:?}: {loss}, not {moved}");
        let size = found.dot(found).sqrt();
        assert!(
            if moved > 1e-8 { (size / REACH - 1.0).abs() < 1e-12 } else { size < REACH * 1.000_001 },
            "{size}"
        );
    }
}

#[test]
fn law_a_far_jump_draws_the_string_straight_and_costs_the_threshold_times_the_way() {
    let (found, logarithm) = straight(Plane::new(0.0, 0.0), Plane::new(3.0, 4.0), REACH);
    let miss = found - Plane::new(0.6, 0.8) * REACH;
    assert!(miss.dot(miss).sqrt() < 1e-15, "{found:?}");
    assert!((logarithm * REACH - (5.0 - REACH)).abs() < 1e-9, "{logarithm}");
}

#[test]
fn law_a_jump_there_and_back_is_a_step_of_the_path_that_follows() {
    let mut cells = [Cell::default(); MOST_CELLS];
    cells[1] = Cell { stiffness: 10.0, reach: REACH };
    let (start, there) = (Plane::new(0.4, 0.01), Plane::new(0.405, 0.02));
    let mut memory = Cells::<f64>::idle();
    memory.put(0, &cells, start, 10e-3, 1e-9, None);
    let energy = |memory: &Cells<f64>, at| memory.energy(0, at);
    let before = memory.before(0, start);
    let lost = memory.leap(0, &before, there);
    // At its reach, the cell slides if the flux moves outwards, and is stuck if the flux moves back.
    assert_eq!(memory.slides, [false, true, false]);
    memory.find_modes(true, there, |_| there - start);
    assert_eq!(memory.slides, [false, true, false]);
    memory.find_modes(true, there, |_| start - there);
    assert_eq!(memory.slides, [false; 3]);
    let stored = energy(&memory, there);
    assert!((stored / (10.0 * REACH * REACH / 2.0) - 1.0).abs() < 1e-12 && lost > stored, "{stored} {lost}");
    // The result depends on the state before the jump only, not on attempts with another flux.
    let mut other = Cells::<f64>::idle();
    other.put(0, &cells, start, 10e-3, 1e-9, None);
    other.leap(0, &before, Plane::new(0.39, 0.0));
    assert_eq!((other.leap(0, &before, there), other.away), (lost, memory.before(0, there).away));
}
