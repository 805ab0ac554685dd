//! Szalay and Fodor (2023): measured currents under a pulse along the magnet and against it.

use std::sync::atomic::AtomicBool;

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_numeric::{ln, root};
use standstill_scenario::{Document, Specimen};

use super::{Paper, PaperError, Statement};
use crate::bound::replay::replay;

pub(super) const PAPER: Paper = Paper {
    name: "szalay-2023",
    citation: "I. Szalay, D. Fodor, \"Nonlinear PMSM Model Implementation in MATLAB-Simulink for Sensorless Polarity Detection\", \
               EDPE 2023, doi 10.1109/EDPE58625.2023.10273864; records beside their models, github.com/Szalay/QS-SLVA",
    assumed: &[
        "36 V in all of the pulse, MOSFETs, no dead time; of the quadrature axis the records show nothing",
        "a pulse of 72.9 µs: the currents begin to rise 77.1 µs after the record, whose last row of the pulse is at 150 µs",
        "resistance, inductance and eddy currents as fitted to these authors' records: the pulses are described, not predicted",
        "their resistance is 0.645 Ω, the fitted one 0.449 Ω: their model has no eddy currents; the link sags by 0.06 Ω, for which a fit with 36 V finds 0.04 Ω too much",
        "the paper itself was not read; its numbers are those of the files",
    ],
    statements,
};

/// Length of the pulse in s.
const T: f64 = 72.9e-6;

/// Current in A of phase a at the end of a pulse along phase a, with the rotor at this angle in degrees.
fn pulse(angle: f64) -> Result<f64, PaperError> {
    let document = Document::parse("paper.toml".as_ref(), include_str!("szalay-2023.toml"))?;
    let scenario = document.scenario_of(&document.motor()?)?;
    let mut case = scenario.case_at(angle.to_radians(), Specimen { drive: 0, noise: 0 });
    case.sensors.settings.adc = None;
    let length = Nanos::from_seconds(T);
    let stage = |legs, duration| Stage { legs: Abc(legs), duration };
    let command = Command::sequence(
        stage([Leg::High, Leg::Low, Leg::Low], length),
        stage([Leg::Off; 3], Nanos::from_micros(1000)),
        Sampling { first: length, interval: length, count: 1 },
    );
    let readings = replay(&case, &[command])?;
    Ok(readings.value.first().map_or(f64::NAN, |values| values[0]))
}

/// The current in A at the time [`T`] by the authors' law, L_d = L − (9/4) Γ i, with R in Ω, L in H and Γ in H/A. `way`: 1 along the
/// magnet, −1 against it.
fn law([resistance, inductance, gamma]: [f64; 3], way: f64) -> f64 {
    let (a, volts) = (2.25 * gamma, way * 24.0);
    let time = |i: f64| {
        a * i / resistance
            - (inductance - a * volts / resistance) / resistance * ln(1.0 - resistance * i / volts)
    };
    root(0.0, 20.0, |i| Some(time(way * i) - T)).unwrap_or(f64::NAN)
}

fn statements(_: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
    let [along, against] = [pulse(0.0)?, pulse(180.0)?.abs()];
    let own = [0.645, 145e-6, 0.162e-6];
    let difference = |along: f64, against: f64| 100.0 * (along - against) / (0.5 * (along + against));
    let (by_law, here) = ("their law", "this simulator");
    Ok(vec![
        Statement::new("measured current after 72.9 µs along the magnet", here, "A", [10.556, along], 0.01),
        Statement::new(
            "measured current after 72.9 µs against the magnet",
            here,
            "A",
            [10.340, against],
            0.01,
        ),
        Statement::new(
            "difference of both, of their mean",
            here,
            "%",
            [2.07, difference(along, against)],
            0.25,
        ),
        Statement::new(
            "current along the magnet, their parameters",
            by_law,
            "A",
            [10.427, law(own, 1.0)],
            0.002,
        ),
        Statement::new(
            "current against the magnet, their parameters",
            by_law,
            "A",
            [10.189, law(own, -1.0)],
            0.002,
        ),
    ])
}
