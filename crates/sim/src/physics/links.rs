//! DC links of several machines side by side.

use std::f64::consts::TAU;

use standstill_inverter::{DcLink, Source};
use standstill_numeric::{Lane, Wide};

/// DC links of one kind. Either all of them have a ripple or none has one; the same holds for a sag and for a storage. Their values may
/// differ.
#[derive(Clone, Debug)]
pub struct Links<V: Wide> {
    /// Mean voltage of the source in V.
    voltage: V,
    ripple: Option<Ripples<V>>,
    sag: Option<Sags<V>>,
    /// Capacitor and source resistance; none for a link without a capacitor.
    pub storage: Option<Storages<V>>,
}

/// Sinusoidal ripples of the sources' voltages.
#[derive(Clone, Debug, Default)]
struct Ripples<V: Wide> {
    /// Amplitude in V.
    amplitude: V,
    /// Angular frequency in rad/s.
    frequency: V,
    /// Phase in rad.
    phase: V,
    /// Reciprocal of the squared angular frequency in s²/rad².
    per_square: V,
}

/// Temporary sags of the sources' voltages.
#[derive(Clone, Debug, Default)]
struct Sags<V: Wide> {
    /// Half of the sag's depth in V.
    half: V,
    /// Start in s since the start of the run.
    start: V,
    /// Reciprocal of the sag's duration in 1/s.
    rate: V,
}

/// Capacitors of the links. Sources charge them through resistances.
#[derive(Clone, Debug, Default)]
pub struct Storages<V: Wide> {
    /// Reciprocal 1/(R C) of the charging time constant in 1/s.
    pub rate: V,
    /// Elastance 1/C in 1/F.
    pub elastance: V,
    /// Rate in V/s at which the largest current of the source charges the capacitor; none for sources without a limit.
    pub most: Option<V>,
}

impl<V: Wide> Links<V> {
    /// Makes links of the same kind as `link`. All lanes have the values of `link`.
    pub fn like(link: &DcLink) -> Self {
        let mut links = Self {
            voltage: V::of(0.0),
            ripple: (link.ripple != 0.0).then(Ripples::default),
            sag: link.sag.map(|_| Sags::default()),
            storage: link
                .storage
                .map(|_| Storages { most: link.most_current.map(|_| V::of(0.0)), ..Storages::default() }),
        };
        for lane in 0..V::LANES {
            links.put(lane, link);
        }
        links
    }

    /// Returns whether a link is of the same kind as these: with or without ripple, sag and storage.
    pub fn fits(&self, link: &DcLink) -> bool {
        self.ripple.is_some() == (link.ripple != 0.0)
            && self.sag.is_some() == link.sag.is_some()
            && self.storage.is_some() == link.storage.is_some()
            && self.storage.as_ref().is_some_and(|storage| storage.most.is_some())
                == (link.storage.is_some() && link.most_current.is_some())
    }

    /// Returns whether the link's voltage can change so much between two instants that legs without current begin to conduct.
    pub const fn vary(&self) -> bool {
        self.sag.is_some() || self.storage.is_some()
    }

    /// Puts a link of this kind into a lane.
    pub fn put(&mut self, lane: usize, link: &DcLink) {
        let put = |to: &mut V, from: f64| to.put(lane, from);
        put(&mut self.voltage, link.voltage);
        if let Some(ripple) = &mut self.ripple {
            put(&mut ripple.amplitude, link.ripple * link.voltage);
            put(&mut ripple.frequency, TAU * link.ripple_frequency);
            put(&mut ripple.phase, link.ripple_phase);
            put(&mut ripple.per_square, 1.0 / (TAU * link.ripple_frequency * (TAU * link.ripple_frequency)));
        }
        if let (Some(to), Some(sag)) = (&mut self.sag, link.sag) {
            put(&mut to.half, sag.depth * link.voltage / 2.0);
            put(&mut to.start, sag.start);
            put(&mut to.rate, 1.0 / sag.duration);
        }
        if let (Some(to), Some(storage)) = (&mut self.storage, link.storage) {
            put(&mut to.rate, 1.0 / (storage.source_resistance * storage.capacitance));
            put(&mut to.elastance, 1.0 / storage.capacitance);
            if let (Some(to), Some(most)) = (&mut to.most, link.most_current) {
                put(to, most / storage.capacitance);
            }
        }
    }

    /// Returns the voltages in V of the sources, and their slopes in V/s, at the times `t` in s.
    #[inline(always)]
    pub fn source(&self, t: V) -> Source<V> {
        let ripple = self.ripple.as_ref().map(|ripple| [ripple.amplitude, ripple.frequency, ripple.phase]);
        let sag = self.sag.as_ref().map(|sag| [sag.half, sag.start, sag.rate]);
        Source::at(self.voltage, ripple, sag, t)
    }

    /// Returns the voltage and slope of one lane's source at the time `t` in s. The values are bit by bit equal to those of
    /// [`Self::source`].
    pub fn source_of(&self, lane: usize, t: f64) -> Source<f64> {
        let one = |packs: [&V; 3]| packs.map(|pack| pack.get(lane));
        let ripple =
            self.ripple.as_ref().map(|ripple| one([&ripple.amplitude, &ripple.frequency, &ripple.phase]));
        let sag = self.sag.as_ref().map(|sag| one([&sag.half, &sag.start, &sag.rate]));
        Source::at(self.voltage.get(lane), ripple, sag, t)
    }

    /// Returns the integral in V·s of the source's voltage over a step of `h` seconds. It is computed from the values and slopes at both
    /// ends. For a ripple it is exact. For a sag it is the integral of the cubic with these values and slopes.
    #[inline(always)]
    pub fn area(&self, h: V, begin: Source<V>, end: Source<V>) -> V {
        match (&self.ripple, &self.sag) {
            (Some(Ripples { per_square, .. }), None) => {
                self.voltage * h + (begin.rise - end.rise) * *per_square
            }
            _ => hermite_area(h, [begin.voltage, end.voltage], [begin.rise, end.rise]),
        }
    }
}

/// Returns the integral of a cubic over the length `h`: h/2 (y₀ + y₁) + h²/12 (y₀′ − y₁′). `value` and `slope` are those at both ends of
/// the cubic.
#[inline(always)]
pub fn hermite_area<T: Lane>(h: T, value: [T; 2], slope: [T; 2]) -> T {
    h * 0.5 * (value[0] + value[1]) + h * h * (1.0 / 12.0) * (slope[0] - slope[1])
}
