//! Long series made drawable: broken at gaps, thinned to what a pixel can show, clipped and dashed.

use super::canvas::{Point, Rect};

/// The stretches between points that are not numbers.
pub(super) fn runs(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut runs = vec![Vec::new()];
    for (x, y) in points {
        if x.is_finite() && y.is_finite() {
            // Far outside any figure; keeps the arithmetic of clipping finite.
            runs.last_mut().expect("never empty").push((x.clamp(-1e9, 1e9), y.clamp(-1e9, 1e9)));
        } else {
            runs.push(Vec::new());
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// The points that matter when columns `width` wide are all that is visible: of each passage through a
/// column its first and last point and its extremes, in their order.
pub(super) fn thin(points: &[Point], width: f64) -> Vec<Point> {
    let column = |p: &Point| (p.0 / width).floor();
    let mut kept = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| group[*a].1.total_cmp(&group[*b].1);
        let lowest = (0..group.len()).min_by(by_height).unwrap_or(0);
        let highest = (0..group.len()).max_by(by_height).unwrap_or(0);
        let mut indices = [0, lowest, highest, group.len() - 1];
        indices.sort_unstable();
        for (place, &index) in indices.iter().enumerate() {
            if place == 0 || indices[place - 1] != index {
                kept.push(group[index]);
            }
        }
    }
    kept
}

/// The parts of a line inside a rectangle.
pub(super) fn clip_line(points: &[Point], area: Rect) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    for pair in points.windows(2) {
        let Some((from, to)) = clip_segment(pair[0], pair[1], area) else { continue };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&from) => part.push(to),
            _ => parts.push(vec![from, to]),
        }
    }
    parts
}

/// Liang and Barsky: the part of a segment inside a rectangle.
fn clip_segment(a: Point, b: Point, area: Rect) -> Option<(Point, Point)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    let sides =
        [(-dx, a.0 - area.left), (dx, area.right - a.0), (-dy, a.1 - area.top), (dy, area.bottom - a.1)];
    for (outward, room) in sides {
        if outward == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if outward < 0.0 {
            enter = enter.max(room / outward);
        } else {
            leave = leave.min(room / outward);
        }
    }
    // An end inside is returned as it is, so that the next segment is recognised as its continuation.
    let point = |share: f64| match share {
        0.0 => a,
        1.0 => b,
        _ => (a.0 + share * dx, a.1 + share * dy),
    };
    (enter <= leave).then(|| (point(enter), point(leave)))
}

/// Sutherland and Hodgman: the part of a polygon inside a rectangle.
pub(super) fn clip_polygon(corners: &[Point], area: Rect) -> Vec<Point> {
    let inside: [fn(Point, Rect) -> f64; 4] = [
        |p, area| p.0 - area.left,
        |p, area| area.right - p.0,
        |p, area| p.1 - area.top,
        |p, area| area.bottom - p.1,
    ];
    let mut shape = corners.to_vec();
    for depth in inside {
        let mut next = Vec::with_capacity(shape.len());
        for (index, &to) in shape.iter().enumerate() {
            let from = shape[(index + shape.len() - 1) % shape.len()];
            let (a, b) = (depth(from, area), depth(to, area));
            if (a < 0.0) != (b < 0.0) {
                let share = a / (a - b);
                next.push((from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)));
            }
            if b >= 0.0 {
                next.push(to);
            }
        }
        shape = next;
    }
    shape
}

/// Lines across a rectangle that go down to the right (slope 1) or up (−1), on multiples of the spacing from the figure's
/// corner, so that neighbours continue each other's lines.
pub(super) fn hatching(area: Rect, slope: f64, spacing: f64) -> Vec<Vec<Point>> {
    let [a, b] = [area.top, area.bottom].map(|y| slope * y);
    let mut offset = ((area.left - a.max(b)) / spacing).floor() * spacing;
    let mut lines = Vec::new();
    while offset < area.right - a.min(b) {
        let at = |y: f64| (offset + slope * y, y);
        lines.extend(clip_line(&[at(area.top), at(area.bottom)], area));
        offset += spacing;
    }
    lines
}

