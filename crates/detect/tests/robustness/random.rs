//! Numbers, and nameplates of motors and drives, plausible or not.

use standstill_detect::{Comparing, Dividers, Nameplate, Place, Sensing, Signature};
use standstill_interface::{Nanos, Real};

/// A small deterministic generator (xorshift).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 20) % n
    }

    pub fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    /// In [−1, 1).
    pub fn unit(&mut self) -> f64 {
        self.below(1 << 40) as f64 / f64::from(1_u32 << 20) / f64::from(1_u32 << 19) - 1.0
    }

    pub fn of<X: Copy>(&mut self, values: &[X]) -> X {
        values[usize::try_from(self.below(values.len() as u64)).expect("small")]
    }

    /// Anything a float can be.
    pub fn any<T: Real>(&mut self) -> T {
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

    pub fn nanos(&mut self) -> Nanos {
        let most = [0, 1, 4, 400, 10_000, 80_000, 1_000_000, 1_000_000_000, u64::MAX];
        Nanos(if self.one_in(2) { self.of(&most) } else { self.below(3_000_000) })
    }

    pub fn count(&mut self) -> u16 {
        let odd = [0, 1, 2, 3, 6, 127, 128, 255, 256, 32_766, 32_768, 65_535];
        self.of(&odd)
    }

    pub fn small(&mut self) -> u8 {
        self.of(&[0, 1, 2, 3, 4, 127, 128, 254, 255])
    }
}

/// A motor and drive as there are.
pub fn plausible<T: Real>(random: &mut Random) -> Nameplate<T> {
    let mut within = |low: f64, high: f64| low * (high / low).powf((random.unit() + 1.0) / 2.0);
    let (rated_current, d, ratio) = (within(0.05, 2000.0), within(2e-6, 1.0), within(0.3, 3.5));
    let dc_link = within(12.0, 1500.0);
    let carrier = within(2e-5, 5e-4);
    let q = d * ratio;
    // A pulse of some thousand ticks, half of the drives without comparator.
    let tick = 1.3e-3 * rated_current * d.max(q) / dc_link;
    let tick = if within(0.5, 2.0) > 1.0 { tick } else { 0.0 };
    let comparator = Comparing { tick: T::of(tick), ..Comparing::default() };
    Nameplate {
        rated_current: T::of(rated_current),
        resistance: T::of(within(1e-3, 20.0)),
        d_axis_inductance: T::of(d),
        q_axis_inductance: T::of(q),
        magnet_flux: T::of(within(1e-3, 5.0)),
        signature: Signature::Normal,
        pulse_signature: Signature::Normal,
        polarity_difference: T::of(within(0.01, 0.4)),
        cross_saturation: T::of(within(0.01, 1.0)),
        rated_pulse: Nanos::from_seconds((0.7 * rated_current * (d + q) / dc_link).max(2e-5)),
        gain_tolerance: T::of(0.005),
        dc_link: T::of(dc_link),
        dead_time: Nanos(1000),
        delay_mismatch: T::of(20e-9),
        carrier_period: Nanos::from_seconds(carrier),
        switch_drop: [T::of(1.0), T::of(0.01)],
        diode_drop: [T::of(1.0), T::of(0.01)],
        reverse_drop: [T::of(1.0), T::of(0.01)],
        sensing: Sensing { comparator, ..Sensing::default() },
        dividers: Dividers { gain_tolerance: T::of(0.005), offset: T::of(0.2), bandwidth: None },
    }
}

pub fn nonsense<T: Real>(random: &mut Random) -> Nameplate<T> {
    let mut plate = plausible(random);
    for _ in 0..random.below(4) {
        match random.below(14) {
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
            11 => plate.sensing.place = random.of(&[Place::InLine, Place::BelowLegs, Place::InLink]),
            12 => plate.switch_drop = [random.any(), random.any()],
            _ => plate.diode_drop = [random.any(), random.any()],
        }
    }
    let _ = plate.check();
    plate
}
