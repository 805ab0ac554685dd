//! Budgets of simulated starts against closed forms.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_analysis::{Budget, Item, Source, Trials};
use standstill_campaign::Estimate;
use standstill_detect::Method;
use standstill_interface::Nanos;
use standstill_plant::DataSheet;
use standstill_scenario::{Document, Plan};
use standstill_sim::{Purpose, Tape};

static NEVER: AtomicBool = AtomicBool::new(false);

/// The paper's motor without saturation, with these lines of `[sensors]` and what follows them; the drive is ideal.
fn linear(sensors: &str) -> Plan {
    resistive("1.2 Ω", sensors)
}

/// The same with this resistance.
fn resistive(resistance: &str, sensors: &str) -> Plan {
    let sheet = DataSheet::built_in_text("paper-5k5").expect("built in");
    let mut skipped = false;
    let core = sheet.lines().filter(|line| {
        if line.starts_with('[') {
            skipped = line.starts_with("[saturation]");
        }
        !skipped
    });
    let core: Vec<&str> = core.collect();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let core = core.join("\n").replace("\"1.2 Ω\"", &format!("\"{resistance}\""));
    let name = format!("linear_{}.toml", resistance.trim_end_matches(" Ω"));
    std::fs::write(folder.join(&name), core).expect("written");
    // A saliency may scatter beyond the range of the data sheet's.
    let method = "detector = { method = \"line-inductance-fast\", checks = [\"inductance\", \"both-ways\"] }";
    let text = format!("motor = \"{name}\"\nerrors = \"none\"\n{method}\n[sensors]\n{sensors}");
    let document = Document::parse(&folder.join("scenario.toml"), &text).expect("TOML");
    Plan::new(document).expect("a plan")
}

fn budget(plan: &Plan, pairs: u64) -> Budget {
    let trials = Trials::new(plan).expect("a scenario");
    Budget::of(&trials, &Source::all(&trials), pairs, &NEVER).expect("runs").expect("axes")
}

fn item<'a>(budget: &'a Budget, key: &str) -> &'a Item {
    budget.items.iter().find(|item| item.source.key == key).expect("a source")
}

/// The error of the axis that small sensor errors cause on a linear core, by equations (4), (7) and (10). One sensor reads each line k,
/// whose inductance is L_k = 3 L_A − 3 L_B cos(2θ + φ_k). Relative errors ε_k turn the axis by Σ ε_k L_k sin(2θ + φ_k)/(9 L_B).
struct Linear {
    l_a: f64,
    l_b: f64,
    resistance: f64,
    link: f64,
    /// Length of a pulse in s.
    pulse: f64,
    pulses: f64,
}

/// From the end of a pulse to its third sample, in lengths of the pulse.
const AFTER: f64 = 0.8;

impl Linear {
    fn of(plan: &Plan) -> Self {
        let trials = Trials::new(plan).expect("a scenario");
        let scenario = trials.scenario();
        let winding = scenario.motor.winding;
        let Method::LineInductance(settings) = scenario.detector else { panic!("the paper's method") };
        assert_eq!((settings.sample_lead, settings.dead_time), (Nanos::ZERO, Nanos::ZERO), "an ideal drive");
        Self {
            l_a: winding.mean_inductance,
            l_b: winding.saliency,
            resistance: scenario.motor.resistance,
            link: scenario.drive.link.voltage,
            pulse: settings.pulse.seconds(),
            pulses: f64::from(settings.pulses),
        }
    }

    /// Rms in degrees of gains with this standard deviation: a gain 1 + δ makes L/(1 + δ) of L. The mean of Σ L_k² sin²(2θ + φ_k) over
    /// the angle is 27 (L_A²/2 + L_B²/8).
    fn gains(&self, deviation: f64) -> f64 {
        let ratio = self.l_a / self.l_b;
        (deviation * ((ratio * ratio + 0.25) / 6.0).sqrt()).to_degrees()
    }

    /// Rms in degrees of offsets with this standard deviation in A. An offset o adds o to all three samples, and so to the mean currents of
    /// both intervals of equation (10), not to their slopes. With R i ≪ V that makes −o (2R/V)(1 − r)/(3 − r) of L, relative, where r is
    /// from the pulse's end to the third sample, in pulses: with respect to the axis a gain.
    fn offsets(&self, deviation: f64) -> f64 {
        self.gains(deviation * 2.0 * self.resistance / self.link * (1.0 - AFTER) / (3.0 - AFTER))
    }

