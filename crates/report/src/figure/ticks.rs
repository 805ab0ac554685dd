//! Choice of the ticks that fit on an axis, and layout of their texts.

use super::axis::{Axis, AxisScale, Scale, Tick, Ticks};
use super::chart::{SMALL, SMALL_LINE};
use super::number::superscript;
use super::text::{fit, shorten, shorten_within, widest};
use plotters::coord::ranged1d::{BoldPoints, Ranged};
use plotters::coord::types::RangedCoordf64;
use standstill_numeric::whole;

/// Least distance of two texts along a line.
const APART: f64 = 14.0;

/// Returns the width of a tick's text.
pub(super) fn text_width(tick: &Tick) -> f64 {
    widest(&tick.text, SMALL)
}

/// Returns the ticks of a horizontal axis that is drawn from one place to another, with texts at most `tall`; whether
/// these are upright.
pub(super) fn horizontal(axis: &Axis, x: &Scale, ends: (f64, f64), tall: f64) -> (Vec<Tick>, bool) {
    let apart = |pair: &[Tick]| x.at(pair[1].at, ends) - x.at(pair[0].at, ends);
    let Ticks::Named(names) = &axis.ticks else {
        let room = |pair: &[Tick]| apart(pair) - 0.5 * (text_width(&pair[0]) + text_width(&pair[1]));
        let fits = |ticks: &[Tick]| ticks.windows(2).all(|pair| room(pair) >= APART);
        let most = ((ends.1 - ends.0) / 75.0).clamp(2.0, 12.0);
        return (without_touching(numbers(axis, x.range, most, fits), |pair| room(pair) >= APART), false);
    };
    let mut named = shown(names, x.range);
    let gap = named.windows(2).map(apart).fold(ends.1 - ends.0, f64::min);
    let fitted: Vec<_> = named.iter().map(|tick| fit(&tick.text, SMALL, gap - 8.0)).collect();
    let lines = fitted.iter().map(Vec::len).max().unwrap_or(1);
    let narrow = fitted.iter().flatten().all(|line| widest(line, SMALL) <= gap - 8.0 && !line.ends_with('…'));
    if narrow && lines as f64 * SMALL_LINE <= tall.max(2.0 * SMALL_LINE) {
        named.iter_mut().zip(fitted).for_each(|(tick, lines)| tick.text = lines.join("\n"));
        return (named, false);
    }
    thin_out(&mut named, gap);
    for tick in &mut named {
        tick.text = shorten(&tick.text, SMALL, tall.max(40.0));
    }
    (named, true)
}

/// Returns the ticks of an upright axis, `height` tall, with names at most `wide`.
pub(super) fn vertical(axis: &Axis, range: (f64, f64), height: f64, wide: f64) -> Vec<Tick> {
    let scale = Scale::new(range, axis.scale);
    let apart = |pair: &[Tick]| scale.at(pair[1].at, (0.0, height)) - scale.at(pair[0].at, (0.0, height));
    let Ticks::Named(names) = &axis.ticks else {
        let fits = |ticks: &[Tick]| ticks.windows(2).all(|pair| apart(pair) >= 21.0);
        return numbers(axis, range, (height / 38.0).clamp(3.0, 12.0), fits);
    };
    let mut named = shown(names, range);
    let gap = named.windows(2).map(apart).fold(height, f64::min);
    thin_out(&mut named, gap);
    let set = |text: &str, shorten: fn(&str, f64, f64) -> String| {
        let lines = fit(text, SMALL, wide);
        let fits = lines.len() as f64 * SMALL_LINE <= gap.max(SMALL_LINE);
        if fits { lines.join("\n") } else { shorten(text, SMALL, wide) }
    };
    let short: Vec<String> = named.iter().map(|tick| set(&tick.text, shorten)).collect();
    for (tick, text) in named.iter_mut().zip(&short) {
        // Names that begin alike still differ.
        let is_alone = short.iter().filter(|other| *other == text).count() == 1;
        tick.text = if is_alone { text.clone() } else { set(&tick.text, shorten_within) };
    }
    named
}

/// Takes away texts that would touch the one before: of numbers with many digits not even two may have room.
fn without_touching(mut ticks: Vec<Tick>, fits: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    ticks.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut last: Option<Tick> = None;
    for tick in ticks.iter_mut().filter(|tick| !tick.text.is_empty()) {
        match last.take() {
            Some(before) if !fits(&[before.clone(), tick.clone()]) => {
                tick.text.clear();
                last = Some(before);
            }
            _ => last = Some(tick.clone()),
        }
    }
    ticks
}

