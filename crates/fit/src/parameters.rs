//! Parameters of a fit: names, steps of the difference quotients, and prior knowledge of each.

use std::f64::consts::{PI, SQRT_2};

use standstill_inverter::DeviceKind;

use super::pieces::Piece;
use super::plant::{Frame, Law, Plant};
use super::record::CHANNELS;

/// Half the width of the prior interval of an inductance's fall at rated current, along +d, along −d and along q.
pub const PLAUSIBLE_FALL: f64 = 0.05;

/// Half the width in degrees of the prior interval of an angle that a record states: a magnet aligned by a current, or an encoder zeroed
/// in this way, stands off by friction and cogging.
const STATED_ANGLE_DEG: f64 = 5.0;

/// A parameter of plant or channels, in the order in which parameters that are not identifiable are fixed: the last one first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Inductance L_d at zero current, in H.
    DAxisInductance,
    /// Inductance L_q at zero current, in H.
    QAxisInductance,
    /// Rotor angle θ in rad.
    Angle,
    /// Offset of a channel in A.
    Offset(usize),
    /// Gain of a channel less 1; the mean gain of all channels is 1.
    Gain(usize),
    /// Phase resistance R in Ω.
    Resistance,
    /// Delay of the channels behind the legs' requests, in s.
    Delay,
    /// Dead time in s.
    DeadTime,
    /// Saturation β of the series, or the fall of L_d along +d.
    SaturationAlong,
    /// Saturation γ of the series, or the fall of L_d along −d.
    SaturationAgainst,
    /// Saturation γ_q of the series, or the fall of L_q.
    SaturationAcross,
    /// Threshold voltage of the diodes in V.
    DiodeDrop,
    /// Threshold voltage of the switches in V.
    SwitchDrop,
    /// Slope resistance of the diodes in Ω.
    DiodeResistance,
    /// Slope resistance of the switches in Ω.
    SwitchResistance,
    /// Time constant in s of the current probes, the same for all.
    Lag,
    /// Share of L_d that eddy currents take from an infinitely short pulse.
    EddyDepthAlong,
    /// Share of L_q that eddy currents take from an infinitely short pulse.
    EddyDepthAcross,
    /// Time constant of the eddy currents in s.
    EddyTime,
}

use Parameter::{
    Angle, DAxisInductance, DeadTime, Delay, DiodeDrop, DiodeResistance, EddyDepthAcross, EddyDepthAlong,
    EddyTime, Gain, Lag, Offset, QAxisInductance, Resistance, SaturationAcross, SaturationAgainst,
    SaturationAlong, SwitchDrop, SwitchResistance,
};

/// The place of a parameter's value in a [`Point`].
macro_rules! place {
    ($parameter:expr, $point:expr $(, $mut:tt)?) => {
        match $parameter {
            DAxisInductance => &$($mut)? $point.plant.inductance[0],
            QAxisInductance => &$($mut)? $point.plant.inductance[1],
            Angle => &$($mut)? $point.plant.angle,
            Offset(k) => &$($mut)? $point.offset[k],
            Gain(k) => &$($mut)? $point.gain[k],
            Resistance => &$($mut)? $point.plant.resistance,
            Delay => &$($mut)? $point.delay,
            Lag => &$($mut)? $point.lag,
            EddyDepthAlong => &$($mut)? $point.plant.eddy.d_depth,
            EddyDepthAcross => &$($mut)? $point.plant.eddy.q_depth,
            EddyTime => &$($mut)? $point.plant.eddy.time_constant,
            DeadTime => &$($mut)? $point.plant.dead_time,
            SaturationAlong => &$($mut)? $point.plant.saturation[0],
            SaturationAgainst => &$($mut)? $point.plant.saturation[1],
            SaturationAcross => &$($mut)? $point.plant.saturation[2],
            DiodeDrop => &$($mut)? $point.plant.devices.diode_drop,
            SwitchDrop => &$($mut)? $point.plant.devices.switch_drop,
            DiodeResistance => &$($mut)? $point.plant.devices.diode_resistance,
            SwitchResistance => &$($mut)? $point.plant.devices.switch_resistance,
        }
    };
}

/// Parameters of a simulation and of its channels.
#[derive(Clone, Debug)]
pub struct Point {
    /// Parameters of the plant.
    pub plant: Plant,
    /// Delay of the channels in s.
    pub delay: f64,
    /// Time constant of the probes in s; zero: they have no lag.
    pub lag: f64,
    /// Gains of the channels, less 1.
    pub gain: [f64; CHANNELS],
    /// Offsets of the channels in A.
    pub offset: [f64; CHANNELS],
    /// Shifts of the edges of each piece from the middle between their rows, in s.
    pub shifts: Vec<Vec<f64>>,
}

