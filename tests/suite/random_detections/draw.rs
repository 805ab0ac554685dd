//! Random scenarios as text: what a seed gives is a scenario file, which `standstill run` reads too.

#![allow(clippy::format_push_string, reason = "texts of TOML, a key at a time")]

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use standstill_detect::{Method, MethodName};
use standstill_interface::Choice;
use standstill_numeric::{exp, ln};
use standstill_plant::built_in_names;
use standstill_scenario::{ErrorSet, FaultMode, FaultPlace, Key, Rotor, Scenario, Values, keys};
use standstill_sim::Arrangement;
use toml::Value;

/// Keys of the run itself, keys of a user's detector, and those that [`base`] draws.
const LEFT_OUT: [&str; 13] = [
    "errors",
    "trials",
    "seed",
    "limit",
    "stop_at.rms",
    "stop_at.wrong_poles",
    "detector.method",
    "detector.library",
    "detector.python",
    "detector.call_timeout",
    "detector.config",
    "detector.time_limit",
    "rotor.state",
];

/// Most carrier periods of a detection: an injection needs 1300, and each takes a dozen steps. What is not done by then ends
/// with that name.
const MOST_PERIODS: f64 = 1.5e3;

/// Methods that take a hundred times as many steps as the others; they are drawn more rarely.
const LONG: [&str; 3] = ["hfi-rotating", "hfi-pulsating", "dc-alignment"];

/// Returns a number whose logarithm is uniform between those of `low` and `high`.
pub fn log(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    exp(rng.random_range(ln(low)..ln(high)))
}

fn one_of<T: Copy>(rng: &mut ChaCha8Rng, all: &[T]) -> T {
    all[rng.random_range(0..all.len())]
}

/// Draws motor, errors, method, sensors and motion: lines of a scenario file, the motor first.
pub fn base(rng: &mut ChaCha8Rng, seed: u64) -> Vec<String> {
    let mut lines = vec![motor(rng), format!("seed = {seed}")];
    lines.push(format!("errors = \"{}\"", one_of(rng, ErrorSet::NAMES)));
    let mut method = one_of(rng, MethodName::NAMES);
    if LONG.contains(&method) && rng.random_bool(0.7) {
        method = one_of(rng, MethodName::NAMES);
    }
    lines.push(format!("detector.method = \"{method}\""));
    if rng.random_bool(0.5) {
        lines.push(format!("sensors.arrangement = \"{}\"", one_of(rng, Arrangement::NAMES)));
    }
    if rng.random_bool(0.3) {
        lines.push("sensors.terminals = true".to_owned());
    }
    if rng.random_bool(0.2) {
        lines.push(format!("sensors.timer = {:e}", log(rng, 1e-8, 1e-5)));
    }
    if rng.random_bool(0.15) {
        lines.push(format!("inverter.terminal_capacitance = {:e}", log(rng, 1e-10, 1e-8)));
    }
    if rng.random_bool(0.25) {
        lines.push(format!("inverter.capacitance = {:e}", log(rng, 1e-7, 1e-1)));
        lines.push(format!("inverter.source_resistance = {:e}", log(rng, 1e-3, 1e2)));
    }
    let state = one_of(rng, Rotor::NAMES);
    lines.push(format!("rotor.state = \"{state}\""));
    if matches!(state, "free" | "driven") && rng.random_bool(0.4) {
        let sign = one_of(rng, &[-1.0, 1.0]);
        lines.push(format!("rotor.speed = {:e}", sign * log(rng, 1e-3, 1e4)));
    }
    lines
}

/// Draws a motor: a built-in one, one that differs from it, one by a nameplate, or one by a flux map.
fn motor(rng: &mut ChaCha8Rng) -> String {
    let names: Vec<&str> = built_in_names().collect();
    match rng.random_range(0..400) {
        0..150 => format!("motor = \"{}\"", one_of(rng, &names)),
        150..220 => {
            let extras = extras(rng, 1.0);
            format!("motor = {{ base = \"{}\"{extras} }}", one_of(rng, &names))
        }
        220..399 => nameplate(rng),
        _ => format!(
            "motor = {{ name = \"mapped\", rating = {{ current = 8.8, dc_link = 550 }}, \
             winding = {{ pole_pairs = 2, resistance = 0.63 }}, \
             map = {{ file = \"examples/maps/{}\" }}, \
             rotor = {{ inertia = 0.015, stiction = 0.2, coulomb = 0.2, viscous = 0 }} }}",
            one_of(rng, &["both_sides.csv", "measured.csv"])
        ),
    }
}

