//! Switches and diodes.

use std::fmt;

use standstill_interface::choice;

use crate::Gate;

choice! {
    /// Type of the switches.
    #[derive(Default)]
    pub enum DeviceKind {
        /// IGBTs: a threshold and a slope one way; current the other way flows through the diode beside it, whatever the
        /// gate does.
        Igbt = "igbt" default,
        /// MOSFETs: while the gate is on, the channel is a resistance both ways, without threshold. Current against a switch
        /// whose gate is off flows through the body diode. Where the channel drops more than the diode's threshold, the
        /// diode beside it would carry a share; that is not modelled.
        Mosfet = "mosfet",
    }
}

impl DeviceKind {
    /// Returns the mode when current flows out of the leg into the motor.
    ///
    /// ```
    /// use standstill_inverter::{Conduction, DeviceKind, Gate};
    ///
    /// // Current into the motor while the lower gate is on: through an IGBT's diode, or backwards through a MOSFET's channel.
    /// assert_eq!(DeviceKind::Igbt.outflow(Gate::Low), Conduction::LowerDiode);
    /// assert_eq!(DeviceKind::Mosfet.outflow(Gate::Low), Conduction::LowerReverse);
    /// // With all gates off both have their diode alone.
    /// assert_eq!(DeviceKind::Mosfet.outflow(Gate::Off), Conduction::LowerDiode);
    /// ```
    pub const fn outflow(self, gate: Gate) -> Conduction {
        match (gate, self) {
            (Gate::High, _) => Conduction::UpperSwitch,
            (Gate::Low, Self::Mosfet) => Conduction::LowerReverse,
            (Gate::Off | Gate::Low, _) => Conduction::LowerDiode,
        }
    }

    /// Returns the mode when current flows out of the motor into the leg.
    pub const fn inflow(self, gate: Gate) -> Conduction {
        match (gate, self) {
            (Gate::Low, _) => Conduction::LowerSwitch,
            (Gate::High, Self::Mosfet) => Conduction::UpperReverse,
            (Gate::Off | Gate::High, _) => Conduction::UpperDiode,
        }
    }
}

/// Forward characteristics of a leg's devices: a threshold and a slope each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Devices {
    /// Kind of the switches.
    pub kind: DeviceKind,
    /// V_ce0 in V: a conducting switch's drop at no current. A MOSFET's is zero.
    pub switch_drop: f64,
    /// Slope of the switch's characteristic in Ω; for a MOSFET, the channel's resistance.
    pub switch_resistance: f64,
    /// V_f in V: a conducting diode's drop at no current.
    pub diode_drop: f64,
    /// Slope of the diode's characteristic in Ω.
    pub diode_resistance: f64,
}

choice! {
    /// Which device of a leg conducts.
    #[derive(Hash)]
    pub enum Conduction {
        /// Current from the positive rail into the motor.
        UpperSwitch = "upper_switch",
        /// Current from the motor into the positive rail.
        UpperDiode = "upper_diode",
        /// Current from the motor into the negative rail.
        LowerSwitch = "lower_switch",
        /// Current from the negative rail into the motor.
        LowerDiode = "lower_diode",
        /// Current from the motor into the positive rail, backwards through the channel of the upper MOSFET.
        UpperReverse = "upper_reverse",
        /// Current from the negative rail into the motor, backwards through the channel of the lower MOSFET.
        LowerReverse = "lower_reverse",
        /// No current.
        Blocked = "blocked",
    }
}

impl Conduction {
    /// Returns the direction of the current: +1 into the motor, −1 out of it, 0 for none.
    ///
    /// ```
    /// use standstill_inverter::Conduction;
    ///
    /// assert_eq!(Conduction::LowerDiode.direction(), 1.0);
    /// assert!(Conduction::LowerDiode.is_lower());
    /// assert_eq!(Conduction::Blocked.direction(), 0.0);
    /// ```
    pub const fn direction(self) -> f64 {
        match self {
            Self::UpperSwitch | Self::LowerDiode | Self::LowerReverse => 1.0,
            Self::UpperDiode | Self::LowerSwitch | Self::UpperReverse => -1.0,
            Self::Blocked => 0.0,
        }
    }

    /// Returns whether the current flows through the lower device, where a low-side shunt sees it.
    pub const fn is_lower(self) -> bool {
        matches!(self, Self::LowerSwitch | Self::LowerDiode | Self::LowerReverse)
    }

    /// Returns whether the current flows through the upper device, from or into the positive rail.
    pub const fn is_upper(self) -> bool {
        matches!(self, Self::UpperSwitch | Self::UpperDiode | Self::UpperReverse)
    }
}

impl fmt::Display for Conduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A conducting device as its terminal sees it: `u = rail · U_dc + offset − resistance · i`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamp {
    /// 1 at the positive rail, 0 at the negative.
    pub rail: f64,
    /// In V.
    pub offset: f64,
    /// In Ω.
    pub resistance: f64,
}

impl Clamp {
    /// Returns the potential in V against the negative rail, with `current` in A into the motor.
    #[inline]
    pub fn potential(self, dc_link: f64, current: f64) -> f64 {
        self.rail * dc_link + self.offset - self.resistance * current
    }
}

impl Devices {
    /// Returns threshold in V and slope in Ω of the device that carries a leg's current against its switch while that
    /// switch is on.
    pub const fn reverse(&self) -> [f64; 2] {
        match self.kind {
            DeviceKind::Igbt => [self.diode_drop, self.diode_resistance],
            DeviceKind::Mosfet => [self.switch_drop, self.switch_resistance],
        }
    }

    /// Returns the clamp of a conducting device; `None` for a blocked leg.
    ///
    /// ```
    /// use standstill_inverter::{Conduction, Devices};
    ///
    /// let devices = Devices { switch_drop: 0.9, switch_resistance: 0.02, ..Devices::default() };
    /// let clamp = devices.clamp(Conduction::UpperSwitch).ok_or("a blocked leg has none")?;
    /// // The link of 550 V less the threshold and what 10 A drop across the slope.
    /// assert!((clamp.potential(550.0, 10.0) - (550.0 - 0.9 - 0.2)).abs() < 1e-9);
    /// assert_eq!(devices.clamp(Conduction::Blocked), None);
    /// # Ok::<(), &str>(())
    /// ```
    #[inline]
    pub fn clamp(&self, mode: Conduction) -> Option<Clamp> {
        let (rail, offset, resistance) = match mode {
            Conduction::UpperSwitch => (1.0, -self.switch_drop, self.switch_resistance),
            Conduction::UpperDiode => (1.0, self.diode_drop, self.diode_resistance),
            Conduction::LowerSwitch => (0.0, self.switch_drop, self.switch_resistance),
            Conduction::LowerDiode => (0.0, -self.diode_drop, self.diode_resistance),
            Conduction::UpperReverse => (1.0, self.switch_drop, self.switch_resistance),
            Conduction::LowerReverse => (0.0, -self.switch_drop, self.switch_resistance),
            Conduction::Blocked => return None,
        };
        Some(Clamp { rail, offset, resistance })
    }
}
