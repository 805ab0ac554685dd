//! The answer of `require` as text.

use standstill_analysis::bracket::{Bound, Edge, Search, Side, Stretch};
use standstill_analysis::limit::Limits;
use standstill_quantity::count;

use super::unanswered::{self, Unanswered};
use super::{EdgeSearch, bound, side};
use crate::shell::values::{shown, shown_interval};

/// Returns the answer as a sentence: the limits hold up to an edge, from an edge on, or between two edges.
pub fn sentence(key: &str, whole: bool, limits: &Limits, edges: &[Edge]) -> String {
    let of = |edge: &Edge| shown_interval((key, whole), edge.value, edge.interval);
    match edges {
        [from, to, ..] => format!("{key} from {} to {} for {limits}", of(from), of(to)),
        [edge] => format!("{key} {} {} for {limits}", side(edge.side), of(edge)),
        [] => String::new(),
    }
}

/// Returns the details: numbers of trials, binding limits, and uncertainties of the edges.
pub fn details(asked: &EdgeSearch<'_>, found: &Stretch) -> Vec<String> {
    let (key, limits) = (&asked.bench.keys[0].0, &asked.limits);
    let mut counts: Vec<String> = found.edges.iter().map(|edge| count(edge.trials)).collect();
    counts.dedup();
    let counts = counts.join(" and ");
    let mut notes =
        vec![format!("[95 % interval], {counts} trials at the last values, the same random numbers at each")];
    let several = limits.0.len() > 1;
    let bound = found.edges.iter().filter(|edge| several || !matches!(edge.bound, Bound::Limits(_)));
    notes.extend(bound.map(|edge| binding(limits, edge)));
    if !found.is_one() {
        let stretch = |(from, to): &(f64, f64)| format!("{} to {}", shown(key, *from), shown(key, *to));
        let all: Vec<String> = found.all.iter().map(stretch).collect();
        notes.push(format!(
            "not monotone: of the values looked at it holds from {}, and surely not between",
            all.join(", and from ")
        ));
    }
    let of_edges: Vec<(Side, Vec<String>)> =
        found.edges.iter().map(|edge| (edge.side, about(asked, edge))).collect();
    for (k, (at, texts)) in of_edges.iter().enumerate() {
        for text in texts {
            let said = |(_, others): &(Side, Vec<String>)| others.contains(text);
            // A sentence that holds at both edges is printed once.
            match (of_edges.len() > 1, of_edges[..k].iter().any(said), of_edges[k + 1..].iter().any(said)) {
                (_, true, _) => (),
                (true, _, false) => notes.push(format!("{}: {text}", end_of(*at))),
                _ => notes.push(text.clone()),
            }
        }
    }
    notes
}

/// Returns the sentences on one edge.
fn about(asked: &EdgeSearch<'_>, edge: &Edge) -> Vec<String> {
    let (key, limits, search) = (&asked.bench.keys[0].0, &asked.limits, &asked.search);
    let too_few = unanswered::too_few(limits, edge);
    let open = if too_few.is_none() { open(key, search, edge) } else { None };
    let wide = (!edge.narrow).then(|| unanswered::wide(search.width, edge.needed));
    let unanswered = Unanswered::of(limits, &asked.judged, edge).map(|found| found.to_string());
    [open, wide, unanswered, too_few].into_iter().flatten().collect()
}

const fn end_of(side: Side) -> &'static str {
    match side {
        Side::Largest => "at the upper edge",
        Side::Smallest => "at the lower edge",
    }
}

/// Returns a phrase that names the causes of an edge, such as the limits that do not hold beyond the edge.
fn binding(limits: &Limits, edge: &Edge) -> String {
    let beyond = match edge.side {
        Side::Largest => "above",
        Side::Smallest => "below",
    };
    let what = bound(limits, &edge.bound).join(" and ");
    match edge.bound {
        Bound::Limits(_) => format!("{beyond} it {what} is broken"),
        Bound::Unanswered => format!("{beyond} it {what} break the limits, which the others would keep"),
        Bound::Refused => format!("{beyond} it are {what}"),
    }
}

/// Returns a sentence that states why one end of an edge's interval is unknown. Returns none if both ends are known.
fn open(key: &str, search: &Search, edge: &Edge) -> Option<String> {
    let (low, high) = search.range;
    let ends = match edge.side {
        Side::Largest => [low, high],
        Side::Smallest => [high, low],
    };
    let [inner, outer] = match edge.side {
        Side::Largest => edge.interval,
        Side::Smallest => [edge.interval[1], edge.interval[0]],
    };
    let to = |end: f64| shown(key, end);
    match (inner, outer) {
        (Some(_), Some(_)) => None,
        (None, Some(_)) => Some("open: at no value that was looked at does it surely hold".to_owned()),
        (Some(_), None) => {
            Some(format!("open: up to {} it may hold, though it does not seem to", to(ends[1])))
        }
        (None, None) => Some(format!(
            "open at both ends: from {} to {} it neither surely holds nor surely not",
            to(low),
            to(high)
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_values_have_no_digits_beyond_their_intervals() {
        let said = |key: &str, [value, low, high]: [f64; 3]| {
            shown_interval((key, false), value, [Some(low), Some(high)])
        };
        let noise = said("sensors.noise", [0.014_483, 0.014_221, 0.014_744]);
        assert_eq!(noise, "14.48 mA [14.22 mA, 14.74 mA]");
        assert_eq!(said("sensors.noise", [0.0145, 0.0108, 0.0161]), "14.5 mA [10.8 mA, 16.1 mA]");
        assert_eq!(said("sensors.gain_error", [0.0051, 0.0048, 0.0054]), "0.510 % [0.480 %, 0.540 %]");
        assert_eq!(shown_interval(("detector.rounds", true), 3.0, [Some(3.0), Some(4.0)]), "3 [3, 4]");
        let pulse = |ends| shown_interval(("detector.pulse", false), 55.04e-6, ends);
        assert_eq!(pulse([Some(53.66e-6), None]), "55.0 µs [53.7 µs, open]");
        assert_eq!(pulse([None, None]), "55.0 µs [open, open]");
    }
}
