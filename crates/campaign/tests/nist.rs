//! Mean and standard deviation of NIST's Statistical Reference Datasets, as the statistics of a run give them.

use standstill_campaign::{Statistics, student};
use standstill_scenario::Verdict;

/// A data set with its certified values.
struct Certified {
    name: String,
    mean: f64,
    deviation: f64,
    observations: Vec<f64>,
}

fn certified() -> Vec<Certified> {
    let mut all: Vec<Certified> = Vec::new();
    for line in include_str!("nist/univariate.txt").lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split(' ');
        let number = |word: &str| word.parse::<f64>().expect("a number");
        if let Some(head) = line.strip_prefix("> ") {
            let mut words = head.split(' ');
            let name = words.next().expect("a name").to_owned();
            let [mean, deviation] = [words.next(), words.next()].map(|word| number(word.expect("certified")));
            all.push(Certified { name, mean, deviation, observations: Vec::new() });
        } else {
            let observations = &mut all.last_mut().expect("a head first").observations;
            observations.extend(words.by_ref().map(number));
        }
    }
    // 1,001 observations that differ by ±0.1 from the first.
    for (name, whole) in [("NumAcc2", "1"), ("NumAcc3", "1000000"), ("NumAcc4", "10000000")] {
        let text = |tenths: u32| format!("{whole}.{tenths}").parse::<f64>().expect("a number");
        let mean = text(2);
        let pairs = (0..500).flat_map(|_| [text(1), text(3)]);
        let observations = std::iter::once(mean).chain(pairs).collect();
        all.push(Certified { name: name.to_owned(), mean, deviation: 0.1, observations });
    }
    all
}

#[test]
fn cross_means_and_deviations_are_the_certified_ones() {
    let all = certified();
    assert_eq!(
        all.iter().map(|set| set.observations.len()).collect::<Vec<_>>(),
        [200, 218, 50, 100, 3, 1001, 1001, 1001]
    );
    for set in all {
        let mut statistics = Statistics::default();
        for x in &set.observations {
            statistics.add_outcome(Verdict::Found, Some(true), Some(*x));
        }
        let summary = statistics.summary();
        let n = set.observations.len() as f64;
        // The interval of the mean is ± t s/√n.
        let bias = summary.bias_deg;
        let half = (bias.high - bias.low) / 2.0;
        let deviation = half * n.sqrt() / student(n - 1.0);
        let rms = (set.mean * set.mean + (n - 1.0) / n * set.deviation * set.deviation).sqrt();
        // Certified values have 15 digits. In doubles the observations of NumAcc3 and NumAcc4 are decimals to 1e-10 and 1e-9, which the
        // ends of the interval are again.
        let close = match set.name.as_str() {
            "NumAcc4" => 3e-7,
            "NumAcc3" => 3e-8,
            "NumAcc1" => 1e-8,
            "Mavro" | "Michelso" => 1e-10,
            _ => 1e-13,
        };
        assert!((bias.value / set.mean - 1.0).abs() < 1e-14, "{}: {}", set.name, bias.value);
        assert!((deviation / set.deviation - 1.0).abs() < close, "{}: {deviation}", set.name);
        assert!((summary.rms_deg.value / rms - 1.0).abs() < 1e-14, "{}: {}", set.name, summary.rms_deg.value);
    }
}
