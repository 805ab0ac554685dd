//! Sweep axes: the keys that are varied, and the points of the sweep.

use std::f64::consts::LN_10;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use standstill_interface::choice;
use standstill_numeric::{exp, log10, whole};
use standstill_sim::{Purpose, Streams};
use toml::Value;

use super::document::{Document, FileError, Origin};
use super::named::Named;
use super::number::Number;

/// Values that a sweep axis gives to its key.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AxisSpec {
    /// A list of values, taken one after the other.
    List(Vec<Value>),
    /// A range from one number to another.
    Range(RangeSpec),
}

/// A range of numbers.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeSpec {
    /// The first value, such as `"0 mA"` or `5`.
    #[schemars(with = "NumberOrText")]
    pub from: Value,
    /// The last value, in a unit of the same dimension.
    #[schemars(with = "NumberOrText")]
    pub to: Value,
    /// Number of values of a grid, both ends included. Other designs spread all their points over the range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// True for a geometric range: neighbouring values have the same ratio instead of the same difference.
    #[serde(default)]
    pub log: bool,
}

/// A number or a text; used only in the schema.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "it describes what a TOML value may be here")]
enum NumberOrText {
    Number(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for AxisSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = AxisSpec;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                write!(f, "a list of values, or a table {{ from = …, to = …, points = … }}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<AxisSpec, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(AxisSpec::List)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AxisSpec, A::Error> {
                RangeSpec::deserialize(MapAccessDeserializer::new(map)).map(AxisSpec::Range)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for AxisSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Axis".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let range = RangeSpec::json_schema(generator);
        json_schema!({ "anyOf": [{ "type": "array", "minItems": 1 }, range] })
    }
}

impl AxisSpec {
    /// Parses an axis as written on the command line: `from:to:points`, with `:log` at the end for a geometric range,
    /// or values separated by commas.
    pub fn parse(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let value = |text: &str| {
            let parsed = format!("value = {text}").parse::<toml::Table>().ok();
            parsed.and_then(|mut table| table.remove("value")).unwrap_or_else(|| text.into())
        };
        match parts[..] {
            [list] => {
                let values: Vec<Value> = list.split(',').map(|text| value(text.trim())).collect();
                Ok(Self::List(values))
            }
            [from, to, points] | [from, to, points, "log"] => {
                let points = points.parse().map_err(|_| {
                    format!("found `{points}` points, needed a whole number, as in 0:50 mA:11")
                })?;
                let log = parts.len() == 4;
                Ok(Self::Range(RangeSpec { from: value(from), to: value(to), points: Some(points), log }))
            }
            _ => Err(format!("found `{text}`, needed from:to:points, from:to:points:log or a,b,c")),
        }
    }
}

choice! {
    /// The choice of points from the axes.
    #[derive(Default)]
    pub enum DesignKind {
        /// All combinations.
        Grid = "grid" default,
        /// Each axis is cut into as many equal parts as there are points, and each part is used once.
        LatinHypercube = "latin-hypercube",
        /// A scrambled Sobol sequence: any number of its first points fills the space evenly.
        Sobol = "sobol",
    }
}

/// The points of the axes that are run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DesignTable {
    /// The choice of points.
    pub kind: Named<DesignKind>,
    /// Number of points; that of a grid follows from its axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
}

/// One point of the sweep, with a value for the key of each axis, in the order of the axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Path of each axis' key, and the key's value at this point.
    pub values: Vec<(String, Value)>,
}

/// Largest number of points of a design. The check of a point before the first trial takes about 0.14 ms. Each axis of a point occupies 300
/// bytes of memory until the last trial.
const MOST_POINTS: usize = 1_000_000;

/// A checked axis whose values can be computed.
enum Axis<'a> {
    List(&'a [Value]),
    Range { from: Number, to: Number, points: Option<usize>, log: bool },
}

