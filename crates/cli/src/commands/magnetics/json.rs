//! The survey of a magnetic core's inductances as JSON.

use serde_json::json;
use standstill_plant::{FluxMap, MapReport, Survey};

use super::{Subject, reach, short_pulse, standard_errors};

pub fn of(subject: &Subject, survey: &Survey) -> serde_json::Value {
    json!({
        "motor": subject.name,
        "polarity_signature": survey.signature.name(),
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
