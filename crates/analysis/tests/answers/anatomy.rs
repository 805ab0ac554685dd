//! What failing starts have in common, counted over again one by one.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_analysis::{Anatomy, Event, Trials};
use standstill_scenario::{Document, Plan, Record};
use standstill_sim::{Purpose, Tape};

static NEVER: AtomicBool = AtomicBool::new(false);

/// The gains that a trial drew.
fn gains(tape: &Tape) -> [f64; 3] {
    let mut tape = tape.clone();
    let strip =
        tape.strips().iter().find(|strip| strip.purpose == Purpose::CurrentGain).expect("gains").clone();
    [strip.normals[0], strip.normals[1], strip.normals[2]]
}

/// Weighted mean and standard deviation.
fn moments(all: &[(f64, f64)]) -> (f64, f64) {
    let weight: f64 = all.iter().map(|(w, _)| w).sum();
    let mean = all.iter().map(|(w, x)| w * x).sum::<f64>() / weight;
    (mean, (all.iter().map(|(w, x)| w * (x - mean) * (x - mean)).sum::<f64>() / weight).sqrt())
}

#[test]
fn law_sectors_have_the_shares_and_the_means_of_their_starts() {
    let text = "motor = \"paper-5k5\"\nerrors = \"none\"\ndetector.method = \"line-inductance-fast\"\n\
                sensors.gain_error = \"0.5 %\"\n";
    let plan = Plan::new(Document::parse(Path::new("test.toml"), text).expect("TOML")).expect("a plan");
    let trials = Trials::new(&plan).expect("a scenario");
    let event: Event = "|e| > 0.9 deg".parse().expect("an event");
    let tapes = (0..4000).map(|trial| Tape::new(1, trial)).collect();
    let (records, tapes) = trials.all_with_tapes(tapes, &NEVER).expect("runs");
    let hit: Vec<(Record, Tape)> =
        records.into_iter().zip(tapes).filter(|(record, _)| event.value(record) > 0.0).collect();
    assert!(hit.len() > 300, "{}", hit.len());
    // Of unequal weights, which sum to one.
    let whole: f64 = (0..hit.len()).map(|k| 1.0 + (k % 3) as f64).sum();
    let failures: Vec<(f64, Tape)> =
        hit.iter().enumerate().map(|(k, (_, tape))| ((1.0 + (k % 3) as f64) / whole, tape.clone())).collect();
    let anatomy = Anatomy::of(&trials, event, &failures, &NEVER).expect("runs");
    assert!(anatomy.sectors.len() > 6, "{}", anatomy.sectors.len());
    assert!(anatomy.sectors.windows(2).all(|pair| pair[0].share >= pair[1].share));
    let mut told = 0;
    for (number, sector) in anatomy.sectors.iter().enumerate() {
        let (from, to) = sector.angles_deg;
        assert!((to - from - 15.0).abs() < 1e-9 && (0.0..180.0).contains(&from), "{sector:?}");
        let members: Vec<(f64, [f64; 3], &Tape)> = hit
            .iter()
            .zip(&failures)
            .filter(|((record, _), _)| {
                let error = record.axis_error_deg().expect("an axis");
                let angle = record.start_angle_deg().rem_euclid(180.0);
                (from..to).contains(&angle) && Some(error > 0.0) == sector.positive
            })
            .map(|(_, (weight, tape))| (*weight, gains(tape), tape))
            .collect();
        let share: f64 = members.iter().map(|(weight, ..)| weight).sum();
        assert!(members.len() >= 20 && (share - sector.share).abs() < 1e-12, "{share} and {sector:?}");
        let of = |phase: usize| {
            let all: Vec<(f64, f64)> = members.iter().map(|(w, gains, _)| (*w, gains[phase])).collect();
            moments(&all)
        };
        assert!(sector.draws.windows(2).all(|pair| pair[0].mean.abs() >= pair[1].mean.abs()));
        for (phase, name) in ["gain of a", "gain of b", "gain of c"].into_iter().enumerate() {
            let (mean, deviation) = of(phase);
            match sector.draws.iter().find(|draw| draw.name == name) {
                Some(draw) => {
                    told += 1;
                    assert!((draw.mean - mean).abs() < 1e-9 && (draw.deviation - deviation).abs() < 1e-9);
                }
                None => assert!(mean.abs() < 0.5, "{name} {mean} is not told"),
            }
        }
        if number == 0 {
            // The typical one is nearer to the means than any other member.
            let away = |gains: &[f64; 3]| -> f64 {
                (0..3)
                    .map(|k| (of(k).0, gains[k]))
                    .filter(|(m, _)| m.abs() >= 0.5)
                    .map(|(m, x)| (x - m) * (x - m))
                    .sum()
            };
            let typical = gains(anatomy.typical.as_ref().expect("a typical one"));
            assert!(members.iter().all(|(_, gains, _)| away(gains) >= away(&typical)));
        }
    }
    assert!(told > 10, "{told}");
    // The other sign of the error at the same angles has the other signs of the gains.
    let first = &anatomy.sectors[0];
    let opposite = anatomy
        .sectors
        .iter()
        .find(|other| other.angles_deg == first.angles_deg && other.positive != first.positive);
    let mirrored = opposite.map(|other| {
        let shared = first.draws.iter().filter_map(|draw| {
            Some((draw.mean, other.draws.iter().find(|second| second.name == draw.name)?.mean))
        });
        shared.filter(|(one, other)| one * other < 0.0).count()
    });
    assert!(mirrored.is_none_or(|count| count > 0), "{mirrored:?}");
}