/// Draws eddy currents, hysteresis and temperatures' coefficients; `current` is of the order of the rated one.
fn extras(rng: &mut ChaCha8Rng, current: f64) -> String {
    let mut text = String::new();
    if rng.random_bool(0.4) {
        let [time, d, q] = [log(rng, 1e-6, 1e-2), rng.random_range(0.0..0.9), rng.random_range(0.0..0.9)];
        text += &format!(", eddy = {{ time_constant = {time:e}, d_depth = {d:.3}, q_depth = {q:.3} }}");
    }
    if rng.random_bool(0.3) {
        let [coercive, depth] = [current * log(rng, 1e-4, 0.1), log(rng, 0.001, 0.5)];
        let cells = rng.random_range(1..=6);
        text += &format!(
            ", hysteresis = {{ coercive_current = {coercive:e}, depth = {depth:e}, cells = {cells} }}"
        );
    }
    text
}

/// Draws the numbers of a nameplate over orders of magnitude, mostly such that a pulse does something.
fn nameplate(rng: &mut ChaCha8Rng) -> String {
    let wild = rng.random_bool(0.15);
    let [current, link] = [log(rng, 0.05, 3e3), log(rng, 4.0, 1.5e3)];
    let impedance = link / current;
    // From the time in which the link raises rated current, and its drop.
    let (time, drop) = if wild { ([1e-7, 1.0], [1e-7, 30.0]) } else { ([1e-5, 2e-2], [1e-4, 0.4]) };
    let along = impedance * log(rng, time[0], time[1]);
    let resistance = impedance * log(rng, drop[0], drop[1]);
    let ratio = if rng.random_bool(0.1) { 1.0 } else { log(rng, 0.3, 6.0) };
    let flux = if rng.random_bool(0.05) {
        0.0
    } else {
        along * current * log(rng, if wild { 1e-3 } else { 0.1 }, if wild { 1e3 } else { 20.0 })
    };
    let mut text = format!(
        "motor = {{ name = \"drawn\", nameplate = {{ pole_pairs = {}, resistance = {resistance:e}, L_d = {along:e}, \
         L_q = {:e}, magnet_flux = {flux:e}, rated_current = {current:e}, dc_link = {link:e}",
        one_of(rng, &[1, 2, 3, 4, 5, 7, 10, 21, 50, 200]),
        along * ratio,
    );
    if rng.random_bool(0.4) {
        let leakage = along * ratio.min(1.0) * rng.random_range(0.0..0.5);
        text += &format!(", leakage = {leakage:e}");
    }
    if rng.random_bool(0.7) {
        let share = |rng: &mut ChaCha8Rng| rng.random_range(0.0..0.6);
        text += &format!(", saturation = {{ d = {:.4}", share(rng));
        if rng.random_bool(0.5) {
            text += &format!(", minus_d = {:.4}", share(rng) - 0.3);
        }
        if rng.random_bool(0.7) {
            text += &format!(", q = {:.4}", share(rng));
        }
        text += " }";
    }
    text += " }";
    text += &extras(rng, current);
    if rng.random_bool(0.25) {
        let size = along * ratio.min(1.0);
        text += &format!(
            ", harmonics = {{ inductance_4 = {:e}, asymmetry = {:e}, flux_5 = {:e}, flux_7 = {:e} }}",
            size * rng.random_range(-0.1..0.1),
            size * rng.random_range(-0.1..0.1),
            flux * rng.random_range(-0.1..0.1),
            flux * rng.random_range(-0.1..0.1),
        );
    }
    if rng.random_bool(0.5) {
        // From the time in which rated current turns the rotor by a radian.
        let torque = flux.max(0.01 * along * current) * current;
        let inertia = torque * log(rng, 1e-7, 1e1);
        let stiction = torque * log(rng, 1e-5, 1.0);
        let coulomb = stiction * rng.random_range(0.0..=1.0);
        let viscous = torque * log(rng, 1e-6, 1e-1);
        let play = rng.random_range(0.0..5.0);
        text += &format!(
            ", rotor = {{ inertia = {inertia:e}, stiction = {stiction:e}, coulomb = {coulomb:e}, \
             viscous = {viscous:e}, brake_backlash = {play:.4}"
        );
        if rng.random_bool(0.4) {
            let cogging = torque * log(rng, 1e-4, 0.3);
            let periods = one_of(rng, &[2, 6, 12, 36, 200]);
            text += &format!(", cogging_torque = {cogging:e}, cogging_periods = {periods}");
        }
        text += " }";
    }
    text + " }"
}

/// Draws a value of a key: near the one in use or its example, from its whole range, or an end of that.
fn value(rng: &mut ChaCha8Rng, key: &Key, now: Option<f64>) -> Option<Value> {
    match key.values() {
        Values::Choice(names) => Some(names[rng.random_range(0..names.len())].0.into()),
        Values::List(names) if rng.random_bool(0.6) => {
            let some = names.into_iter().filter(|_| rng.random_bool(0.5));
            Some(Value::Array(some.map(|(name, _)| name.into()).collect()))
        }
        Values::Flag | Values::List(_) => Some(Value::Boolean(rng.random())),
        Values::Text => None,
        Values::Number { .. } | Values::Whole => {
            let range = key.range?;
            let usual = now.filter(|now| *now != 0.0 && now.is_finite()).or_else(|| example(key));
            let usual = usual.filter(|usual| *usual != 0.0).unwrap_or(range.high.min(1.0));
            // 0.5 % from the ends, the others around what is usual or over all orders of magnitude.
            let sign = if range.low < 0.0 { one_of(rng, &[-1.0, 1.0]) } else { 1.0 };
            let number = match rng.random_range(0..100) {
                0..45 => usual * log(rng, 0.3, 3.0),
                45..75 => sign * usual.abs() * log(rng, 1e-2, 1e2),
                75..90 => {
                    let most = range.high.max(-range.low);
                    sign * log(rng, (1e-15 * most).max(range.low), most)
                }
                90..95 => rng.random_range(range.low..=range.high),
                95..98 => range.low,
                _ => range.high,
            };
            let number = if range.whole { number.round() } else { number };
            Some(Value::Float(number.clamp(range.low, range.high)))
        }
    }
}

