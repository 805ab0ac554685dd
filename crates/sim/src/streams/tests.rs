use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use super::normal::{
    lower_tail, normal_of_uniform, uniform_of_normal, uniform_of_word, value, value_of_draw,
};
use super::{Draws, Purpose, Streams, Tape};

const LAST_VALUE: u64 = (1 << 48) - 1;

fn uniform_of_value(value: u64) -> f64 {
    uniform_of_word(value << 16)
}

#[test]
fn golden_the_numbers_are_those_of_the_generator() {
    for (seed, index) in [(0, 0), (1, 7), (u64::MAX, u64::MAX)] {
        let mut expected = ChaCha8Rng::seed_from_u64(seed);
        expected.set_stream(index);
        // The block whose number is the purpose's, then the purpose's further blocks.
        expected.set_word_pos(16 * Purpose::Jitter as u128);
        let mut words: Vec<u64> = (0..8).map(|_| expected.next_u64()).collect();
        expected.set_word_pos(16 * ((Purpose::Jitter as u128 + 1) << 40));
        words.extend((0..192).map(|_| expected.next_u64()));
        let mut draws = Streams::new(seed, index).open(Purpose::Jitter);
        for word in words {
            let uniform = draws.uniform();
            assert_eq!([value(uniform), value_of_draw(uniform)], [word >> 16; 2]);
        }
    }
    // Published results depend on these numbers.
    let mut noise = Streams::new(1, 0).open(Purpose::CurrentNoise);
    let first = [(); 2].map(|()| noise.normal().to_bits());
    assert_eq!(first, [13_832_864_575_949_056_646, 13_827_892_754_717_580_348]);
    // A checksum over the bits of many normals, far tails included, of angles and of truncated normals.
    let normals = (0..100_000).map(|_| noise.normal());
    let others = (0..1_000).flat_map(|trial| {
        let mut draws = Streams::new(1, trial).open_named(Purpose::Angle, "a");
        [draws.angle(), draws.normal_within(2.0), draws.uniform()]
    });
    let sum = normals.chain(others).fold(0_u64, |sum, x| sum.rotate_left(5).wrapping_add(x.to_bits()));
    assert_eq!(sum, 10_174_073_817_789_567_616);
}

#[test]
// The digits as printed by mpmath.
#[allow(clippy::excessive_precision, clippy::unreadable_literal)]
fn cross_normals_against_forty_digits() {
    // From mpmath 1.3: √2 erfinv(2 u − 1) with 40 digits, u = (k + ½)/2^48.
    let reference = [
        (0, -7.869777910570139124019),
        (1, -7.731147539125660345581),
        (12_345, -6.486728756245378993511),
        (1 << 20, -5.780439244262237416194),
        ((1 << 30) + 7, -4.475328423161893772706),
        (4_000_000_000, -4.185757151655622309914),
        ((1 << 40) + 1, -2.660067468617000178849),
        (21_110_623_253_299, -1.439531470938448386036),
        (21_110_623_253_300, -1.439531470938423288349),
        (1 << 46, -0.6744897501960761532469),
        (123_456_789_012_345, -0.1545028729540382299603),
        ((1 << 47) - 1, -4.452666279474827075574e-15),
        (1 << 47, 4.452666279474827075574e-15),
        ((1 << 47) + 12_345, 1.099407831065129553232e-10),
        (3 << 46, 0.6744897501960873331575),
        ((1 << 48) - (1 << 30), 4.475328424753690660272),
        (LAST_VALUE, 7.869777910570139124019),
    ];
    for (k, expected) in reference {
        let found = normal_of_uniform(uniform_of_value(k));
        assert!((found / expected - 1.0).abs() < 1e-15, "{k}: {found:e} against {expected:e}");
    }
}