pub(super) fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum()
}

/// How far each segment of a thinned line counts towards its dashes.
///
/// That is its length, except in columns where the line goes up and down a little: there it counts how far
/// the middle of the column is from the one before. Dashes would otherwise be lost in the slightest noise.
fn strides(points: &[Point], column: f64) -> Vec<f64> {
    const LITTLE: f64 = 8.0;
    let mut strides = Vec::with_capacity(points.len());
    let mut before: Option<(Point, bool)> = None;
    for group in points.chunk_by(|a, b| (a.0 / column).floor() == (b.0 / column).floor()) {
        let low = group.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let high = group.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let noisy = group.len() > 2 && high - low < LITTLE;
        let middle = |p: Point| if noisy { (p.0, f64::midpoint(low, high)) } else { p };
        if let Some((last, was_noisy)) = before {
            let first = middle(group[0]);
            let rise = first.1 - last.1;
            // Between columns of noise even the middles scatter.
            let rise = if noisy && was_noisy { (rise.abs() - 0.5).max(0.0) } else { rise };
            strides.push((first.0 - last.0).hypot(rise));
        }
        strides.extend(
            group.windows(2).map(|pair| if noisy { (pair[1].0 - pair[0].0).abs() } else { length(pair) }),
        );
        before = group.last().map(|&p| (middle(p), noisy));
    }
    strides
}

/// The strokes of a dashed line that was thinned to columns of the given width; `pattern` holds the lengths of
/// strokes and gaps in turn.
pub(super) fn dash(points: &[Point], pattern: &[f64], column: f64) -> Vec<Vec<Point>> {
    let mut strokes = vec![points[..1].to_vec()];
    let (mut phase, mut left) = (0, pattern[0]);
    for (pair, full) in points.windows(2).zip(strides(points, column)) {
        let (from, to) = (pair[0], pair[1]);
        let mut done = 0.0;
        while full - done > left {
            done += left;
            let share = done / full;
            let at = (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1));
            if phase % 2 == 0 {
                strokes.last_mut().expect("never empty").push(at);
            } else {
                strokes.push(vec![at]);
            }
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
        }
        left -= full - done;
        if phase % 2 == 0 {
            strokes.last_mut().expect("never empty").push(to);
        }
    }
    strokes
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Rect = Rect { left: 0.0, top: 0.0, right: 100.0, bottom: 50.0 };

    #[test]
    fn law_thinning_keeps_the_extremes_of_a_column() {
        let mut points: Vec<Point> = (0..30_000).map(|i| (f64::from(i) * 0.003, 10.0)).collect();
        points[12_345].1 = 49.0;
        points[12_346].1 = 1.0;
        let kept = thin(&points, 0.5);
        assert!(kept.len() < 1000, "{}", kept.len());
        assert!(kept.contains(&points[12_345]) && kept.contains(&points[12_346]));
        assert_eq!((kept.first(), kept.last()), (points.first(), points.last()));
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn law_a_gap_breaks_a_line() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 2.0), (f64::INFINITY, 1.0)];
        assert_eq!(runs(points.into_iter()), [vec![(0.0, 1.0)], vec![(2.0, 1.0), (3.0, 2.0)]]);
    }

    #[test]
    fn analytic_a_line_is_clipped_where_it_crosses_the_edge() {
        let parts = clip_line(&[(10.0, 25.0), (20.0, 75.0), (30.0, 25.0), (40.0, 25.0)], AREA);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], [(10.0, 25.0), (15.0, 50.0)]);
        assert_eq!(parts[1], [(25.0, 50.0), (30.0, 25.0), (40.0, 25.0)]);
    }

    #[test]
    fn analytic_dashes_have_the_lengths_of_the_pattern() {
        let strokes = dash(&[(0.0, 0.0), (4.0, 0.0), (12.0, 0.0)], &[3.0, 2.0], 0.5);
        let ends: Vec<_> = strokes.iter().map(|s| (s[0].0, s[s.len() - 1].0)).collect();
        assert_eq!(ends, [(0.0, 3.0), (5.0, 8.0), (10.0, 12.0)]);
    }
}