/// Returns the names within a range, in their order along the axis.
fn shown(names: &[(f64, String)], (first, last): (f64, f64)) -> Vec<Tick> {
    let within = names.iter().filter(|(at, _)| (first..=last).contains(at));
    let mut ticks: Vec<Tick> = within.map(|(at, text)| Tick { at: *at, text: text.clone() }).collect();
    ticks.sort_by(|a, b| a.at.total_cmp(&b.at));
    ticks
}

/// Takes texts away until the others are a line apart; every tick keeps its mark.
fn thin_out(ticks: &mut [Tick], gap: f64) {
    let every: usize = whole(((SMALL_LINE - 1.0) / gap.max(0.1)).ceil().max(1.0));
    for (_, tick) in ticks.iter_mut().enumerate().filter(|(index, _)| index % every != 0) {
        tick.text.clear();
    }
}

/// Returns the densest marks at round numbers that fit, at most about so many.
fn numbers(axis: &Axis, range: (f64, f64), mut most: f64, fits: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let step = match axis.ticks {
        Ticks::Step(step) if step.is_finite() && step > 0.0 => Some(step),
        Ticks::Whole => Some(1.0),
        _ => None,
    };
    if axis.scale == AxisScale::Log10 {
        let mut ticks = log_ticks(range, fits);
        ticks.retain(|tick| axis.ticks != Ticks::Whole || tick.at == tick.at.round());
        return ticks;
    }
    let within = |most: f64| labelled(&round(range, step, most + 1.0), range);
    let mut found = within(most);
    if found.len() < 3 {
        // Less than three marks make no scale: then more, if their texts have room.
        let finer = within(2.0 * most);
        return if fits(&finer) { finer } else { found };
    }
    while found.len() > 2 && most > 2.0 && !fits(&found) {
        most *= 0.8;
        found = within(most);
    }
    found
}

/// Returns the numbers within a range by plotters: multiples of 1, 2 or 5 times a power of ten, and whole multiples
/// of a step.
fn round((low, high): (f64, f64), step: Option<f64>, most: f64) -> Vec<f64> {
    // plotters compares with absolute errors, so that it wants numbers near 1.
    const SLACK: f64 = 1e-9;
    let unit = step.unwrap_or_else(|| 10f64.powf((high - low).log10().floor()));
    let most = BoldPoints(whole(most.max(2.0)));
    let mut places = RangedCoordf64::from(low / unit - SLACK..high / unit + SLACK).key_points(most);
    places.retain(|at| step.is_none() || (at - at.round()).abs() < SLACK);
    places.into_iter().map(|at| (at * unit).clamp(low, high)).collect()
}

/// Returns the numbers at equal distances, with the decimals that these need, and with a power of ten if they would
/// be long.
fn labelled(places: &[f64], range: (f64, f64)) -> Vec<Tick> {
    let largest = range.0.abs().max(range.1.abs());
    let step = places.windows(2).next().map_or(largest, |pair| pair[1] - pair[0]);
    let exponent = largest.log10().floor();
    let text = |&at: &f64| {
        if at.abs() < 1e-6 * step {
            "0".to_owned()
        } else if (-3.0..6.0).contains(&exponent) {
            decimal(at, step)
        } else {
            let unit = 10f64.powf(exponent);
            format!("{}·10{}", decimal(at / unit, step / unit), superscript(exponent))
        }
    };
    places.iter().map(|at| Tick { at: *at, text: text(at) }).collect()
}

fn decimal(value: f64, step: f64) -> String {
    let is_whole = |decimals: &i32| {
        let scaled = step * 10f64.powi(*decimals);
        (scaled - scaled.round()).abs() <= 1e-6 * scaled
    };
    let decimals = (0..9).find(is_whole).map_or(9, i32::unsigned_abs) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

/// Mantissas in every so many decades, the densest first.
#[rustfmt::skip]
const DECADES: [(&[f64], i32); 11] = [
    (&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0], 1), (&[1.0, 2.0, 5.0], 1), (&[1.0, 3.0], 1), (&[1.0], 1), (&[1.0], 2),
    (&[1.0], 3), (&[1.0], 5), (&[1.0], 10), (&[1.0], 20), (&[1.0], 50), (&[1.0], 100),
];

