//! `standstill magnetics`.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use standstill_plant::{
    Continuation, Core, Files, FluxMap, MagneticCircuit, MapAxes, MapLayout, MapReport, MapSamples,
    OperatingPoint, PolaritySignature, PoleKnowledge, Survey,
};
use standstill_quantity::{decimals, number};

use crate::Report;
use crate::arguments::Magnetics;
use crate::error::Error;
use crate::figures;
use crate::interrupt;
use crate::output::Output;
use crate::text::table;

/// Points from no current to the largest.
const STEPS: u16 = 10;

/// What is surveyed: a motor, or a map without one.
struct Subject {
    name: String,
    magnetics: MagneticCircuit,
    /// The largest current in A where none is asked for.
    reach: f64,
    pole_pairs: Option<u32>,
    resistance: Option<f64>,
    map: Option<(FluxMap, MapReport)>,
}

impl Subject {
    fn read(options: &Magnetics) -> Result<Self, Error> {
        let path = Path::new(&options.motor);
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        if MapSamples::EXTENSIONS.contains(&extension.to_lowercase().as_str()) {
            return Self::map(path, options);
        }
        if options.pole_pairs.is_some() || options.resistance.is_some() {
            let message =
                "--pole-pairs and --resistance are for flux maps; a data sheet states them itself".to_owned();
            return Err(Error::Arguments(message));
        }
        if options.values.is_some() || options.columns.is_some() || options.beyond.is_some() {
            let message =
                "--values, --columns and --beyond are for flux maps; a data sheet states them in [map]"
                    .to_owned();
            return Err(Error::Arguments(message));
        }
        let sheet = super::sheet(&options.motor)?;
        let map = sheet.map().map_err(Error::Map)?;
        let motor = sheet.motor().map_err(Error::Motor)?.at_temperature(options.temperature.into())?;
        let covered = motor.magnetics.range().map_or(f64::INFINITY, covered);
        Ok(Self {
            name: motor.name,
            magnetics: motor.magnetics,
            reach: motor.rated_current.min(covered),
            pole_pairs: Some(motor.pole_pairs),
            resistance: Some(motor.resistance),
            map,
        })
    }

    fn map(path: &Path, options: &Magnetics) -> Result<Self, Error> {
        let temperature = options.temperature;
        if temperature.winding_temperature.is_some() || temperature.magnet_temperature.is_some() {
            let message =
                "a flux map has no temperature coefficients; put it into a data sheet with [thermal]"
                    .to_owned();
            return Err(Error::Arguments(message));
        }
        let layout = MapLayout { values: options.values, columns: options.columns.clone() };
        let samples = MapSamples::read_as(path, &Files::default(), &layout).map_err(Error::Map)?;
        let made = if options.beyond.is_some() { FluxMap::continued } else { FluxMap::new };
        let (map, report) = made(&samples).map_err(Error::Map)?;
        let reach = covered(report.range);
        if reach <= 0.0 {
            let [[d_low, d_high], [q_low, q_high]] = report.range;
            let message = format!(
                "{}: found i_d from {d_low} to {d_high} A, i_q from {q_low} to {q_high} A; needed: current to both sides of zero along d and q, as a detection drives it{}",
                report.file,
                if options.beyond.is_none() && q_high.min(-q_low) > 0.0 {
                    "; or --beyond fitted (in a data sheet: beyond = \"fitted\" in [map]), which continues it along d"
                } else {
                    ""
                }
            );
            return Err(Error::Arguments(message));
        }
        Ok(Self {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            magnetics: MagneticCircuit::new(Core::Map(map.clone())).map_err(Error::Magnetics)?,
            reach,
            pole_pairs: options.pole_pairs.or(samples.pole_pairs),
            resistance: options.resistance.or(samples.resistance),
            map: Some((map, report)),
        })
    }
}

