//! No reading, setting or nameplate makes a detector panic, run for ever or name an angle that is none.

use standstill_detect::{
    Adaptive, Correction, Decay, Method, MethodName, ModulationSettings, Nameplate, PolarityRule,
    PolaritySettings, PulseTrainSettings, SequentialSettings, Settings, SettleSettings, Signature,
};
use standstill_interface::{
    Abc, Command, Detector, Leg, Nanos, Outcome, PoleEvidence, Reading, Real, Sensed, Step,
};

/// A small deterministic generator (xorshift).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 20) % n
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    /// In [−1, 1).
    fn unit(&mut self) -> f64 {
        self.below(1 << 40) as f64 / f64::from(1_u32 << 20) / f64::from(1_u32 << 19) - 1.0
    }

    fn of<X: Copy>(&mut self, values: &[X]) -> X {
        values[usize::try_from(self.below(values.len() as u64)).expect("small")]
    }

    /// Anything a float can be.
    fn any<T: Real>(&mut self) -> T {
        if self.one_in(2) {
            let decade = self.unit() * 12.0;
            return T::of(self.unit() * 10_f64.powf(decade));
        }
        let odd = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            1.0,
            -1.0,
            1e-45,
            1e-30,
            3e38,
            -3e38,
            f64::MAX,
        ];
        T::of(self.of(&odd))
    }

    fn nanos(&mut self) -> Nanos {
        let most = [0, 1, 4, 400, 10_000, 80_000, 1_000_000, 1_000_000_000, u64::MAX];
        Nanos(if self.one_in(2) { self.of(&most) } else { self.below(3_000_000) })
    }

    fn count(&mut self) -> u16 {
        let odd = [0, 1, 2, 3, 6, 127, 128, 255, 256, 32_766, 32_768, 65_535];
        self.of(&odd)
    }

    fn small(&mut self) -> u8 {
        self.of(&[0, 1, 2, 3, 4, 127, 128, 254, 255])
    }
}

/// A motor and drive as there are.
fn plausible<T: Real>(random: &mut Random) -> Nameplate<T> {
    let mut within = |low: f64, high: f64| low * (high / low).powf((random.unit() + 1.0) / 2.0);
    let (rated_current, d, ratio) = (within(0.05, 2000.0), within(2e-6, 1.0), within(0.3, 3.5));
    let dc_link = within(12.0, 1500.0);
    let carrier = within(2e-5, 5e-4);
    let q = d * ratio;
    Nameplate {
        rated_current: T::of(rated_current),
        resistance: T::of(within(1e-3, 20.0)),
        d_axis_inductance: T::of(d),
        q_axis_inductance: T::of(q),
        magnet_flux: T::of(within(1e-3, 5.0)),
        signature: Signature::Normal,
        pulse_signature: Signature::Normal,
        polarity_difference: T::of(within(0.01, 0.4)),
        rated_pulse: Nanos::from_seconds((0.7 * rated_current * (d + q) / dc_link).max(2e-5)),
        gain_tolerance: T::of(0.005),
        dc_link: T::of(dc_link),
        dead_time: Nanos(1000),
        carrier_period: Nanos::from_seconds(carrier),
        switch_drop: [T::of(1.0), T::of(0.01)],
        diode_drop: [T::of(1.0), T::of(0.01)],
    }
}

fn nonsense<T: Real>(random: &mut Random) -> Nameplate<T> {
    let mut plate = plausible(random);
    for _ in 0..random.below(4) {
        match random.below(13) {
            0 => plate.rated_current = random.any(),
            1 => plate.resistance = random.any(),
            2 => plate.d_axis_inductance = random.any(),
            3 => plate.q_axis_inductance = random.any(),
            4 => plate.magnet_flux = random.any(),
            5 => plate.polarity_difference = random.any(),
            6 => plate.rated_pulse = random.nanos(),
            7 => plate.gain_tolerance = random.any(),
            8 => plate.dc_link = random.any(),
            9 => plate.dead_time = random.nanos(),
            10 => plate.carrier_period = random.nanos(),
            11 => plate.switch_drop = [random.any(), random.any()],
            _ => plate.diode_drop = [random.any(), random.any()],
        }
    }
    let _ = plate.check();
    plate
}

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