/// Returns the densest ticks of a logarithmic axis that fit, and between them marks without a text.
fn log_ticks(range: (f64, f64), fits: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let decades = (range.1 / range.0).log10();
    let choices = &DECADES[usize::from(decades >= 1.3)..];
    // Less than three marks make no scale: within a small part of a decade, differences do.
    if places(range, choices[0]).len() < 3 {
        let even = [8.0, 6.0, 4.0, 3.0].map(|most| labelled(&round(range, None, most), range));
        return even.iter().find(|set| fits(set)).unwrap_or(&even[3]).clone();
    }
    let mut sets = choices.iter().map(|choice| powers(&places(range, *choice)));
    let mut chosen = sets.find(|set| fits(set)).unwrap_or_default();
    if decades <= 8.0 {
        for place in places(range, (&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 1)) {
            let at = value(place);
            if chosen.iter().all(|tick| (tick.at / at - 1.0).abs() > 1e-6) {
                chosen.push(Tick { at, text: String::new() });
            }
        }
    }
    chosen
}

fn value((mantissa, exponent): (f64, i32)) -> f64 {
    // Dividing by a power of ten is exact where multiplying by its inverse is not.
    if exponent < 0 { mantissa / 10f64.powi(-exponent) } else { mantissa * 10f64.powi(exponent) }
}

/// Returns the mantissas in every so many decades that a range contains, with their exponents.
fn places(range: (f64, f64), (mantissas, every): (&[f64], i32)) -> Vec<(f64, i32)> {
    const SLACK: f64 = 1e-9;
    #[expect(clippy::cast_possible_truncation, reason = "exponents of numbers are within ±308")]
    let (first, last) = (range.0.log10().floor() as i32, range.1.log10().ceil() as i32);
    (first..=last)
        .filter(|exponent| exponent.rem_euclid(every) == 0)
        .flat_map(|exponent| mantissas.iter().map(move |&mantissa| (mantissa, exponent)))
        .filter(|place| (range.0 * (1.0 - SLACK)..=range.1 * (1.0 + SLACK)).contains(&value(*place)))
        .collect()
}