    /// Rms in degrees of noise with this standard deviation in A. With R i ≪ V the derivatives of equation (10) by the three samples
    /// are (2 − r)/2, −1 + r/2 − 1/(2r) and 1/(2r), over (3 − r)/2 of the peak current i = V t/L, relative. So L_k has the standard
    /// deviation c σ L_k²/(V t), and the mean of Σ L_k⁴ sin²(2θ + φ_k) over the angle is 243 (L_A⁴/2 + 3 L_A² L_B²/4 + L_B⁴/16).
    fn noise(&self, deviation: f64) -> f64 {
        let by = [(2.0 - AFTER) / 2.0, -1.0 + AFTER / 2.0 - 0.5 / AFTER, 0.5 / AFTER];
        let c = by.map(|x| x * x).iter().sum::<f64>().sqrt() * 2.0 / (3.0 - AFTER);
        let [a, b] = [self.l_a * self.l_a, self.l_b * self.l_b];
        let square = 243.0 * (a * a / 2.0 + 0.75 * a * b + b * b / 16.0) / (81.0 * b) / self.pulses;
        (c * deviation / (self.link * self.pulse) * square.sqrt()).to_degrees()
    }
}

/// Whether an estimate holds the truth, its interval being half as wide again: of ten such intervals all do in 97 of 100 cases.
fn holds(estimate: &Estimate, truth: f64) -> bool {
    let Estimate { value, low, high } = *estimate;
    value - 1.5 * (value - low) <= truth && truth <= value + 1.5 * (high - value)
}

/// That sources which add by their squares, and nothing else, are found: by the rms of each alone, in degrees.
fn added_by_squares(budget: &Budget, truth: &[(&str, f64)]) {
    let square: f64 = truth.iter().map(|(_, alone)| alone * alone).sum();
    assert!(holds(&budget.rms_deg, square.sqrt()), "{:?} where {} is right", budget.rms_deg, square.sqrt());
    assert_eq!(budget.items.len(), truth.len());
    for (key, alone) in truth {
        let item = item(budget, key);
        let (share, rest) = (alone * alone / square, (square - alone * alone).sqrt());
        for (found, truth) in
            [(&item.alone_deg, *alone), (&item.without_deg, rest), (&item.share, share), (&item.total, share)]
        {
            assert!(holds(found, truth), "{key}: {found:?} where {truth} is right");
        }
        // Intervals that hold anything would tell nothing.
        assert!(item.alone_deg.high - item.alone_deg.low < 0.08 * alone, "{key}: {:?}", item.alone_deg);
        assert!(item.share.high - item.share.low < 0.25, "{key}: {:?}", item.share);
    }
    assert!(holds(&budget.method.share, 0.0), "{:?}", budget.method);
    assert!(holds(&budget.interaction, 0.0), "{:?}", budget.interaction);
    assert_eq!(budget.dropped, 0);
}

#[test]
fn analytic_gains_and_noise_on_a_linear_core_have_their_closed_form() {
    let plan = linear("gain_error = \"0.5 %\"\nnoise = \"10 mA\"");
    let linear = Linear::of(&plan);
    let truth = [("sensors.noise", linear.noise(0.01)), ("sensors.gain_error", linear.gains(0.005))];
    added_by_squares(&budget(&plan, 1500), &truth);
}

#[test]
fn analytic_what_is_left_of_offsets_on_a_linear_core_has_its_closed_form() {
    // The method takes offsets away but for the drop of the resistance that they feign. Gains of two in a million make as much.
    let plan = resistive("0.12 Ω", "gain_error = \"0.0002 %\"\noffset = \"40 mA\"");
    let linear = Linear::of(&plan);
    assert_eq!(linear.resistance, 0.12);
    let truth = [("sensors.gain_error", linear.gains(2e-6)), ("sensors.offset", linear.offsets(0.04))];
    added_by_squares(&budget(&plan, 1500), &truth);
}

/// Gains, and a saliency b L_B with b uniform from 1 − `SPREAD` to 1 + `SPREAD`: together they make more than each alone.
const SPREAD: f64 = 0.6;

fn products() -> Plan {
    linear(&format!(
        "gain_error = \"0.5 %\"\n[tolerances]\n\"motor.winding.saliency\" = {{ uniform = \"{} %\" }}\n",
        100.0 * SPREAD
    ))
}