/// Initial values of the search.
#[derive(Clone, Debug)]
pub struct Begin {
    /// Parameters of the plant.
    pub plant: Plant,
    /// True if the resistance of the switches was stated.
    pub switch_is_stated: bool,
    /// True if the resistance of the winding is that of a similar motor; otherwise it is a guess.
    pub winding_is_stated: bool,
    /// True if the records state the rotor's angle.
    pub angle_is_stated: bool,
}

impl Parameter {
    /// Returns all parameters of a fit with these channels, in the order in which they are kept: later ones are fixed first. The
    /// gain of the last channel follows from the others. A MOSFET's channel has no threshold. Probes and eddy currents have a time
    /// constant if that of the point is not zero.
    pub fn all(channels: [bool; CHANNELS], point: &Point) -> Vec<Self> {
        let present: Vec<usize> = (0..CHANNELS).filter(|k| channels[*k]).collect();
        let mut all = vec![DAxisInductance, QAxisInductance, Angle];
        all.extend(present.iter().map(|k| Offset(*k)));
        all.extend(present[..present.len() - 1].iter().map(|k| Gain(*k)));
        all.extend([
            Resistance,
            Delay,
            DeadTime,
            SaturationAlong,
            SaturationAgainst,
            SaturationAcross,
            DiodeDrop,
            SwitchDrop,
            DiodeResistance,
            SwitchResistance,
        ]);
        if point.lag > 0.0 {
            let after = all.iter().position(|p| *p == Delay).map_or(0, |k| k + 1);
            all.insert(after, Lag);
        }
        if point.plant.eddy.time_constant > 0.0 {
            let after = all.iter().position(|p| *p == Resistance).map_or(0, |k| k + 1);
            all.splice(after..after, [EddyDepthAlong, EddyTime, EddyDepthAcross]);
        }
        let igbt = point.plant.devices.kind == DeviceKind::Igbt;
        all.retain(|parameter| igbt || *parameter != SwitchDrop);
        all
    }

    /// Returns those of [`Self::all`] that currents can determine. A current passes the winding and a switch or a diode: currents
    /// depend on R plus the switch's resistance and on R plus the diode's, and on no other combination of the three. The switch's
    /// resistance stays as it was stated.
    pub fn observable(channels: [bool; CHANNELS], point: &Point) -> Vec<Self> {
        let mut all = Self::all(channels, point);
        all.retain(|parameter| *parameter != SwitchResistance);
        all
    }

    /// Returns true if a change requires another simulation; for the others the derivatives of the channels are known.
    pub fn is_of_plant(self) -> bool {
        !matches!(self, Delay | Gain(_) | Offset(_))
    }

    /// Returns true if the parameter's least value is zero.
    pub fn is_never_negative(self) -> bool {
        self.known().2
    }

    /// Returns the name (of a channel's parameter without the channel), the unit, and whether the least value is zero.
    const fn known(self) -> (&'static str, &'static str, bool) {
        match self {
            DAxisInductance => ("L_d", "H", false),
            QAxisInductance => ("L_q", "H", false),
            Angle => ("angle", "deg", false),
            Offset(_) => ("offset_", "A", false),
            Gain(_) => ("gain_", "", false),
            Resistance => ("resistance", "ohm", true),
            Delay => ("delay", "s", false),
            DeadTime => ("dead_time", "s", true),
            SaturationAlong => ("saturation.d", "", false),
            SaturationAgainst => ("saturation.minus_d", "", false),
            SaturationAcross => ("saturation.q", "", false),
            DiodeDrop => ("diode_drop", "V", true),
            SwitchDrop => ("switch_drop", "V", true),
            DiodeResistance => ("diode_resistance", "ohm", true),
            SwitchResistance => ("switch_resistance", "ohm", true),
            Lag => ("probe_lag", "s", true),
            EddyDepthAlong => ("eddy.d_depth", "", true),
            EddyDepthAcross => ("eddy.q_depth", "", true),
            EddyTime => ("eddy.time_constant", "s", true),
        }
    }

    /// Returns the parameter's value.
    pub fn get(self, point: &Point) -> f64 {
        *place!(self, point)
    }

    /// Changes the parameter's value.
    pub fn add(self, point: &mut Point, change: f64, channels: [bool; CHANNELS]) {
        *place!(self, point, mut) += change;
        if matches!(self, Gain(_)) {
            point.gain[last(channels)] -= change;
        }
    }