/// Ticks with plain numbers, or with powers of ten if one of the numbers would be long.
fn powers(places: &[(f64, i32)]) -> Vec<Tick> {
    let is_plain = places.iter().all(|(_, exponent)| (-4..6).contains(exponent));
    let text = |(mantissa, exponent): (f64, i32)| match (mantissa == 1.0, exponent) {
        _ if is_plain => {
            let decimals = i32::from(mantissa.fract() != 0.0) - exponent;
            format!("{:.*}", usize::try_from(decimals).unwrap_or(0), value((mantissa, exponent)))
        }
        (_, 0) => format!("{mantissa}"),
        (true, _) => format!("10{}", superscript(f64::from(exponent))),
        (false, _) => format!("{mantissa}·10{}", superscript(f64::from(exponent))),
    };
    places.iter().map(|place| Tick { at: value(*place), text: text(*place) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis, (first, last): (f64, f64)) -> Vec<String> {
        let ticks = numbers(axis, (first, last), 5.0, |ticks| ticks.len() <= 12);
        ticks.into_iter().map(|tick| tick.text).collect()
    }

    #[test]
    fn regress_names_that_begin_alike_differ_when_they_are_shortened() {
        let names = ["maximum-likelihood", "maximum-likelihood-adaptive", "bipolar"];
        let axis = Axis::categories("", names.map(str::to_owned));
        let ticks = vertical(&axis, (-0.5, 2.5), 60.0, 80.0);
        let texts: Vec<&str> = ticks.iter().map(|tick| tick.text.as_str()).collect();
        assert!(texts[0] != texts[1] && texts[2] == "bipolar", "{texts:?}");
        assert!(ticks.iter().all(|tick| text_width(tick) <= 80.0), "{texts:?}");
        assert!(texts[1].starts_with('m') && texts[1].ends_with('e'), "{texts:?}");
    }

    #[test]
    fn law_ticks_are_round_numbers() {
        let auto = Axis::new("");
        assert_eq!(texts(&auto, (-0.05, 0.55)), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(texts(&auto, (-3.0, 2.0)), ["−3", "−2", "−1", "0", "1", "2"]);
        assert_eq!(texts(&auto.clone().step(60.0), (0.0, 180.0)), ["0", "60", "120", "180"]);
        assert_eq!(texts(&auto, (0.0, 4e-5)), ["0", "1·10⁻⁵", "2·10⁻⁵", "3·10⁻⁵", "4·10⁻⁵"]);
        assert_eq!(texts(&auto, (2.3e-20, 6.1e-20)), ["3·10⁻²⁰", "4·10⁻²⁰", "5·10⁻²⁰", "6·10⁻²⁰"]);
    }

    #[test]
    fn law_what_is_counted_is_marked_at_whole_numbers() {
        assert_eq!(texts(&Axis::new(""), (0.9, 3.1)), ["1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(texts(&Axis::new("").whole(), (0.9, 3.1)), ["1", "2", "3"]);
        assert_eq!(texts(&Axis::new("").whole(), (0.0, 40.0)), texts(&Axis::new(""), (0.0, 40.0)));
    }

    #[test]
    fn law_too_fine_a_step_is_thinned() {
        assert!(texts(&Axis::new("").step(0.001), (0.0, 360.0)).len() <= 13);
    }

    /// Ranges of any place and extent, on axes from the width of a phone to that of a desk.
    #[test]
    fn law_texts_of_numbers_are_apart_on_any_axis() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        for number in 0..4000 {
            let log = number % 2 == 0;
            let low = 10f64.powf(24.0 * random() - 12.0);
            let sign = if log || number % 3 == 0 { 1.0 } else { -1.0 };
            let extent = 10f64.powf(if log { 12.0 * random() - 2.0 } else { 6.0 * random() - 4.0 });
            let range =
                if log { (low, low * (1.0 + extent)) } else { (sign * low, sign * low + extent * low) };
            let axis = if log { Axis::new("").log10() } else { Axis::new("") };
            let axis = if number % 5 == 0 { axis.step(0.01 * extent * low) } else { axis };
            let (wide, tall) = (150.0 + 700.0 * random(), 60.0 + 500.0 * random());
            let scale = Scale::new(range, axis.scale);
            let apart = |ticks: Vec<Tick>, long: f64, room: &dyn Fn(&Tick) -> f64| {
                let mut shown: Vec<Tick> = ticks.into_iter().filter(|tick| !tick.text.is_empty()).collect();
                shown.sort_by(|a, b| a.at.total_cmp(&b.at));
                assert!(shown.len() <= 28, "{shown:?}");
                for pair in shown.windows(2) {
                    let [from, to] = [0, 1].map(|k| scale.at(pair[k].at, (0.0, long)));
                    let free = to - from - 0.5 * (room(&pair[0]) + room(&pair[1]));
                    assert!(free >= 3.0, "{pair:?} are {free} apart on {long} px of {range:?}");
                }
            };
            apart(horizontal(&axis, &scale, (0.0, wide), 60.0).0, wide, &text_width);
            apart(vertical(&axis, range, tall, 100.0), tall, &|_| SMALL);
        }
    }

    fn log_texts(range: (f64, f64), most: usize) -> Vec<String> {
        let found = log_ticks(range, |ticks| ticks.len() <= most);
        found.into_iter().map(|tick| tick.text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn law_ticks_of_a_logarithmic_axis_are_as_many_as_fit() {
        assert_eq!(log_texts((0.01, 1.0), 10), ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
        assert_eq!(log_texts((0.01, 1.0), 5), ["0.01", "0.03", "0.1", "0.3", "1"]);
        assert_eq!(log_texts((0.01, 1.0), 4), ["0.01", "0.1", "1"]);
        assert_eq!(log_texts((1.2, 4.9), 9), ["1.5", "2", "3", "4"]);
        assert_eq!(log_texts((2.2, 2.8), 9), ["2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8"]);
        assert_eq!(log_texts((2.2, 2.8), 5), ["2.2", "2.4", "2.6", "2.8"]);
        assert_eq!(log_texts((1e-9, 1.0), 4), ["10⁻⁹", "10⁻⁶", "10⁻³", "1"]);
        assert!(log_texts((1e-300, 1e300), 8).len() <= 8);
    }

    #[test]
    fn law_marks_between_fill_the_decades() {
        let all = log_ticks((1.0, 100.0), |ticks| ticks.len() <= 3);
        assert_eq!((all.len(), all.iter().filter(|tick| tick.text.is_empty()).count()), (19, 16));
    }
}
