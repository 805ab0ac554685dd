//! Budgets of simulated starts against closed forms.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_analysis::{Budget, Item, Source, Trials};
use standstill_plant::DataSheet;
use standstill_scenario::{Document, Plan};

static NEVER: AtomicBool = AtomicBool::new(false);

/// The paper's motor without saturation, with these lines of `[sensors]`; the drive is ideal.
fn linear(sensors: &str) -> Plan {
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
    std::fs::write(folder.join("linear.toml"), core.join("\n")).expect("written");
    let text = format!(
        "motor = \"linear.toml\"\nerrors = \"none\"\ndetector.method = \"line-inductance-fast\"\n[sensors]\n{sensors}"
    );
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

#[test]
fn analytic_gains_on_a_linear_core_make_what_equation_7_makes_of_them() {
    // A gain g_k of line k's sensor makes L_k/g_k of equation (10). With L_k = 3 L_A − 3 L_B cos(2θ + φ_k) and equation (7)
    // the axis turns by Σ δ_k L_k sin(2θ + φ_k)/(9 L_B), whose mean square over θ and gains of deviation σ is
    // σ² (L_A²/L_B² + 1/4)/6.
    let plan = linear("gain_error = \"0.5 %\"\nnoise = \"10 mA\"\noffset = \"2 mA\"");
    let winding = Trials::new(&plan).expect("a scenario").scenario().motor.winding;
    let ratio = winding.mean_inductance / winding.saliency;
    let truth = (0.005 * ((ratio * ratio + 0.25) / 6.0).sqrt()).to_degrees();
    let budget = budget(&plan, 1500);
    let gains = item(&budget, "sensors.gain_error");
    let alone = gains.alone_deg;
    // Three of a hundred: the interval is a hundredth or two wide at each side, and at a hundredth of a radian 7 is bent.
    assert!((alone.value / truth - 1.0).abs() < 0.05, "{alone:?} where {truth} is right");
    assert!(alone.low < 1.01 * truth && 0.99 * truth < alone.high, "{alone:?} where {truth} is right");
    // Small errors add by their squares: shares by themselves are those of the rms alone.
    let square = budget.rms_deg.value.powi(2);
    for item in &budget.items {
        let share = item.alone_deg.value.powi(2) / square;
        let slack = 0.02;
        let held = item.share.low - slack <= share && share <= item.share.high + slack;
        assert!(held, "{}: {:?} where {share} is right", item.source.key, item.share);
        let rest = (square - item.alone_deg.value.powi(2)).sqrt();
        assert!((item.without_deg.value / rest - 1.0).abs() < 0.05, "{}", item.source.key);
        assert!(item.total.value > item.share.low, "{}", item.source.key);
    }
    // An ideal drive, a linear core: the method has no error of its own, and nothing acts together.
    assert!(budget.method.share.low < 0.01 && budget.method.share.value < 0.06, "{:?}", budget.method);
    assert!(budget.interaction.low < 0.02 && budget.interaction.high > -0.02, "{:?}", budget.interaction);
    // At each angle the gains have their part, though over all angles they average to nothing.
    assert!(gains.share.value > 0.1);
    assert_eq!(budget.dropped, 0);
}

#[test]
fn law_shares_sum_to_one_and_totals_to_no_less() {
    let document = Document::parse(
        Path::new("test.toml"),
        "errors = \"default\"\ndetector.method = \"line-inductance-fast\"\n\
         [tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }\n",
    );
    let plan = Plan::new(document.expect("TOML")).expect("a plan");
    let budget = budget(&plan, 300);
    let parts = budget.items.iter().map(|item| item.share.value).sum::<f64>();
    let sum = parts + budget.method.share.value + budget.interaction.value;
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    let totals = budget.items.iter().map(|item| item.total.value).sum::<f64>();
    assert!(totals + budget.method.share.value > 0.9, "{totals}");
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
