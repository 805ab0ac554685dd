//! Switches and diodes.

use std::fmt;

use crate::Gate;

/// Forward characteristics of a leg's devices: a threshold and a slope each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Devices {
    /// V_ce0 in V: a conducting switch's drop at no current.
    pub switch_drop: f64,
    /// Its slope in Ω.
    pub switch_resistance: f64,
    /// V_f in V: a conducting diode's drop at no current.
    pub diode_drop: f64,
    /// Its slope in Ω.
    pub diode_resistance: f64,
}

/// Which device of a leg conducts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Conduction {
    /// Current from the positive rail into the motor.
    UpperSwitch,
    /// Current from the motor into the positive rail.
    UpperDiode,
    /// Current from the motor into the negative rail.
    LowerSwitch,
    /// Current from the negative rail into the motor.
    LowerDiode,
    /// No current.
    Blocked,
}

impl Conduction {
    /// All modes.
    pub const ALL: [Self; 5] =
        [Self::UpperSwitch, Self::UpperDiode, Self::LowerSwitch, Self::LowerDiode, Self::Blocked];

    /// The mode when current flows out of the leg into the motor.
    pub const fn outflow(gate: Gate) -> Self {
        match gate {
            Gate::High => Self::UpperSwitch,
            Gate::Off | Gate::Low => Self::LowerDiode,
        }
    }

    /// The mode when current flows out of the motor into the leg.
    pub const fn inflow(gate: Gate) -> Self {
        match gate {
            Gate::Low => Self::LowerSwitch,
            Gate::Off | Gate::High => Self::UpperDiode,
        }
    }

    /// +1 for current into the motor, −1 for current out of it, 0 for none.
    pub const fn direction(self) -> f64 {
        match self {
            Self::UpperSwitch | Self::LowerDiode => 1.0,
            Self::UpperDiode | Self::LowerSwitch => -1.0,
            Self::Blocked => 0.0,
        }
    }

    /// Whether the current flows through the lower device, where a low-side shunt sees it.
    pub const fn is_lower(self) -> bool {
        matches!(self, Self::LowerSwitch | Self::LowerDiode)
    }

    /// Whether the current flows through the upper device, from or into the positive rail.
    pub const fn is_upper(self) -> bool {
        matches!(self, Self::UpperSwitch | Self::UpperDiode)
    }
}

impl fmt::Display for Conduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::UpperSwitch => "upper_switch",
            Self::UpperDiode => "upper_diode",
            Self::LowerSwitch => "lower_switch",
            Self::LowerDiode => "lower_diode",
            Self::Blocked => "blocked",
        })
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
    /// Potential in V against the negative rail, with `current` in A into the motor.
    #[inline]
    pub fn potential(self, dc_link: f64, current: f64) -> f64 {
        self.rail * dc_link + self.offset - self.resistance * current
    }
}

impl Devices {
    /// The clamp of a conducting device; `None` for a blocked leg.
    #[inline]
    pub fn clamp(&self, mode: Conduction) -> Option<Clamp> {
        let (rail, offset, resistance) = match mode {
            Conduction::UpperSwitch => (1.0, -self.switch_drop, self.switch_resistance),
            Conduction::UpperDiode => (1.0, self.diode_drop, self.diode_resistance),
            Conduction::LowerSwitch => (0.0, self.switch_drop, self.switch_resistance),
            Conduction::LowerDiode => (0.0, -self.diode_drop, self.diode_resistance),
            Conduction::Blocked => return None,
        };
        Some(Clamp { rail, offset, resistance })
    }
}