#[test]
fn law_a_normal_tells_its_value() {
    let check = |k: u64| {
        let uniform = uniform_of_value(k);
        let normal = normal_of_uniform(uniform);
        assert_eq!(uniform_of_normal(normal), uniform, "{k}: {normal}");
        // Both halves of the distribution are symmetric.
        assert_eq!(normal_of_uniform(uniform_of_value(LAST_VALUE - k)), -normal, "{k}");
    };
    // Ends, middle, and where the approximations meet: u = 0.075, √(−ln u) = 5.
    for middle in [0, 3_909, 21_110_623_253_299, 1 << 47, LAST_VALUE] {
        let first = u64::saturating_sub(middle, 20_000);
        (first..(first + 40_000).min(LAST_VALUE + 1)).for_each(check);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..300_000 {
        let word = rng.next_u64();
        check(word >> 16);
        // Values of all magnitudes, so that all parts of the tail are covered.
        check(word >> 16 >> (word % 48));
    }
    // Normals given from outside may be out of range or infinite.
    assert_eq!(uniform_of_normal(-40.0), uniform_of_value(0));
    assert_eq!(uniform_of_normal(f64::INFINITY), uniform_of_value(LAST_VALUE));
}

/// Returns draw `n` of a purpose after reading those before it as uniform numbers.
fn nth<'t, T>(streams: Streams<'t>, n: usize, read: impl Fn(&mut Draws<'t>) -> T) -> T {
    let mut draws = streams.open(Purpose::CurrentNoise);
    for _ in 0..n {
        draws.uniform();
    }
    read(&mut draws)
}

#[test]
fn law_a_draw_does_not_depend_on_those_before_it() {
    let tape = Tape::new(5, 9);
    for streams in [Streams::new(5, 9), Streams::taped(&tape)] {
        let normals: Vec<f64> = (0..150).map(|n| nth(streams, n, Draws::normal)).collect();
        let uniforms: Vec<f64> = (0..150).map(|n| nth(streams, n, Draws::uniform)).collect();
        let integers: Vec<u64> = (0..150).map(|n| nth(streams, n, |draws| draws.integer(200))).collect();
        let seeded = Streams::new(5, 9);
        let alone: Vec<f64> = uniforms.iter().map(|uniform| normal_of_uniform(*uniform)).collect();
        assert_eq!(normals, alone);
        // Kinds of numbers in random order, in between many at once.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..300 {
            let mut draws = streams.open(Purpose::CurrentNoise);
            let mut n = 0;
            while n < 100 {
                match rng.next_u32() % 4 {
                    0 => assert_eq!(draws.normal(), normals[n]),
                    1 => assert_eq!(draws.uniform(), uniforms[n]),
                    2 => assert_eq!(draws.integer(200), integers[n]),
                    _ => {
                        let mut many = [0.0; 50];
                        let many = &mut many[..rng.next_u32() as usize % 50];
                        draws.normals(many);
                        assert_eq!(many, &normals[n..n + many.len()]);
                        n += many.len();
                        continue;
                    }
                }
                n += 1;
            }
        }
        assert_eq!(normals[0], seeded.open(Purpose::CurrentNoise).normal());
    }
}

#[test]
fn law_trials_seeds_purposes_and_names_differ() {
    let draw = |seed, index, purpose, name| {
        let mut draws = Streams::new(seed, index).open_named(purpose, name);
        [(); 40].map(|()| draws.uniform())
    };
    let first = draw(1, 0, Purpose::Angle, "");
    assert_eq!(first, draw(1, 0, Purpose::Angle, ""));
    for other in [
        draw(2, 0, Purpose::Angle, ""),
        draw(1, 1, Purpose::Angle, ""),
        draw(1, 0, Purpose::Jitter, ""),
        draw(1, 0, Purpose::Angle, "motor.d"),
        draw(1, 0, Purpose::Angle, "motor.q"),
    ] {
        assert!(first.iter().all(|uniform| !other.contains(uniform)));
    }
}

