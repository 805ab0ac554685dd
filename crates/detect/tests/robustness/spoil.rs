//! Settings that no engineer would choose.

use standstill_detect::{
    Adaptive, BipolarSettings, BothWaysSettings, Correction, InjectionMethod, Method, ModulationSettings,
    OpenTerminalSettings, PolarityRule, PolaritySettings, PulseTrainSettings, SequentialSettings,
    SettleSettings, Signature,
};
use standstill_interface::{Nanos, Real};

use crate::random::Random;

fn spoil_settle<T: Real>(s: &mut SettleSettings<T>, random: &mut Random) {
    match random.below(3) {
        0 => s.wait = random.nanos(),
        1 => s.threshold = random.any(),
        _ => s.attempts = random.count(),
    }
}

fn spoil_polarity<T: Real>(s: &mut PolaritySettings<T>, random: &mut Random) {
    match random.below(10) {
        0 => s.carrier_period = random.nanos(),
        1 => s.periods = random.count(),
        2 => s.current = random.any(),
        3 => s.resistance = random.any(),
        4 => s.dead_time = random.nanos(),
        5 => s.least_current = random.any(),
        6 => s.least_margin = random.any(),
        7 => s.signature = random.of(&[Signature::Normal, Signature::Inverted, Signature::None]),
        8 => s.rule = PolarityRule::TwoVectors,
        _ => {
            let mut settings = SequentialSettings::new(random.any());
            match random.below(4) {
                0 => settings.error = random.any(),
                1 => settings.effect = random.any(),
                2 => settings.floor = random.any(),
                _ => settings.most_pairs = random.small(),
            }
            s.rule = PolarityRule::Sequential(settings);
        }
    }
}

fn spoil_modulation<T: Real>(s: &mut ModulationSettings<T>, random: &mut Random) {
    match random.below(5) {
        0 => s.carrier_period = random.nanos(),
        1 => s.dead_time = random.nanos(),
        2 => s.drop = random.any(),
        3 => s.inductance = random.any(),
        _ => s.fade = random.any(),
    }
}

fn spoil_train<T: Real>(s: &mut PulseTrainSettings<T>, random: &mut Random) {
    match random.below(13) {
        0 => s.pulse = random.nanos(),
        1 => s.rest = random.nanos(),
        2 => s.rounds = random.small(),
        3 => s.interval = random.nanos(),
        4 => s.zeroing = random.count(),
        5 => s.threshold = random.any(),
        6 => s.attempts = random.count(),
        7 => s.least_current = random.any(),
        8 => s.dead_time = random.nanos(),
        9 => s.resistance = random.any(),
        10 => s.on_drop = random.any(),
        11 => s.off_drop = random.any(),
        // Short pulses that the checks of a train allow.
        _ => {
            s.interval = Nanos(1 + random.below(200));
            s.pulse = s.interval * (1 + random.below(8));
            s.rest = s.pulse * 2;
            s.dead_time = Nanos::ZERO;
        }
    }
}

fn spoil_both_ways<T: Real>(s: &mut BothWaysSettings<T>, random: &mut Random) {
    match random.below(7) {
        0 => s.least_saliency = random.any(),
        1 => s.gain_tolerance = random.any(),
        2 => s.pole_error = random.any(),
        3 => s.pole_floor = random.any(),
        4 => s.correction = Correction::new([random.any(); 4]).unwrap_or(Correction::none()),
        _ => spoil_train(&mut s.train, random),
    }
}

fn spoil_open_terminal<T: Real>(s: &mut OpenTerminalSettings<T>, random: &mut Random) {
    match random.below(16) {
        0 => s.pulse = random.nanos(),
        1 => s.rest = random.nanos(),
        2 => s.rounds = random.small(),
        3 => s.interval = random.nanos(),
        4 => s.settle = random.nanos(),
        5 => s.attempts = random.count(),
        6 => s.comparison = false,
        7 => s.gain_tolerance = random.any(),
        8 => s.offset = random.any(),
        9 => s.pole_floor = random.any(),
        10 => s.resistance = random.any(),
        11 => s.line_inductance = random.any(),
        12 => s.cross_saturation = random.any(),
        13 => s.dead_time = random.nanos(),
        14 => s.least_saliency = random.any(),
        _ => s.pole_error = random.any(),
    }
}