fn spoil<T: Real>(method: &mut Method<T>, random: &mut Random) {
    match method {
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
        Method::HfiRotating(standstill_detect::RotatingInjectionSettings(s))
        | Method::HfiPulsating(standstill_detect::PulsatingInjectionSettings(s)) => match random.below(14) {
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
        },
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
        Method::Bipolar(s) => match random.below(7) {
            0 => s.least_saliency = random.any(),
            1 => s.gain_tolerance = random.any(),
            2 => s.pole_error = random.any(),
            3 => s.pole_floor = random.any(),
            4 => s.correction = Correction::new([random.any(); 4]).unwrap_or(Correction::none()),
            _ => spoil_train(&mut s.train, random),
        },
        Method::MaximumLikelihood(s) => match random.below(9) {
            0 => s.least_saliency = random.any(),
            1 => s.gain_tolerance = random.any(),
            2 => s.pole_error = random.any(),
            3 => s.pole_floor = random.any(),
            4 => s.correction = Correction::new([random.any(); 4]).unwrap_or(Correction::none()),
            5 => {
                s.adaptive = Some(Adaptive {
                    deviation: random.any(),
                    longest: random.nanos(),
                    most_current: random.any(),
                    most_trains: random.small(),
                });
            }
            6 => {
                spoil_train(&mut s.train, random);
                if let Some(adaptive) = &mut s.adaptive {
                    adaptive.longest = Nanos(1_000_000);
                }
            }
            _ => spoil_train(&mut s.train, random),
        },
    }
}

/// Readings as a drive might send them: mostly a motor's, now and then anything.
struct Drive {
    random: Random,
    /// Of 1000 readings so many are nonsense.
    nonsense: u64,
    current: f64,
}

impl Drive {
    fn reading<T: Real>(&mut self, at: Nanos, phases: [f64; 3]) -> Reading<T> {
        let random = &mut self.random;
        let wild = random.below(1000) < self.nonsense;
        let mut reading = Reading {
            at,
            current: Abc(phases.map(|phase| T::of(phase))),
            sensed: Abc([Sensed::Measured; 3]),
            dc_link: T::of(540.0),
            dc_link_clipped: false,
        };
        if wild {
            let kinds = [Sensed::Measured, Sensed::Derived, Sensed::Clipped, Sensed::Hidden];
            for k in 0..3 {
                if random.one_in(2) {
                    reading.current.0[k] = random.any();
                }
                if random.one_in(3) {
                    reading.sensed.0[k] = random.of(&kinds);
                }
            }
            if random.one_in(2) {
                reading.dc_link = random.any();
            }
            reading.dc_link_clipped = random.one_in(8);
        }
        reading
    }

    /// Triangles into the phases that are driven, rest without; and a wrong count once in a while.
    fn readings<T: Real>(&mut self, command: &Command<T>) -> Vec<Reading<T>> {
        let share = |leg: &Leg<T>| match leg {
            Leg::Off => 0.0,
            Leg::Low => -1.0,
            Leg::High => 1.0,
            Leg::Duty(duty) => {
                let duty = duty.to_double();
                assert!((0.0..=1.0).contains(&duty), "duty {duty}");
                2.0 * duty - 1.0
            }
        };
        let shares = command.stage.legs.0.each_ref().map(share);
        let mean = shares.iter().sum::<f64>() / 3.0;
        let driven = shares.iter().any(|share| *share > 0.0);
        let mut count = u64::from(command.sampling.count).min(2000);
        if self.nonsense > 0 && self.random.one_in(500) {
            count = self.random.below(count + 3);
        }
        let (on, off) = (command.stage.duration.seconds(), command.duration().seconds());
        (0..u32::try_from(count).expect("few"))
            .map(|k| {
                let at = command.sampling.trigger(k);
                let t = at.seconds();
                let rise = if t <= on { t / on } else { 1.0 - (t - on) / (0.8 * (off - on)) };
                let height = if driven { self.current * rise.max(0.0) } else { 0.0 };
                let phases = shares.map(|share| {
                    let driven =
                        if matches!(command.stage.legs.0[0], Leg::Duty(_)) { share - mean } else { share };
                    height * driven * (1.0 + 0.2 * self.random.unit()) + 1e-3 * self.random.unit()
                });
                self.reading(at, phases)
            })
            .collect()
    }
}

/// Runs it for at most so many steps; whether it ended.
fn run<T: Real>(detector: &mut impl Detector<T>, drive: &mut Drive, steps: u32) -> bool {
    let mut readings = Vec::new();
    for _ in 0..steps {
        match detector.step(&readings) {
            Step::Drive(command) => {
                readings = drive.readings(&command);
                assert!(command.duration() <= Nanos(130_000_000_000), "{command:?}");
                assert!(command.sampling.last() <= Some(command.duration()), "{command:?}");
            }
            Step::Done(outcome) => {
                if let Outcome::Found { angle, findings } | Outcome::Axis { angle, findings, .. } = outcome {
                    assert!(angle.radians() >= T::zero() && angle.radians() < T::TAU(), "{outcome:?}");
                    assert!(findings.pole_error.is_none_or(|error| !error.is_nan()), "{outcome:?}");
                    let found = matches!(outcome, Outcome::Found { .. });
                    let speaks = |evidence: PoleEvidence<T>| {
                        evidence.is_enough() == found && !(found && evidence.deviations <= T::zero())
                    };
                    assert!(findings.pole_evidence.is_none_or(speaks), "{outcome:?}");
                }
                if let Outcome::Failed { fault, .. } = outcome {
                    assert!(!fault.to_string().is_empty());
                }
                return true;
            }
        }
    }
    false
}