/// Returns the means of the powers one to four, and the mean of the products of neighbours.
fn moments(normals: &[f64]) -> ([f64; 4], f64) {
    let n = normals.len() as f64;
    let power = |k: i32| normals.iter().map(|z| z.powi(k)).sum::<f64>() / n;
    let neighbours = normals.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / n;
    ([power(1), power(2), power(3), power(4)], neighbours)
}

/// Returns the largest distance between the distribution of these numbers and a stated one, times √n. It exceeds 1.95 with a
/// probability of 0.1 % (Kolmogorov).
fn distance(mut numbers: Vec<f64>, distribution: impl Fn(f64) -> f64) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    let n = numbers.len() as f64;
    let off = numbers.iter().enumerate().map(|(k, number)| {
        let expected = distribution(*number);
        (expected - k as f64 / n).abs().max(((k + 1) as f64 / n - expected).abs())
    });
    off.fold(0.0, f64::max) * n.sqrt()
}

/// Returns the largest distance between the distributions of two lists of numbers, scaled as in [`distance`] (Smirnov).
fn distance_between(mut a: Vec<f64>, mut b: Vec<f64>) -> f64 {
    a.sort_unstable_by(f64::total_cmp);
    b.sort_unstable_by(f64::total_cmp);
    let share = |all: &[f64], x: f64| all.partition_point(|y| *y <= x) as f64 / all.len() as f64;
    let most = a.iter().chain(&b).map(|x| (share(&a, *x) - share(&b, *x)).abs()).fold(0.0, f64::max);
    most * (a.len() as f64 * b.len() as f64 / (a.len() + b.len()) as f64).sqrt()
}

#[test]
fn law_normals_are_standard_normals() {
    // The first draws of many trials, and many draws of a few trials.
    let across: Vec<f64> =
        (0..400_000).map(|trial| Streams::new(1, trial).open(Purpose::Resolver).normal()).collect();
    let within: Vec<f64> = (0..4)
        .flat_map(|trial| {
            let mut draws = Streams::new(2, trial).open(Purpose::CurrentNoise);
            (0..100_000).map(move |_| draws.normal())
        })
        .collect();
    for normals in [across, within] {
        let n = normals.len() as f64;
        let (powers, neighbours) = moments(&normals);
        // Variances of the powers: 1, 2, 15, 96.
        let expected = [(0.0, 1.0_f64), (1.0, 2.0), (0.0, 15.0), (3.0, 96.0)];
        for (k, (power, (mean, variance))) in powers.into_iter().zip(expected).enumerate() {
            assert!((power - mean).abs() < 4.0 * (variance / n).sqrt(), "power {}: {power}", k + 1);
        }
        assert!(neighbours.abs() < 4.0 / n.sqrt(), "{neighbours}");
        for bound in [1.0, 2.0, 3.0, 4.0] {
            let expected = n * 2.0 * lower_tail(bound);
            let found = normals.iter().filter(|z| z.abs() > bound).count() as f64;
            assert!((found - expected).abs() < 4.0 * expected.sqrt(), "beyond {bound}: {found}, {expected}");
        }
        let distance = distance(normals, |z| lower_tail(-z));
        assert!(distance < 1.95, "{distance}");
    }
}