impl<'a> Axis<'a> {
    fn new(key: &str, spec: &'a AxisSpec) -> Result<Self, FileError> {
        let key = format!("axes.{key}");
        match spec {
            AxisSpec::List(values) if values.is_empty() => {
                Err(FileError::key(&key, "an empty list", "at least one value"))
            }
            AxisSpec::List(values) => {
                match values.iter().enumerate().find(|(k, value)| values[..*k].contains(value)) {
                    // Both points would have the same trials, which would count twice.
                    Some((_, twice)) => {
                        Err(FileError::key(&key, &format!("{twice} twice"), "each value once"))
                    }
                    None => Ok(Self::List(values)),
                }
            }
            AxisSpec::Range(range) => {
                let of = |value: &Value| {
                    Number::of(value).ok_or_else(|| {
                        FileError::key(&key, &format!("{value}"), "a number, with its unit if it has one")
                    })
                };
                let (from, to) = (of(&range.from)?, of(&range.to)?);
                let (from, to) = Number::alike(from, to).ok_or_else(|| {
                    let found = format!("{} and {}", range.from, range.to);
                    FileError::key(&key, &found, "both ends in the same unit")
                })?;
                if range.log && !(from.value > 0.0 && to.value > 0.0) {
                    let found = format!("{} and {}", range.from, range.to);
                    return Err(FileError::key(&key, &found, "positive ends of a logarithmic axis"));
                }
                if from == to && range.points != Some(1) {
                    let found = format!("{} at both ends", range.from);
                    return Err(FileError::key(&key, &found, "two ends, or 1 point"));
                }
                if range.points == Some(0) {
                    return Err(FileError::key(&key, "0 points", "at least 1"));
                }
                Ok(Self::Range { from, to, points: range.points, log: range.log })
            }
        }
    }

    /// Returns the number of values that this axis has on a grid.
    fn count(&self, key: &str) -> Result<usize, FileError> {
        match self {
            Self::List(values) => Ok(values.len()),
            Self::Range { points, .. } => points.ok_or_else(|| {
                FileError::key(&format!("axes.{key}"), "no `points`", "how many values a grid takes")
            }),
        }
    }

    /// Returns the value with index `number`, from 0, on a grid of `count` values.
    fn on_grid(&self, number: usize, count: usize) -> Value {
        match self {
            Self::List(values) => values[number].clone(),
            Self::Range { .. } if count == 1 => self.at(0.0),
            Self::Range { .. } => self.at(number as f64 / (count - 1) as f64),
        }
    }

    /// Returns the value at the position `share` along the axis. Position 0 is the first value, position 1 the last value.
    fn at(&self, share: f64) -> Value {
        match self {
            Self::List(values) => {
                // A share of the list's length is an index.
                let place = whole::<usize>(share * values.len() as f64).min(values.len() - 1);
                values[place].clone()
            }
            Self::Range { from, to, log, .. } => {
                let value = if *log {
                    let [a, b] = [from.value, to.value].map(log10);
                    exp((a + (b - a) * share) * LN_10)
                } else {
                    from.value + (to.value - from.value) * share
                };
                // Both ends keep their numbers as they were written.
                if share == 0.0 {
                    from.to_value()
                } else if share == 1.0 {
                    to.to_value()
                } else {
                    Number { value, ..from.clone() }.to_value()
                }
            }
        }
    }
}

/// Checks that no value from the command line is replaced by an axis at every point. An axis replaces the value of its own key, the values
/// of keys below this key, and values in a table that contains this key.
pub(super) fn check_typed<'a>(
    document: &Document,
    axes: impl Iterator<Item = &'a String>,
) -> Result<(), FileError> {
    let below = |key: &str, table: &str| key.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
    for axis in axes {
        // `key` is the axis itself, a key in a table that the axis replaces as a whole, or a table that contains the
        // axis.
        let covered =
            |key: &str| key == axis || below(key, axis) || below(axis, key) && document.get(axis).is_some();
        let typed = |origin: &Origin| matches!(origin, Origin::CommandLine | Origin::Option(_));
        let set = document.changed.iter().find(|(key, origin)| typed(origin) && covered(key));
        if let Some((key, origin)) = set {
            return Err(FileError::Key {
                place: origin.to_string(),
                key: key.clone(),
                message: format!(
                    "found a value, but `{axis}` is an axis of the scenario, whose values take its place at every point; needed \
                     no value (`trace --point` chooses a point), `-s 'axes.{axis}=[VALUE]'` for this value alone, or \
                     `-s 'axes={{}}'` for no axes"
                ),
            });
        }
    }
    Ok(())
}

type Walked<'a> = Vec<(&'a str, Axis<'a>)>;

fn walked(axes: &[(String, AxisSpec)]) -> Result<Walked<'_>, FileError> {
    axes.iter().map(|(key, spec)| Ok((key.as_str(), Axis::new(key, spec)?))).collect()
}