fn feed_garbage<T: Real>() {
    for name in MethodName::ALL {
        let mut random = Random(0x1234_5678_9ABC_DEF1);
        let mut ended = 0;
        for trial in 0..120 {
            let mut plate = plausible::<T>(&mut random);
            plate.signature = random.of(&[Signature::Normal, Signature::Inverted, Signature::None]);
            let Ok(mut detector) = Method::suited(name, &plate).detector() else { continue };
            let nonsense = [0, 0, 1, 20, 300, 1000][trial % 6];
            let current = plate.rated_current.to_double() * random.of(&[0.2, 1.0, 3.0]);
            let mut drive = Drive { random: Random(random.next() | 1), nonsense, current };
            ended += u32::from(run(&mut detector, &mut drive, 4000));
        }
        assert!(ended > 60, "{name}: {ended}");
    }
}

#[test]
fn law_no_reading_makes_a_detector_panic() {
    feed_garbage::<f64>();
    feed_garbage::<f32>();
}

fn build_anything<T: Real>() {
    let mut random = Random(0x0DDB_1A5E_5BAD_5EED);
    let mut built = [0_u32; MethodName::ALL.len()];
    for trial in 0..12_000 {
        let method = trial % MethodName::ALL.len();
        let plate = nonsense::<T>(&mut random);
        let mut settings = Method::suited(MethodName::ALL[method], &plate);
        for _ in 0..random.below(3) {
            spoil(&mut settings, &mut random);
        }
        if random.one_in(4) {
            settings = settings.with_pulse(random.nanos()).unwrap_or(settings);
        }
        if let Ok(mut detector) = settings.detector() {
            built[method] += 1;
            let nonsense = random.of(&[0, 0, 3]);
            let current = random.of(&[1.0, 10.0, plate.rated_current.to_double()]);
            let mut drive = Drive { random: Random(random.next() | 1), nonsense, current };
            run(&mut detector, &mut drive, 300);
        }
    }
    assert!(built.iter().all(|count| *count > 150), "{built:?}");
}

#[test]
fn law_no_setting_makes_a_detector_panic() {
    build_anything::<f64>();
    build_anything::<f32>();
}

#[test]
fn law_settings_that_suit_a_motor_work() {
    let mut random = Random(77);
    for _ in 0..2000 {
        let plate = plausible::<f64>(&mut random);
        plate.check().expect("plausible");
        for name in MethodName::ALL {
            let settings = Method::suited(name, &plate);
            assert!(settings.detector().is_ok(), "{name}: {:?}, {plate:?}", settings.detector().err());
            assert!(Method::suited(name, &plate.cast::<f32>()).detector().is_ok(), "{name} {plate:?}");
        }
    }
}

#[test]
fn law_each_name_is_its_method() {
    let plate = plausible::<f64>(&mut Random(5));
    for name in MethodName::ALL {
        let settings = Method::suited(name, &plate);
        let is = match (name, settings) {
            (MethodName::LineInductance, Method::LineInductance(s)) => s.decay == Decay::Slow,
            (MethodName::LineInductanceFast, Method::LineInductance(s)) => s.decay == Decay::Fast,
            (MethodName::MaximumLikelihood, Method::MaximumLikelihood(s)) => s.adaptive.is_none(),
            (MethodName::MaximumLikelihoodAdaptive, Method::MaximumLikelihood(s)) => s.adaptive.is_some(),
            (MethodName::Subdivision, Method::Subdivision(_))
            | (MethodName::HfiRotating, Method::HfiRotating(_))
            | (MethodName::HfiPulsating, Method::HfiPulsating(_))
            | (MethodName::DcAlignment, Method::DcAlignment(_))
            | (MethodName::Bipolar, Method::Bipolar(_)) => true,
            _ => false,
        };
        assert!(is, "{name}");
        assert_eq!(settings.turns_rotor(), name == MethodName::DcAlignment);
        assert_eq!(settings.has_line_pulses(), settings.with_pulse(Nanos::from_micros(200)).is_some());
    }
}