#[test]
fn law_seeded_and_given_draws_have_the_same_distribution() {
    const TRIALS: u64 = 100_000;
    type Read = fn(&mut Draws) -> f64;
    type Distribution = fn(f64) -> f64;
    fn normal(draws: &mut Draws) -> f64 {
        draws.normal()
    }
    fn uniform(draws: &mut Draws) -> f64 {
        draws.uniform()
    }
    fn angle(draws: &mut Draws) -> f64 {
        draws.angle()
    }
    let kinds: [(&str, Read, Distribution); 5] = [
        ("normal", normal, |z| lower_tail(-z)),
        ("uniform", uniform, |u| u),
        ("range", |draws| draws.uniform_in(-3.0..5.0), |x| (x + 3.0) / 8.0),
        ("angle", angle, |angle| angle / TAU),
        (
            "within",
            |draws| draws.normal_within(1.5),
            |z| (lower_tail(-z) - lower_tail(1.5)) / (1.0 - 2.0 * lower_tail(1.5)),
        ),
    ];
    let mut normals = ChaCha8Rng::seed_from_u64(77);
    let mut given = || {
        // Normals of an independent method, the ziggurat.
        let mut tape = Tape::new(99, 0);
        *tape.normals(Purpose::Angle) = (0..3).map(|_| StandardNormal.sample(&mut normals)).collect();
        tape
    };
    for (name, read, distribution) in kinds {
        let seeded: Vec<f64> =
            (0..TRIALS).map(|trial| read(&mut Streams::new(1, trial).open(Purpose::Angle))).collect();
        let taped: Vec<f64> =
            (0..TRIALS).map(|_| read(&mut Streams::taped(&given()).open(Purpose::Angle))).collect();
        let between = distance_between(seeded.clone(), taped.clone());
        assert!(between < 1.95, "{name}: seeded against given {between}");
        for (kind, numbers) in [("seeded", seeded), ("given", taped)] {
            let distance = distance(numbers, distribution);
            assert!(distance < 1.95, "{name}, {kind}: {distance}");
        }
    }
    // Integers: χ² with 200 degrees of freedom is below 268 with a probability of 99.9 %.
    let chi = |read: &mut dyn FnMut(u64) -> u64| {
        let mut counts = [0_u32; 201];
        for trial in 0..201_000 {
            counts[usize::try_from(read(trial)).expect("up to 200")] += 1;
        }
        counts.iter().map(|count| (f64::from(*count) - 1e3).powi(2) / 1e3).sum::<f64>()
    };
    let seeded = chi(&mut |trial| Streams::new(1, trial).open(Purpose::Jitter).integer(200));
    let taped = chi(&mut |_| {
        let mut tape = given();
        let normals = std::mem::take(tape.normals(Purpose::Angle));
        *tape.normals(Purpose::Jitter) = normals;
        Streams::taped(&tape).open(Purpose::Jitter).integer(200)
    });
    assert!(seeded < 268.0 && taped < 268.0, "{seeded} {taped}");
}

#[test]
fn analytic_given_normals_are_read_by_their_quantile() {
    let mut tape = Tape::new(1, 0);
    // Φ(−1) = 0.158655, Φ(0.674490) = ¾.
    let quartile = 0.674_489_750_196_082;
    for (normal, uniform, integer) in
        [(0.0, 0.5, 100), (-1.0, 0.158_655_253_931_457, 31), (quartile, 0.75, 150)]
    {
        *tape.normals(Purpose::Jitter) = vec![normal; 3];
        let mut draws = Streams::taped(&tape).open(Purpose::Jitter);
        assert_eq!(draws.normal(), normal);
        assert!((draws.uniform() - uniform).abs() < 1e-14);
        // The integer is the floor of 201 u.
        assert_eq!(draws.integer(200), integer);
    }
    for (x, y, degrees) in [(2.0, 0.0, 0.0), (0.0, 0.1, 90.0), (-1.0, -0.0, 180.0), (1.0, -1.0, 315.0)] {
        *tape.normals(Purpose::Angle) = vec![x, y];
        let angle = Streams::taped(&tape).open(Purpose::Angle).angle().to_degrees();
        assert!((angle - degrees).abs() < 1e-12, "{x} {y}: {angle}");
    }
    *tape.normals(Purpose::Angle) = vec![1.0, -1e-300];
    assert_eq!(Streams::taped(&tape).open(Purpose::Angle).angle(), 0.0);
    // A normal truncated to ±0.674 (its middle half) has its upper quartile at Φ⁻¹(⅝) = 0.3186.
    let within = |tape: &mut Tape, normal: f64, most: f64| {
        *tape.normals(Purpose::Tolerance) = vec![normal];
        Streams::taped(tape).open(Purpose::Tolerance).normal_within(most)
    };
    assert!((within(&mut tape, quartile, quartile) - 0.318_639_363_964_375).abs() < 1e-13);
    assert!((within(&mut tape, -quartile, quartile) + 0.318_639_363_964_375).abs() < 1e-13);
    assert_eq!(within(&mut tape, 50.0, 2.0), 2.0);
    assert_eq!(within(&mut tape, -3.7, f64::INFINITY), -3.7);
}