/// Returns the number in a key's example, in SI units.
fn example(key: &Key) -> Option<f64> {
    let table: toml::Table = format!("x = {}", key.example).parse().ok()?;
    match &table["x"] {
        Value::String(text) => standstill_quantity::si_value(text),
        value => value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)),
    }
}

/// Draws values of up to eight keys that apply to a scenario and are not in its `base`, as lines of a scenario file.
pub fn some_keys(rng: &mut ChaCha8Rng, scenario: &Scenario<Method<f64>>, base: &[String]) -> Vec<String> {
    let taken = |path: &str| base.iter().any(|line| line.split(' ').next() == Some(path));
    let applies = |key: &&Key| {
        let known = !taken(key.path)
            && key.path.contains('.')
            && !LEFT_OUT.contains(&key.path)
            && key.applies_to(scenario);
        // A setting that the method does not have has no value.
        known && (!key.path.starts_with("detector.") || scenario.value(key.path).is_some())
    };
    let keys: Vec<&Key> = keys().filter(applies).collect();
    let mut lines = Vec::new();
    let mut taken = Vec::new();
    for _ in 0..rng.random_range(0..=8) {
        let key = one_of(rng, &keys);
        let now = scenario.value(key.path).and_then(|value| value.as_float());
        if !taken.contains(&key.path)
            && let Some(value) = value(rng, key, now)
        {
            taken.push(key.path);
            lines.push(format!("{} = {value}", key.path));
        }
    }
    lines
}

/// Limits the simulated time to what a detection of this scenario may need, and to `longest` in s, as a line of a scenario file.
pub fn time_limit(rng: &mut ChaCha8Rng, carrier_period: f64, longest: f64) -> String {
    let most = (MOST_PERIODS * carrier_period).clamp(1e-3, 20.0);
    let limit = if rng.random_bool(0.8) { most } else { log(rng, 1e-3, most.max(1.1e-3)) };
    format!("detector.time_limit = {:e}", limit.min(longest))
}

/// Draws up to three faults that a scenario can have, as a line of a scenario file; none for most scenarios.
pub fn faults(rng: &mut ChaCha8Rng, scenario: &Scenario<Method<f64>>) -> Option<String> {
    if rng.random_bool(0.6) {
        return None;
    }
    let modes: Vec<FaultMode> =
        FaultMode::ALL.iter().copied().filter(|mode| mode.lacks_usual(scenario).is_none()).collect();
    let between = |rng: &mut ChaCha8Rng, low: f64, high: f64| {
        if low >= high {
            return low;
        }
        if low > 0.0 { log(rng, low, high) } else { rng.random_range(low..=high) }
    };
    let mut tables: Vec<String> = Vec::new();
    for _ in 0..rng.random_range(1..=3) {
        let mode = one_of(rng, &modes);
        let once = mode == FaultMode::TurnsShorted && tables.iter().any(|table| table.contains(mode.name()));
        if once {
            continue;
        }
        let mut table = format!("{{ mode = \"{}\"", mode.name());
        if mode.has_place() && rng.random_bool(0.3) {
            table += &format!(", at = \"{}\"", one_of(rng, FaultPlace::NAMES));
        }
        if let Some(size) = mode.size() {
            let [low, high] = (size.typical)(scenario);
            let number = between(rng, low, high);
            let number = if mode == FaultMode::CurrentBit { number.round() } else { number };
            table += &format!(", magnitude = {number:e}");
        }
        for (key, further) in mode.further() {
            let [low, high] = (further.size.typical)(scenario);
            table += &format!(", {key} = {:e}", between(rng, low, high));
        }
        if mode.may_begin() && rng.random_bool(0.6) {
            table += &format!(", onset = {:e}", log(rng, 1e-9, 0.1));
            if rng.random_bool(0.5) {
                table += &format!(", command = {}", rng.random_range(1..=30));
            }
            if mode.may_pass() && rng.random_bool(0.4) {
                table += &format!(", lasts = {:e}", log(rng, 1e-9, 0.1));
            }
        }
        tables.push(table + " }");
    }
    Some(format!("faults = [{}]", tables.join(", ")))
}
