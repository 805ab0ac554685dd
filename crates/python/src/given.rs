//! What a class of Python is given for each of its objects: what the drive knows, settings, a seed.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use standstill_detect::Signature;
use standstill_scenario::Given;
use standstill_sim::Adc;
use toml::Value;

use crate::Error;

/// Which of `drive`, `config` and `seed` the class has as arguments.
#[derive(Clone, Debug)]
pub struct Takes(pub Vec<String>);

impl Takes {
    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|taken| taken == name)
    }
}

/// Sets the arguments that a class takes.
///
/// # Errors
/// The scenario has settings, and the class does not take them.
pub fn give(
    py: Python<'_>,
    given: &Given,
    seed: u64,
    takes: &Takes,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<()> {
    if takes.has("drive") {
        keywords.set_item("drive", drive(py, given)?)?;
    }
    if takes.has("seed") {
        keywords.set_item("seed", seed)?;
    }
    if takes.has("config") {
        let config = PyDict::new(py);
        for (key, value) in &given.config {
            config.set_item(key, setting(py, value)?)?;
        }
        keywords.set_item("config", config)?;
    } else if let Some((key, value)) = given.config.first() {
        return Err(Error::new_err(format!(
            "`detector.config.{key}`: found {value}, needed a class whose `__init__` has an argument `config`"
        )));
    }
    Ok(())
}

/// A setting as Python has it.
fn setting<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        other => other.to_string().into_pyobject(py)?.into_any(),
    })
}

/// What the drive knows, as an object of the package's class.
fn drive<'py>(py: Python<'py>, given: &Given) -> PyResult<Bound<'py, PyAny>> {
    let (knows, sensors) = (&given.nameplate, &given.sensors);
    let comparator = knows.sensing.comparator;
    // What is not rounded has no counts.
    let rounding = |adc: Option<Adc>| adc.filter(|adc| adc.rounds());
    let (current, link) = (rounding(sensors.adc), rounding(sensors.dc_link.adc));
    let terminal = rounding(sensors.terminal.and_then(|dividers| dividers.adc));
    // A count is the sum of all conversions of a sample.
    let step = |adc: Option<Adc>| adc.map_or(0.0, |adc| adc.step() / f64::from(sensors.oversampling.max(1)));
    let bits = |adc: Option<Adc>| adc.map_or(0, |adc| u32::from(adc.bits));
    let all = PyDict::new(py);
    for (name, value) in [
        ("dc_link", knows.dc_link),
        ("rated_current", knows.rated_current),
        ("resistance", knows.resistance),
        ("ld", knows.d_axis_inductance),
        ("lq", knows.q_axis_inductance),
        ("flux", knows.magnet_flux),
        ("dead_time", knows.dead_time.seconds()),
        ("period", knows.carrier_period.seconds()),
        ("settle", knows.sensing.settle.seconds()),
        ("amps_per_count", step(current)),
        ("amps_at_zero", current.map_or(0.0, |adc| adc.low)),
        ("volts_per_count", step(link)),
        ("terminal_volts_per_count", step(terminal)),
        ("timer_tick", comparator.tick),
        ("comparator_delay", comparator.delay),
        ("comparator_offset", comparator.offset),
        ("comparator_noise", comparator.noise),
        ("comparator_delay_spread", comparator.delay_spread),
        ("comparator_blanking", comparator.blanking),
        ("threshold_highest", comparator.highest),
    ] {
        all.set_item(name, value)?;
    }
    let comparators = match comparator {
        of if of.tick == 0.0 => 0,
        of if of.own => 6,
        _ => 1,
    };
    for (name, value) in [
        ("current_bits", bits(current)),
        ("dc_link_bits", bits(link)),
        ("terminal_bits", bits(terminal)),
        ("comparators", comparators),
    ] {
        all.set_item(name, value)?;
    }
    let stronger = match knows.signature {
        Signature::Normal => 1,
        Signature::Inverted => -1,
        Signature::None => 0,
    };
    all.set_item("stronger_pole", stronger)?;
    py.import("standstill._detector")?.getattr("Nameplate")?.call((), Some(&all))
}