#[test]
fn analytic_gains_and_a_saliency_that_scatters_have_the_interaction_of_a_product() {
    // The axis turns by Σ δ_k (L_A/(3 b L_B) − cos(2θ + φ_k)/3) sin(2θ + φ_k). By itself the saliency turns nothing. At a given gain the
    // mean over b has E[1/b] in place of 1/b, the mean square E[1/b²].
    let plan = products();
    let Linear { l_a, l_b, .. } = Linear::of(&plan);
    let inverse = ((1.0 + SPREAD) / (1.0 - SPREAD)).ln() / (2.0 * SPREAD);
    let inverse_square = 1.0 / (1.0 - SPREAD * SPREAD);
    let ratio = l_a / l_b;
    let square = ratio * ratio * inverse_square + 0.25;
    let first = (ratio * ratio * inverse * inverse + 0.25) / square;
    assert!((0.7..0.95).contains(&first), "{first}");
    let budget = budget(&plan, 3000);
    assert!(holds(&budget.rms_deg, (0.005 * (square / 6.0).sqrt()).to_degrees()), "{:?}", budget.rms_deg);
    let [gains, saliency] = ["sensors.gain_error", "motor.winding.saliency"].map(|key| item(&budget, key));
    for (what, found, truth) in [
        ("gains", &gains.share, first),
        ("gains in all", &gains.total, 1.0),
        ("saliency", &saliency.share, 0.0),
        ("saliency in all", &saliency.total, 1.0 - first),
        ("method", &budget.method.share, 0.0),
        ("interaction", &budget.interaction, 1.0 - first),
    ] {
        assert!(holds(found, truth), "{what}: {found:?} where {truth} is right");
    }
    assert!(budget.interaction.low > 0.0 && saliency.total.low > 0.0, "the interaction is seen");
}

#[test]
fn law_shares_and_an_interaction_that_is_estimated_by_itself_sum_to_one() {
    // The second difference of two sources, e(u,v) − e(u',v) − e(u,v') + e(u',v'), has four times the variance of their interaction and
    // contains nothing else. So it estimates the interaction by itself, from trials that the budget does not use; the budget takes
    // for it what the other shares leave.
    let plan = products();
    let trials = Trials::new(&plan).expect("a scenario");
    let name = "motor.winding.saliency";
    let errors = |tapes: &[Tape]| -> Vec<f64> {
        let records = trials.records(tapes).expect("trials");
        records.iter().map(|record| record.axis_error_deg().expect("an axis")).collect()
    };
    let pairs = 1500;
    let [mut a, mut b] =
        [0, pairs].map(|from| (from..from + pairs).map(|k| Tape::new(9, k)).collect::<Vec<_>>());
    let (both_a, _) = (errors(&a), errors(&b));
    let (mut gains_of_b, mut saliency_of_b, mut both_b) = (a.clone(), a.clone(), a.clone());
    for k in 0..a.len() {
        let gains = b[k].normals(Purpose::CurrentGain).clone();
        let saliency = b[k].normals_named(Purpose::Tolerance, name).clone();
        assert_eq!((gains.len(), saliency.len()), (a[k].normals(Purpose::CurrentGain).len(), 1));
        for tape in [&mut gains_of_b[k], &mut both_b[k]] {
            tape.normals(Purpose::CurrentGain).clone_from(&gains);
        }
        for tape in [&mut saliency_of_b[k], &mut both_b[k]] {
            tape.normals_named(Purpose::Tolerance, name).clone_from(&saliency);
        }
    }
    let [gains_of_b, saliency_of_b, both_b] = [gains_of_b, saliency_of_b, both_b].map(|tapes| errors(&tapes));
    let second = |k: usize| (both_a[k] - gains_of_b[k] - saliency_of_b[k] + both_b[k]).powi(2) / 4.0;
    let count = both_a.len() as f64;
    let mean = (0..both_a.len()).map(second).sum::<f64>() / count;
    let scatter = (0..both_a.len()).map(|k| (second(k) - mean).powi(2)).sum::<f64>();
    let budget = budget(&plan, 4000);
    let square = budget.rms_deg.value.powi(2);
    let interaction = (mean / square, 1.96 * scatter.sqrt() / count / square);
    let shares = budget.items.iter().map(|item| &item.share).chain([&budget.method.share]);
    let (mut sum, mut squares) = (interaction.0, interaction.1.powi(2));
    for share in shares {
        sum += share.value;
        squares += ((share.high - share.low) / 2.0).powi(2);
    }
    let half = squares.sqrt();
    assert!((sum - 1.0).abs() < 1.5 * half, "{sum} ± {half}");
    // Without the interaction it would not hold.
    assert!(1.5 * half < interaction.0, "{interaction:?} of {sum} ± {half}");
}

