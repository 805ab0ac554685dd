//! Preparation of long series for drawing: breaking at gaps, thinning to the resolution of pixels, clipping and
//! dashing.

use super::backend::{Point, Rect};

/// Returns the points that are visible at a horizontal resolution of `width`: for each passage through a column the
/// first, last, highest and lowest point, in their order.
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

/// Returns the parts of a line inside a rectangle, clipped at one side after the other. A closed line stays closed, by
/// Sutherland and Hodgman. Points that are not numbers are gaps.
pub(super) fn clip(points: &[Point], is_closed: bool, area: Rect) -> Vec<Vec<Point>> {
    let sides: [&dyn Fn(Point) -> f64; 4] =
        [&|p| p.0 - area.left, &|p| area.right - p.0, &|p| p.1 - area.top, &|p| area.bottom - p.1];
    let cut = |parts: Vec<Vec<Point>>, inside: &dyn Fn(Point) -> f64| {
        let mut kept = Vec::new();
        for part in parts {
            let mut before = part.last().copied().filter(|_| is_closed);
            let mut open = Vec::new();
            for to in part {
                let is_gap = (to.0 + to.1).is_nan();
                if let Some(from) =
                    before.filter(|from| (inside(*from) < 0.0) != (inside(to) < 0.0) && !is_gap)
                {
                    let share = inside(from) / (inside(from) - inside(to));
                    open.push((from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)));
                }
                if !is_closed && (is_gap || inside(to) < 0.0) {
                    kept.push(std::mem::take(&mut open));
                }
                open.extend((inside(to) >= 0.0 && !is_gap).then_some(to));
                before = (!is_gap).then_some(to);
            }
            kept.push(open);
        }
        kept
    };
    let mut parts = sides.into_iter().fold(vec![points.to_vec()], cut);
    parts.retain(|part| !part.is_empty());
    parts
}

/// Returns the lines across a rectangle that go down to the right (slope 1) or up (−1), on multiples of the spacing
/// from the figure's corner, so that neighbours continue each other's lines.
pub(super) fn hatching(area: Rect, slope: f64, spacing: f64) -> impl Iterator<Item = [Point; 2]> {
    let [a, b] = [area.top, area.bottom].map(|y| slope * y);
    let first = ((area.left - a.max(b)) / spacing).floor();
    let count = (area.right - a.min(b)) / spacing - first;
    let line = move |index: f64| {
        let offset = (first + index) * spacing;
        let at = |x: f64| slope * (x - offset);
        let (from, to) = if slope > 0.0 { (area.left, area.right) } else { (area.right, area.left) };
        let y = (at(from).max(area.top), at(to).min(area.bottom));
        (y.0 < y.1).then_some([(offset + slope * y.0, y.0), (offset + slope * y.1, y.1)])
    };
    (0..100_000).map(f64::from).take_while(move |index| *index < count).filter_map(line)
}

/// Returns the length of each segment of a thinned line for its dashes. In columns with small ups and downs, the height
/// does not count; otherwise slight noise would hide the dashes.
fn strides(points: &[Point], column: f64) -> Vec<f64> {
    const LITTLE: f64 = 8.0;
    let smooth = points.chunk_by(|a, b| (a.0 / column).floor() == (b.0 / column).floor()).flat_map(|group| {
        let low = group.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let high = group.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let is_noisy = group.len() > 2 && high - low < LITTLE;
        group.iter().map(move |p| (p.0, if is_noisy { f64::midpoint(low, high) } else { p.1 }))
    });
    let smooth: Vec<Point> = smooth.collect();
    smooth.windows(2).map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1)).collect()
}

/// Returns the strokes of a dashed line that was thinned to columns of the given width; `pattern` holds the lengths
/// of strokes and gaps in turn. A line that goes up and down too densely for dashes to show stays whole.
pub(super) fn dash(points: &[Point], pattern: &[f64], column: f64) -> Vec<Vec<Point>> {
    const DENSE: f64 = 12_000.0;
    let strides = strides(points, column);
    if points.is_empty() || strides.iter().sum::<f64>() > DENSE {
        return vec![points.to_vec()];
    }
    let mut strokes = vec![vec![points[0]]];
    let (mut phase, mut left) = (0, pattern[0]);
    for (pair, full) in points.windows(2).zip(strides) {
        let (from, to) = (pair[0], pair[1]);
        let mut done = 0.0;
        while full - done > left {
            done += left;
            let share = done / full;
            let at = (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1));
            match strokes.last_mut() {
                Some(stroke) if phase % 2 == 0 => stroke.push(at),
                _ => strokes.push(vec![at]),
            }
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
        }
        left -= full - done;
        if let Some(stroke) = strokes.last_mut().filter(|_| phase % 2 == 0) {
            stroke.push(to);
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
        let none = f64::NAN;
        let points = [(0.0, 1.0), (1.0, none), (2.0, 1.0), (3.0, 2.0), (none, 1.0), (5.0, 60.0), (6.0, 60.0)];
        assert_eq!(clip(&points, false, AREA), [vec![(0.0, 1.0)], vec![(2.0, 1.0), (3.0, 2.0)]]);
    }

    #[test]
    fn analytic_a_line_is_clipped_where_it_crosses_the_edge() {
        let parts = clip(&[(10.0, 25.0), (20.0, 75.0), (30.0, 25.0), (40.0, 25.0)], false, AREA);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], [(10.0, 25.0), (15.0, 50.0)]);
        assert_eq!(parts[1], [(25.0, 50.0), (30.0, 25.0), (40.0, 25.0)]);
    }

    #[test]
    fn analytic_hatching_stays_within_its_rectangle_and_continues_in_the_next() {
        for slope in [1.0, -1.0] {
            let lines: Vec<_> = hatching(AREA, slope, 10.0).collect();
            assert_eq!(lines.len(), 14, "{lines:?}");
            for [a, b] in lines {
                assert!(
                    [a, b].iter().all(|end| (AREA.left..=AREA.right).contains(&end.0)
                        && (AREA.top..=AREA.bottom).contains(&end.1))
                        && (b.0 - a.0) == slope * (b.1 - a.1)
                );
                assert_eq!((a.0 - slope * a.1) % 10.0, 0.0);
            }
        }
    }

    #[test]
    fn analytic_dashes_have_the_lengths_of_the_pattern() {
        let strokes = dash(&[(0.0, 0.0), (4.0, 0.0), (12.0, 0.0)], &[3.0, 2.0], 0.5);
        let ends: Vec<_> = strokes.iter().map(|s| (s[0].0, s[s.len() - 1].0)).collect();
        assert_eq!(ends, [(0.0, 3.0), (5.0, 8.0), (10.0, 12.0)]);
    }
}