    /// Returns the step of the difference quotient: large against the integrator's error, small against non-linearity. The integrator's
    /// error divided by the step is information about directions of which the readings have none: of a step of 40 µΩ on a motor of 30 mΩ
    /// as much as bounded its resistance to 2 mΩ. A current is nearly linear in resistances and drops, so theirs are large.
    pub fn step(self, point: &Point, frame: &Frame, link: f64) -> f64 {
        match self {
            DAxisInductance | QAxisInductance => 1e-3 * self.get(point),
            Resistance | DiodeResistance | SwitchResistance => {
                3e-2 * (0.01 * link / frame.current + point.plant.resistance)
            }
            DeadTime => 10e-9,
            Lag => 1e-2 * point.lag,
            EddyTime => 1e-2 * self.get(point),
            EddyDepthAlong | EddyDepthAcross | Angle | SaturationAlong | SaturationAgainst
            | SaturationAcross => 1e-3,
            DiodeDrop | SwitchDrop => 5e-4 * link,
            // Not differentiated so.
            Delay | Gain(_) | Offset(_) => 1.0,
        }
    }

    /// Returns half the width of the prior interval. An estimate whose 95 % interval is wider is not identified. `reach` is the
    /// largest current in A and `link` the DC-link voltage in V; shares of a resistance or a drop are those of the initial values
    /// `begin`, wherever the search has come to.
    pub fn plausible(self, point: &Point, begin: &Begin, reach: f64, link: f64) -> f64 {
        let Begin { plant: begin, switch_is_stated, winding_is_stated, angle_is_stated } = begin;
        let devices = &begin.devices;
        let resistance = begin.resistance.max(1e-3 * link / reach);
        match self {
            DAxisInductance | QAxisInductance => 0.5 * self.get(point),
            Angle if *angle_is_stated => STATED_ANGLE_DEG.to_radians(),
            Angle => 30_f64.to_radians(),
            Offset(_) => 0.2 * reach,
            Gain(_) => 0.03,
            // Of a guess no more is known than that the link drives the current through it.
            Resistance if !winding_is_stated => 0.5 * link / reach,
            Resistance => 0.5 * resistance.max(point.plant.resistance),
            Delay => 2e-6,
            Lag => point.lag,
            EddyTime => self.get(point),
            EddyDepthAlong | EddyDepthAcross => 0.1,
            DeadTime => 1e-6,
            // The logarithm of a bias.
            SaturationAgainst if point.plant.law == Law::Steep => 1.5,
            SaturationAlong | SaturationAgainst | SaturationAcross if point.plant.law != Law::Series => {
                PLAUSIBLE_FALL
            }
            // Falls of 3γ ± 2β along ±d, each for itself, and of 3 γ_q along q.
            SaturationAlong => PLAUSIBLE_FALL * SQRT_2 / 4.0,
            SaturationAgainst => PLAUSIBLE_FALL * SQRT_2 / 6.0,
            SaturationAcross => PLAUSIBLE_FALL / 3.0,
            DiodeDrop => 0.5 * devices.diode_drop.max(0.3),
            SwitchDrop => 0.5 * devices.switch_drop.max(0.3),
            DiodeResistance => 0.5 * devices.diode_resistance.max(0.02 * resistance),
            // Of one that nobody stated no more is known than its order of magnitude.
            SwitchResistance => {
                let share = if *switch_is_stated { 0.5 } else { 1.0 };
                share * devices.switch_resistance.max(0.02 * resistance)
            }
        }
    }
}

/// Returns what a channel measures: the letter of a phase, or the link.
pub fn channel(k: usize) -> &'static str {
    ["a", "b", "c", "link"][k]
}

impl Parameter {
    /// Returns the parameter's name, which is that of its key in a data sheet if it has one.
    pub fn name(self) -> String {
        let of = if let Self::Offset(k) | Self::Gain(k) = self { channel(k) } else { "" };
        self.known().0.to_owned() + of
    }

    /// Returns the unit, and the factor from it to the fit's unit.
    pub fn unit(self) -> (&'static str, f64) {
        (self.known().1, if self == Self::Angle { PI / 180.0 } else { 1.0 })
    }

    /// Returns the index among the three falls; none for other parameters.
    pub fn fall(self) -> Option<usize> {
        [Self::SaturationAlong, Self::SaturationAgainst, Self::SaturationAcross]
            .iter()
            .position(|p| *p == self)
    }
}

/// Returns the index of the last channel.
pub fn last(channels: [bool; CHANNELS]) -> usize {
    channels.iter().rposition(|present| *present).unwrap_or(0)
}

/// Returns edges whose time matters: their possible shift in s changes the current by more than a share of the noise in A.
pub fn loose_edges(pieces: &[Piece], noise: f64, slope: f64) -> Vec<(usize, usize)> {
    let mut loose = Vec::new();
    for (number, piece) in pieces.iter().enumerate() {
        for (k, edge) in piece.edges.iter().enumerate() {
            if edge.deviation * slope > 0.02 * noise {
                loose.push((number, k));
            }
        }
    }
    loose
}