pub fn spoil<T: Real>(method: &mut Method<T>, random: &mut Random) {
    match method {
        Method::Foreign(_) => {}
        Method::LineInductance(s) => match random.below(10) {
            0 => s.pulse = random.nanos(),
            1 => s.period = random.nanos(),
            2 => s.pulses = random.small(),
            3 => s.sample_lead = random.nanos(),
            4 => s.dead_time = random.nanos(),
            5 => s.least_current = random.any(),
            6 => s.least_saliency = random.any(),
            7 => spoil_settle(&mut s.settle, random),
            _ => spoil_polarity(&mut s.polarity, random),
        },
        Method::Subdivision(s) => match random.below(6) {
            0 => s.d_axis_inductance = random.any(),
            1 => s.halvings = random.small(),
            2 => s.least_saliency = random.any(),
            3 => spoil_settle(&mut s.settle, random),
            _ => spoil_polarity(&mut s.vector, random),
        },
        Method::HfiRotating(InjectionMethod(s, ..)) | Method::HfiPulsating(InjectionMethod(s, ..)) => {
            match random.below(14) {
                0 => s.voltage = random.any(),
                1 => s.periods = random.count(),
                2 => s.ramp = random.count(),
                3 => s.cycles = random.count(),
                4 => s.iterations = random.small(),
                5 => s.resistance = random.any(),
                6 => s.d_axis_inductance = random.any(),
                7 => s.q_axis_inductance = random.any(),
                8 => s.least_saliency = random.any(),
                9 => s.least_current = random.any(),
                10 => spoil_settle(&mut s.settle, random),
                11 => spoil_polarity(&mut s.polarity, random),
                12 => (s.ramp, s.cycles) = (random.count(), random.count()),
                _ => spoil_modulation(&mut s.modulation, random),
            }
        }
        Method::DcAlignment(s) => match random.below(10) {
            0 => s.current = random.any(),
            1 => s.resistance = random.any(),
            2 => s.magnet_flux = random.any(),
            3 => s.least_sweep = random.any(),
            4 => s.periods = random.count(),
            5 => s.ramp = random.count(),
            6 => s.hold = random.count(),
            7 => (s.ramp, s.hold) = (random.count(), random.count()),
            8 => spoil_settle(&mut s.settle, random),
            _ => spoil_modulation(&mut s.modulation, random),
        },
        Method::Bipolar(BipolarSettings(s)) => spoil_both_ways(s, random),
        Method::OpenTerminal(s) => spoil_open_terminal(s, random),
        Method::MaximumLikelihood(s) => match random.below(9) {
            5 => {
                s.adaptive = Some(Adaptive {
                    deviation: random.any(),
                    longest: random.nanos(),
                    most_current: random.any(),
                    most_trains: random.small(),
                });
            }
            6 => {
                spoil_train(&mut s.pulses.train, random);
                if let Some(adaptive) = &mut s.adaptive {
                    adaptive.longest = Nanos(1_000_000);
                }
            }
            _ => spoil_both_ways(&mut s.pulses, random),
        },
        Method::SixPulse(s) => match random.below(10) {
            0 => s.threshold = random.any(),
            1 => s.longest = random.nanos(),
            2 => s.sampled = random.nanos(),
            3 => s.pause = random.any(),
            4 => s.rounds = random.small(),
            5 => s.timed = !s.timed,
            6 => s.sensing.comparator.tick = random.any(),
            7 => s.sensing.comparator.delay = random.any(),
            8 => s.pole_error = random.any(),
            _ => s.dead_time = random.nanos(),
        },
    }
}