/// Current in A that a map covers in all four directions.
fn covered([[d_low, d_high], [q_low, q_high]]: [[f64; 2]; 2]) -> f64 {
    (-d_low).min(d_high).min(-q_low).min(q_high)
}

pub fn run(options: &Magnetics) -> Result<Report, Error> {
    interrupt::at_once();
    let subject = Subject::read(options)?;
    let reach = options.current.unwrap_or(subject.reach);
    if let (Some((_, map)), Some(range)) = (&subject.map, subject.magnetics.range()) {
        let most = covered(range);
        if reach > most * (1.0 + 1e-9) {
            let [[d_low, d_high], [q_low, q_high]] = range;
            let message = format!(
                "--current {reach}: the map {} covers i_d from {d_low} to {d_high} A, i_q from {q_low} to {q_high} A; needed: at most {most} A",
                map.file
            );
            return Err(Error::Arguments(message));
        }
    }
    let uncertainty = subject.map.as_ref().map_or(0.0, |(_, map)| map.distance[0]);
    let mut survey = Survey::of(&subject.magnetics, reach, STEPS, uncertainty).map_err(Error::Magnetics)?;
    if let Some((_, map)) = &subject.map {
        // Of the data, not of what was made of them.
        survey.reciprocity_error = map.reciprocity_error;
        if map.axes == MapAxes::NoMagnet {
            // Without a magnet the poles are alike; what differs is the map's noise.
            survey.signature = PolaritySignature::None;
        }
    }
    if options.json {
        return Ok(Report { text: format!("{:#}\n", json_of(&subject, &survey)), code: 0 });
    }
    let mut output = Output::create(&options.out, &["magnetics.svg", "magnetics.png"])?;
    let figure = figures::magnetics(&survey, &subject.name);
    output.file("magnetics.svg", figure.svg()?.as_bytes())?;
    output.file("magnetics.png", &figure.png()?)?;
    let files = output.finish()?;
    let text = text_of(&subject, &survey) + &super::reproduce::file_list(&options.out, &files);
    Ok(Report { text, code: 0 })
}

const fn name(signature: PolaritySignature) -> &'static str {
    match signature {
        PolaritySignature::Normal => "normal",
        PolaritySignature::Inverted => "inverted",
        PolaritySignature::Mixed => "mixed",
        PolaritySignature::None => "none",
    }
}

const fn meaning(signature: PolaritySignature) -> &'static str {
    match signature {
        PolaritySignature::Normal => "the larger current is north",
        PolaritySignature::Inverted => {
            "the larger current is south: the paper's polarity test names the wrong pole"
        }
        PolaritySignature::Mixed => "which pole draws the larger current depends on the current",
        PolaritySignature::None => {
            "both poles draw the same current, as far as is known: a polarity test has no answer"
        }
    }
}

fn json_of(subject: &Subject, survey: &Survey) -> serde_json::Value {
    json!({
        "motor": subject.name,
        "polarity_signature": name(survey.signature),
        "reciprocity_error_rel": survey.reciprocity_error,
        "convex": survey.convex,
        "open_circuit_flux_Wb": survey.open_circuit_flux,
        "l_d_mH": survey.l_dd * 1e3,
        "l_q_mH": survey.l_qq * 1e3,
        "l_dq_mH": survey.l_dq * 1e3 + 0.0,
        "l_d_error_mH": standard_errors(subject, [0.0; 2]).map(|e| e[0] * 1e3),
        "l_q_error_mH": standard_errors(subject, [0.0; 2]).map(|e| e[2] * 1e3),
        "pole_pairs": subject.pole_pairs,
        "resistance_ohm": subject.resistance,
        "time_constant_d_ms": subject.resistance.map(|r| survey.l_dd / r * 1e3),
        "time_constant_q_ms": subject.resistance.map(|r| survey.l_qq / r * 1e3),
        "inductance_4_mH": subject.magnetics.harmonics().inductance_4 * 1e3,
        "short_pulse_l_d_mH": short_pulse(subject, survey).map(|l| l[0] * 1e3),
        "short_pulse_l_q_mH": short_pulse(subject, survey).map(|l| l[1] * 1e3),
        "map": subject.map.as_ref().map(|(surface, map)| map_json(surface, map, survey)),
        "polarity": survey.polarity.iter().map(|p| json!({
            "current_A": p.current,
            "l_north_mH": p.north * 1e3,
            "l_south_mH": p.south * 1e3,
            "difference_rel": p.difference(),
        })).collect::<Vec<_>>(),
        "points": survey.along_d.iter().chain(&survey.along_q).map(|p| json!({
            "i_d_A": p.i_d,
            "i_q_A": p.i_q,
            "psi_d_Wb": p.psi_d,
            "psi_q_Wb": p.psi_q,
            "l_dd_mH": p.l_dd * 1e3,
            "l_dq_mH": p.l_dq * 1e3,
            "l_qq_mH": p.l_qq * 1e3,
            "errors_mH": standard_errors(subject, [p.i_d, p.i_q]).map(|errors| errors.map(|e| e * 1e3)),
        })).collect::<Vec<_>>(),
    })
}