/// Returns the number of values of each axis on a grid, and the number of all combinations.
fn of_grid(walked: &Walked<'_>) -> Result<(Vec<usize>, usize), FileError> {
    let counts = walked.iter().map(|(key, axis)| axis.count(key)).collect::<Result<Vec<_>, _>>()?;
    let all = counts.iter().try_fold(1_usize, |all, count| all.checked_mul(*count));
    let most = |all: &usize| *all <= MOST_POINTS;
    let all = all.filter(most).ok_or_else(|| {
        let found =
            all.map_or_else(|| "more points than can be counted".to_owned(), |all| format!("{all} points"));
        let needed =
            format!("at most {MOST_POINTS}: each is checked before the first trial and kept until the last");
        FileError::key("axes", &found, &needed)
    })?;
    Ok((counts, all))
}

/// Returns the number of points of a design without making them.
pub fn count(axes: &[(String, AxisSpec)], design: DesignTable) -> Result<usize, FileError> {
    match design.kind.0 {
        DesignKind::Grid => of_grid(&walked(axes)?).map(|(_, all)| all),
        DesignKind::LatinHypercube | DesignKind::Sobol => Ok(design.points.unwrap_or(0)),
    }
}

/// Returns the points of a design; without axes, a single point without values. `seed` is the seed of the random designs.
pub fn points(axes: &[(String, AxisSpec)], design: DesignTable, seed: u64) -> Result<Vec<Point>, FileError> {
    let walked = walked(axes)?;
    let point = |value: &dyn Fn(usize, &Axis<'_>) -> Value| Point {
        values: walked
            .iter()
            .enumerate()
            .map(|(k, (key, axis))| ((*key).to_owned(), value(k, axis)))
            .collect(),
    };
    if design.kind.0 == DesignKind::Grid {
        if design.points.is_some() {
            let needed = "no `points` for a grid, whose axes have their own";
            return Err(FileError::key("design.points", "points", needed));
        }
        let (counts, all) = of_grid(&walked)?;
        // The last axis varies fastest.
        let place = |number: usize, k: usize| number / counts[k + 1..].iter().product::<usize>() % counts[k];
        return Ok((0..all).map(|n| point(&|k, axis| axis.on_grid(place(n, k), counts[k]))).collect());
    }
    let count = design.points.filter(|count| (1..=MOST_POINTS).contains(count)).ok_or_else(|| {
        let found = design.points.map_or("no number".to_owned(), |points| points.to_string());
        FileError::key("design.points", &found, &format!("from 1 to {MOST_POINTS}"))
    })?;
    if axes.is_empty() {
        let needed = "axes, over which a design spreads its points";
        return Err(FileError::key("design.points", "no axes", needed));
    }
    match design.kind.0 {
        DesignKind::Grid => unreachable!("returned above"),
        DesignKind::LatinHypercube => {
            let orders: Vec<Vec<usize>> = (0..walked.len())
                .map(|k| {
                    let mut order: Vec<usize> = (0..count).collect();
                    let mut draws = Streams::new(seed, k as u64).open(Purpose::Design);
                    for last in (1..count).rev() {
                        // The draw is at most `last`.
                        #[allow(clippy::cast_possible_truncation)]
                        let with = draws.integer(last as u64) as usize;
                        order.swap(last, with);
                    }
                    order
                })
                .collect();
            let share = |n: usize, k: usize| (orders[k][n] as f64 + 0.5) / count as f64;
            Ok((0..count).map(|n| point(&|k, axis| axis.at(share(n, k)))).collect())
        }
        DesignKind::Sobol => {
            if count > 1 << 16 || walked.len() > 256 {
                let found = format!("{count} points of {} axes", walked.len());
                return Err(FileError::key("design", &found, "at most 65536 points of 256 axes"));
            }
            // The sequence is scrambled by the low 32 bits of the seed.
            #[allow(clippy::cast_possible_truncation)]
            let key = seed as u32;
            let share = |n: usize, k: usize| {
                let [n, k] = [n, k].map(|x| u32::try_from(x).unwrap_or(u32::MAX));
                f64::from(sobol_burley::sample(n, k, key))
            };
            Ok((0..count).map(|n| point(&|k, axis| axis.at(share(n, k)))).collect())
        }
    }
}