#[test]
fn law_totals_and_first_orders_enclose_what_sources_make_together() {
    let document = Document::parse(
        Path::new("test.toml"),
        "errors = \"default\"\ndetector.method = \"line-inductance-fast\"\n\
         [tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }\n",
    );
    let plan = Plan::new(document.expect("TOML")).expect("a plan");
    let budget = budget(&plan, 600);
    let half = |e: &Estimate| (e.high - e.low) / 2.0;
    // An interaction belongs to two sources or more, and counts in the total of each. So a source's total (Jansen) exceeds its
    // first order (Saltelli) by at most the interaction, and the excesses of all sources add up to at least twice the interaction.
    let (mut apart, mut square) = (0.0, half(&budget.interaction).powi(2));
    for item in &budget.items {
        let both = half(&item.total).hypot(half(&item.share));
        let slack = 1.5 * both.hypot(half(&budget.interaction));
        let together = item.total.value - item.share.value;
        assert!(together > -1.5 * both, "{item:?}");
        assert!(together < budget.interaction.value + slack, "{item:?}, {:?}", budget.interaction);
        apart += together;
        square += both.powi(2);
    }
    assert!(
        apart > 2.0 * budget.interaction.value - 3.0 * square.sqrt(),
        "{apart}, {:?}",
        budget.interaction
    );
    let totals: f64 = budget.items.iter().map(|item| item.total.value).sum();
    let squares: f64 = budget.items.iter().map(|item| half(&item.total).powi(2)).sum();
    let slack = 1.5 * squares.sqrt().hypot(half(&budget.method.share));
    assert!(totals + budget.method.share.value > 1.0 - slack, "{totals} ± {slack}, {:?}", budget.method);
    let keys: Vec<&str> = budget.items.iter().map(|item| item.source.key.as_str()).collect();
    for key in ["sensors.noise", "sensors.gain_error", "inverter.ripple", "motor.winding.resistance"] {
        assert!(keys.contains(&key), "{keys:?}");
    }
    // A spread that changes nothing has no share: a link's gain scales all inductances alike.
    assert!(item(&budget, "sensors.dc_link_gain_error").total.value < 0.01);
}

#[test]
fn law_the_iron_s_memory_is_a_source_as_others_are() {
    let text = "errors = \"none\"\nmotor.base = \"paper-5k5\"\n\
                motor.hysteresis = { coercive_current = 0.08, depth = 0.05, cells = 3 }\n\
                rotor.memory = \"former\"\ndetector.method = \"bipolar\"\n";
    let plan = Plan::new(Document::parse(Path::new("test.toml"), text).expect("TOML")).expect("a plan");
    let budget = budget(&plan, 150);
    let keys: Vec<&str> = budget.items.iter().map(|item| item.source.key.as_str()).collect();
    assert_eq!(keys, ["rotor.memory"]);
    // Nothing else is drawn but the angle: what is not the method's own is the memory's, and nothing acts together.
    let memory = item(&budget, "rotor.memory");
    assert!(memory.total.value > 0.05, "{memory:?}");
    let rest = budget.interaction;
    assert!(rest.low <= 0.0 && 0.0 <= rest.high, "{rest:?}");
    assert!((memory.total.value + budget.method.share.value - 1.0).abs() < 0.1, "{memory:?}");
}

#[test]
fn law_what_converters_round_is_a_source_as_others_are() {
    // Nothing is drawn but the place of the codes: codes of 20 A/2^9.
    let coarse = linear("bits = 10\nrange = \"20 A\"");
    let budget = budget(&coarse, 600);
    let keys: Vec<&str> = budget.items.iter().map(|item| item.source.key.as_str()).collect();
    assert_eq!(keys, ["sensors.bits"]);
    let rounding = item(&budget, "sensors.bits");
    // Without it readings are exact, and on a linear core with an ideal drive nothing is left.
    assert!(rounding.without_deg.value < 1e-4, "{rounding:?}");
    assert!(rounding.alone_deg.value > 0.1, "{rounding:?}");
    // It is all there is: its own share and the method's, which is its mean over the places.
    let sum = rounding.total.value + budget.method.share.value;
    assert!((sum - 1.0).abs() < 0.15 && rounding.total.value > 0.5, "{rounding:?}, {:?}", budget.method);
    // Noise of a code makes of it a part that acts only together with the noise.
    let noisy = linear("bits = 10\nrange = \"20 A\"\nnoise = \"40 mA\"");
    let noisy = self::budget(&noisy, 1500);
    let rounding = item(&noisy, "sensors.bits");
    assert!(rounding.share.value.abs() < 0.05 && rounding.share.low < 0.0, "{rounding:?}");
    // A uniform error of one code q, 39 mA, has a variance of q²/12: with that of the noise, of both 7 %.
    assert!((0.045..0.11).contains(&rounding.total.value), "{rounding:?}");
}