fn map_json(surface: &FluxMap, map: &MapReport, survey: &Survey) -> serde_json::Value {
    let continued = map.continued.as_ref().map(|continued| {
        json!({
            "measured_i_d_A": continued.measured,
            "pole": surface.pole(reach(survey)),
            "cores": continued.spread(surface, reach(survey)),
        })
    });
    json!({
            "file": map.file,
            "points": map.points,
            "grid": map.size,
            "i_d_A": map.range[0],
            "i_q_A": map.range[1],
            "axes": map.axes.to_string(),
            "off_axis_deg": map.off_axis,
            "mirrored_d": map.mirrored[0],
            "mirrored_q": map.mirrored[1],
            "cross_inductance_rms_mH": map.cross_inductance * 1e3,
            "projection_rms_Wb": map.distance[0],
            "projection_max_Wb": map.distance[1],
            "projection_rel": map.distance[0] / map.largest_flux,
            "projection_max_at_A": map.furthest,
            "evaluation_error_A": map.evaluation_error,
            "convex_distance_rms_Wb": map.convexity,
            "noise_rms_Wb": map.noise,
            "free_parameters": map.free,
            "coarseness_rel": map.errors.coarseness(),
            "too_coarse": map.errors.too_coarse(),
            "continued": continued,
    })
}

/// Time constants and torque, where resistance and pole pairs are known.
fn motor_text(subject: &Subject, survey: &Survey) -> String {
    let mut text = String::new();
    if let Some(r) = subject.resistance {
        let [d, q] = [survey.l_dd, survey.l_qq].map(|l| number(3, l / r * 1e3));
        let _ = writeln!(text, "time constants with {r} Ω: L_d/R {d} ms, L_q/R {q} ms");
    }
    if let (Some(p), Some(point)) = (subject.pole_pairs, survey.along_q.last()) {
        let torque = 1.5 * f64::from(p) * (point.psi_d * point.i_q - point.psi_q * point.i_d);
        let (i_q, torque) = (number(2, point.i_q), number(2, torque));
        let _ = writeln!(text, "torque with {p} pole pairs at i_q = {i_q} A: {torque} N m");
    }
    text
}