#[test]
fn law_a_tape_grows_and_keeps_what_nobody_reads() {
    let mut tape = Tape::new(1, 4);
    *tape.normals(Purpose::CurrentGain) = vec![1.0, 2.0, 3.0, 4.0, 5.0];
    *tape.normals(Purpose::Backlash) = vec![9.0];
    *tape.normals_named(Purpose::Tolerance, "motor.d") = vec![7.0];
    let given = tape.clone();
    let read = |purpose, name, count| {
        let mut draws = Streams::taped(&tape).open_named(purpose, name);
        (0..count).map(|_| draws.normal()).collect::<Vec<f64>>()
    };
    assert_eq!(read(Purpose::CurrentGain, "", 2), [1.0, 2.0]);
    let mut seeded = Streams::new(1, 4).open(Purpose::CurrentNoise);
    let noise = read(Purpose::CurrentNoise, "", 70);
    assert_eq!(noise, [(); 70].map(|()| seeded.normal()));
    let longer = read(Purpose::CurrentGain, "", 8);
    assert_eq!(longer[..5], [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(read(Purpose::CurrentGain, "", 8), longer);
    // Each name has its own draws.
    assert_eq!(read(Purpose::Tolerance, "motor.d", 1), [7.0]);
    let mut other = Streams::new(1, 4).open_named(Purpose::Tolerance, "motor.q");
    assert_eq!(read(Purpose::Tolerance, "motor.q", 1), [other.normal()]);

    let counts = |tape: &mut Tape| {
        tape.strips().iter().map(|strip| (strip.purpose, strip.normals.len(), strip.read)).collect::<Vec<_>>()
    };
    let expected = [
        (Purpose::CurrentGain, 8, 8),
        (Purpose::Backlash, 1, 0),
        (Purpose::Tolerance, 1, 1),
        (Purpose::CurrentNoise, 70, 70),
        (Purpose::Tolerance, 1, 1),
    ];
    assert_eq!(counts(&mut tape), expected);
    tape.rewind();
    assert!(counts(&mut tape).iter().all(|(_, _, read)| *read == 0));
    // The draws appended to one strip do not depend on the other strips.
    let mut alone = given;
    alone.grow_from(8, 0);
    let mut eighth = Streams::new(8, 0).open(Purpose::CurrentGain);
    let eighth = [(); 8].map(|()| eighth.normal());
    let mut draws = Streams::taped(&alone).open(Purpose::CurrentGain);
    let grown = [(); 8].map(|()| draws.normal());
    assert_eq!(grown, [1.0, 2.0, 3.0, 4.0, 5.0, eighth[5], eighth[6], eighth[7]]);
}

#[test]
fn law_draws_opened_together_are_those_opened_one_by_one() {
    let purposes = [Purpose::CurrentGain, Purpose::CurrentOffset, Purpose::LinkError, Purpose::Resolver];
    let mut tape = Tape::new(3, 7);
    *tape.normals(Purpose::LinkError) = vec![-3.0, 0.5];
    for streams in [Streams::new(3, 7), Streams::taped(&tape)] {
        for (purpose, mut together) in purposes.into_iter().zip(streams.open_together(purposes)) {
            let mut alone = streams.open(purpose);
            for _ in 0..60 {
                assert_eq!(together.normal(), alone.normal(), "{purpose:?}");
            }
        }
    }
}