#[test]
fn regress_where_too_few_starts_have_an_axis_it_ends_after_the_first_sample() {
    use std::sync::atomic::{AtomicU64, Ordering};

    struct Count(AtomicU64);
    impl standstill_analysis::Watch for Count {
        fn stopped(&self) -> bool {
            false
        }

        fn did(&self, trials: u64) {
            self.0.fetch_add(trials, Ordering::Relaxed);
        }
    }
    let text =
        "errors = \"default\"\ndetector.method = \"line-inductance-fast\"\ndetector.least_saliency = 0.9\n";
    let plan = Plan::new(Document::parse(Path::new("test.toml"), text).expect("TOML")).expect("a plan");
    let trials = Trials::new(&plan).expect("a scenario");
    let count = Count(AtomicU64::new(0));
    let few = Budget::of(&trials, &Source::all(&trials), 200, &count).expect("runs").expect_err("no axes");
    assert_eq!((few.pairs, few.whole), (200, 0));
    assert_eq!(count.0.into_inner(), 200);
}

/// Mean and variance of the axis error of plain starts in degrees.
fn plainly(plan: &Plan, count: u64) -> [f64; 2] {
    let trials = Trials::new(plan).expect("a scenario");
    let tapes: Vec<Tape> = (0..count).map(|k| Tape::new(5, k)).collect();
    let records = trials.all_records(tapes, &NEVER).expect("trials");
    let errors: Vec<f64> = records.iter().map(|record| record.axis_error_deg().expect("an axis")).collect();
    let mean = errors.iter().sum::<f64>() / count as f64;
    [mean, errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / count as f64]
}

/// An amplifier that slews and a capacitor that lags do the same in all starts: what they turn an axis by is the method's own error, and no
/// draw's. Where specimens differ in them they are sources, with the share that plain starts have.
#[test]
fn law_slew_and_acquisition_have_the_shares_of_plain_starts() {
    // The samples after an edge are spoilt by an amplifier that is not there yet; a capacitor moves those at a peak that saturates.
    for (method, key, value, percent) in [
        ("maximum-likelihood", "sensors.slew", "600 kA/s", "20 %"),
        ("bipolar", "sensors.acquisition", "5 us", "60 %"),
    ] {
        let plan = |value: &str, tolerance: &str| {
            let text = format!(
                "motor = \"paper-5k5\"\nerrors = \"none\"\ndetector.method = \"{method}\"\n{key} = \"{value}\"\n\
                 sensors.arrangement = \"dc-link-shunt\"\nrotor.angle = \"50 deg\"\nrotor.state = \"locked\"\n{tolerance}"
            );
            Plan::new(Document::parse(Path::new("s.toml"), &text).expect("TOML")).expect("a plan")
        };
        let [off, _] = plainly(&plan("0", ""), 1);
        let [alike, none] = plainly(&plan(value, ""), 4);
        assert!(none < 1e-20 && (alike - off).abs() > 1e-3, "{key}: {alike}° with it, {off}° without");
        let with = plan(value, &format!("tolerances.\"{key}\" = {{ uniform = \"{percent}\" }}\n"));
        let [mean, variance] = plainly(&with, 2000);
        let square = mean * mean + variance;
        println!("{key}: {off}° without, {alike}° with, mean {mean}°, share {}", variance / square);
        assert!(variance > 1e-4 * square, "{key}: {mean} {variance}");
        let budget = budget(&with, 400);
        assert_eq!(budget.items.len(), 1);
        let source = item(&budget, key);
        assert!((source.without_deg.value - alike.abs()).abs() < 1e-9, "{key}: {:?}", source.without_deg);
        for (what, found, truth) in [
            ("rms", &budget.rms_deg, square.sqrt()),
            ("share", &source.share, variance / square),
            ("total", &source.total, variance / square),
            ("method", &budget.method.share, mean * mean / square),
        ] {
            assert!(holds(found, truth), "{key}, {what}: {found:?} where {truth} is right");
        }
    }
}