fn text_of(subject: &Subject, survey: &Survey) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: open-circuit flux {} Wb, L_d {} mH, L_q {} mH without current{}\n\
         polarity signature up to {} A{}: {}: {}\nreciprocity error {:.1e}, {}\n",
        subject.name,
        number(6, survey.open_circuit_flux),
        number(3, survey.l_dd * 1e3),
        number(3, survey.l_qq * 1e3),
        standard_errors(subject, [0.0; 2]).map_or_else(String::new, |[d, _, q]| {
            format!(" (standard errors {} and {} mH)", number(2, d * 1e3), number(2, q * 1e3))
        }),
        reach(survey),
        if subject.map.as_ref().is_some_and(|(map, _)| map.pole(reach(survey)) != PoleKnowledge::Known) {
            " of what is simulated, which the file does not tell"
        } else {
            ""
        },
        name(survey.signature),
        meaning(survey.signature),
        survey.reciprocity_error,
        if survey.convex { "inductances positive definite" } else { "inductances NOT positive definite" }
    );
    if let Some((surface, map)) = &subject.map {
        text += &map_text(map);
        if let Some(continued) = &map.continued {
            text += &continued_text(surface, continued, reach(survey));
        }
    }
    text += &motor_text(subject, survey);
    let harmonics = subject.magnetics.harmonics();
    if harmonics.any() {
        let _ = writeln!(
            text,
            "harmonics, not in the table: L_4 {:.3} mH, asymmetry of phase a {:.3} mH, ψ_5 {:.2} mWb, ψ_7 {:.2} mWb",
            harmonics.inductance_4 * 1e3,
            harmonics.asymmetry * 1e3,
            harmonics.flux_5 * 1e3,
            harmonics.flux_7 * 1e3,
        );
    }
    if let (Some([d, q]), Some(branch)) = (short_pulse(subject, survey), subject.magnetics.eddy_currents()) {
        let _ = writeln!(
            text,
            "eddy currents: pulses much shorter than {:.0} µs see L_d {:.3} mH, L_q {:.3} mH",
            branch.time_constant * 1e6,
            d * 1e3,
            q * 1e3
        );
    }
    text.push('\n');
    let points = || survey.along_d.iter().chain(&survey.along_q);
    let largest = |of: fn(&OperatingPoint) -> f64| points().map(of).map(f64::abs).fold(0.0, f64::max);
    let current = decimals(2, largest(|p| p.i_d).max(largest(|p| p.i_q)));
    let flux = decimals(4, largest(|p| p.psi_d).max(largest(|p| p.psi_q)));
    let inductance = decimals(3, 1e3 * largest(|p| p.l_dd).max(largest(|p| p.l_qq)));
    let rows = points().map(|p| {
        let saliency = p.l_qq / p.l_dd;
        let mut row: Vec<String> =
            [p.i_d, p.i_q, p.psi_d, p.psi_q, p.l_dd * 1e3, p.l_dq * 1e3, p.l_qq * 1e3, saliency]
                .iter()
                .zip([current, current, flux, flux, inductance, inductance, inductance, 3])
                .map(|(value, digits)| format!("{:.digits$}", value + 0.0))
                .collect();
        let errors = standard_errors(subject, [p.i_d, p.i_q]).into_iter().flatten();
        row.extend(errors.map(|error| {
            if error.is_nan() { "–".to_owned() } else { format!("{:.inductance$}", error * 1e3) }
        }));
        row
    });
    let mut header = vec![
        "i_d (A)",
        "i_q (A)",
        "ψ_d (Wb)",
        "ψ_q (Wb)",
        "L_dd (mH)",
        "L_dq (mH)",
        "L_qq (mH)",
        "L_qq/L_dd",
    ];
    if subject.map.is_some() {
        header.extend(["± L_dd", "± L_dq", "± L_qq"]);
    }
    text += &table(&header, rows, true);
    text.push('\n');
    let rows = survey.polarity.iter().map(|p| {
        vec![
            format!("{:.current$}", p.current),
            format!("{:.inductance$}", p.north * 1e3),
            format!("{:.inductance$}", p.south * 1e3),
            format!("{:+.2}", 100.0 * p.difference()),
        ]
    });
    text += &table(
        &["current along d (A)", "L to north (mH)", "L to south (mH)", "north draws more by (%)"],
        rows,
        true,
    );
    text.push('\n');
    text
}

