//! A drive that sends what it likes.

use standstill_interface::{Capture, Command, Leg, Nanos, Phase, Reading, Real, Sensed};

use crate::random::Random;

/// Readings as a drive might send them: mostly a motor's, now and then anything.
pub struct Drive {
    pub random: Random,
    /// Of 1000 readings so many are nonsense.
    pub nonsense: u64,
    pub current: f64,
}

impl Drive {
    fn reading<T: Real>(&mut self, at: Nanos, phases: [f64; 3], terminals: [f64; 3]) -> Reading<T> {
        let random = &mut self.random;
        let wild = random.below(1000) < self.nonsense;
        let mut reading = Reading::measured(at, phases.map(|phase| T::of(phase)), T::of(540.0));
        reading.terminal.0 = terminals.map(|voltage| T::of(voltage + 0.1 * random.unit()));
        reading.terminal_sensed.0 = [Sensed::Measured; 3];
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
            for k in 0..3 {
                if random.one_in(3) {
                    reading.terminal.0[k] = random.any();
                }
                if random.one_in(4) {
                    reading.terminal_sensed.0[k] = random.of(&kinds);
                }
            }
            if random.one_in(2) {
                reading.dc_link = random.any();
            }
            reading.dc_link_clipped = random.one_in(8);
        }
        if random.one_in(2) {
            let usual = u32::try_from(1000 + random.below(300)).expect("few");
            let ticks = if wild { random.of(&[0, 1, u32::MAX]) } else { usual };
            reading.capture = Some(Capture { ticks, comparator: Phase::A });
        }
        reading
    }

    /// Triangles into the phases that are driven, rest without; and a wrong count once in a while.
    pub fn readings<T: Real>(&mut self, command: &Command<T>) -> Vec<Reading<T>> {
        let share = |leg: &Leg<T>| match leg {
            Leg::Off | Leg::Rise(_) | Leg::Fall(_) => 0.0,
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
                // The rails, and a share of the link's voltage that is each leg's own.
                let terminals = core::array::from_fn(|k| match shares[k] {
                    _ if t > on => 0.0,
                    share if share > 0.0 => 540.0,
                    share if share < 0.0 => 0.0,
                    _ => 270.0 + 30.0 * (k as f64 - 1.2),
                });
                self.reading(at, phases, terminals)
            })
            .collect()
    }
}