/// Of L_dd, L_dq and L_qq in H, if they come from a map; `current` is i_d and i_q in A on one of the axes. A magnet's
/// temperature changes where on the map a motor is, not how well the map is known.
fn standard_errors(subject: &Subject, current: [f64; 2]) -> Option<[f64; 3]> {
    let (_, map) = subject.map.as_ref()?;
    // Of what was continued nobody knows.
    let beyond =
        |continued: &Continuation| current[0] < continued.measured[0] || current[0] > continued.measured[1];
    if map.continued.as_deref().is_some_and(beyond) {
        return Some([f64::NAN; 3]);
    }
    Some(map.errors.at(current))
}

/// The largest current in A that was surveyed.
fn reach(survey: &Survey) -> f64 {
    survey.polarity.last().map_or(0.0, |point| point.current)
}

/// What each kind of core says of the side that the file does not have.
fn continued_text(map: &FluxMap, continued: &Continuation, reach: f64) -> String {
    let [low, high] = continued.measured;
    let mut text =
        format!("beyond i_d from {low} to {high} A, which the file has, continued by cores that fit it:\n");
    for spread in continued.spread(map, reach) {
        let kind = if spread.bridged { "with iron bridges" } else { "without iron bridges" };
        let [least, most] = spread.difference.map(|difference| 100.0 * difference);
        let _ = writeln!(
            text,
            "  {} {kind}, the best within {} % of the largest current: north draws more by {least:+.2} to {most:+.2} %",
            spread.cores,
            number(2, 100.0 * spread.distance)
        );
    }
    let _ = writeln!(
        text,
        "  {}",
        map.pole(reach).note().unwrap_or("the pole is known: the file has both sides up to this current")
    );
    text
}

/// L_d and L_q in H that an infinitely short pulse meets, where eddy currents make a difference.
fn short_pulse(subject: &Subject, survey: &Survey) -> Option<[f64; 2]> {
    let branch = subject.magnetics.eddy_currents()?;
    Some([survey.l_dd * (1.0 - branch.d_depth), survey.l_qq * (1.0 - branch.q_depth)])
}

fn map_text(map: &MapReport) -> String {
    let [[d_low, d_high], [q_low, q_high]] = map.range;
    let mirrored = match map.mirrored {
        [false, false] => "",
        [true, false] => ", continued to the other i_d by symmetry",
        [false, true] => ", continued to the other i_q by symmetry",
        [true, true] => ", continued to all quadrants by symmetry",
    };
    let off_axis = if map.off_axis.abs() < 5e-3 {
        String::new()
    } else {
        format!(" (flux without current {:+.2}° from it: as much is the rotor's angle off)", map.off_axis)
    };
    let [rms, largest] = map.distance;
    format!(
        "map: {} points, {} × {} grid, i_d {d_low} to {d_high} A, i_q {q_low} to {q_high} A{mirrored}; {}{off_axis}\n\
         nearest map with an energy: {rms:.2e} Wb rms away ({:.3} % of the largest flux), at most {largest:.2e} Wb, at \
         i_d = {} A, i_q = {} A\n\
         evaluation within {:.1e} A of it; cross inductance {} mH rms\n\
         noise {:.2e} Wb rms: {:.0} of {} numbers are free, the rest is smoothed{}{}\n",
        map.points,
        map.size[0],
        map.size[1],
        map.axes,
        100.0 * rms / map.largest_flux,
        number(3, map.furthest[0]),
        number(3, map.furthest[1]),
        map.evaluation_error,
        number(3, map.cross_inductance * 1e3),
        map.noise,
        map.free,
        2 * map.size[0] * map.size[1],
        map.convexity.map_or_else(String::new, |away| {
            format!("\nthat energy was not convex: the nearest convex one, {away:.2e} Wb rms from it, is what is simulated")
        }),
        if map.errors.too_coarse() {
            format!(
                "\nTOO COARSE for its saturation: with every second point, an inductance differs by {:.0} %, 5 % are allowed; more points where it bends",
                100.0 * map.errors.coarseness().unwrap_or_default()
            )
        } else {
            String::new()
        }
    )
}
