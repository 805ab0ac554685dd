//! The keys of the rotor.

use standstill_quantity::Quantity;
use standstill_quantity::unit::{
    Celsius, Degree, NewtonMetre, RevolutionsPerMinute, RevolutionsPerMinuteSecond,
};
use standstill_sim::{Purpose, RotorState};

use super::{LARGEST, Range, TEMPERATURE, number, table};
use crate::named::Named;
use crate::rotor::{Memory, Rotor};

table! {
    /// The rotor: its motion, load and temperatures.
    pub struct RotorTable = "rotor" of scenario {
        /// Motion of the rotor: held, free, or free within the play of a brake.
        state: Named<Rotor> {
            get: |scenario| Some(match scenario.rotor {
                RotorState::Locked => Rotor::Locked,
                RotorState::Free => Rotor::Free,
                RotorState::Braked(_) => Rotor::Brake,
                RotorState::Driven => Rotor::Driven,
            }.name().into()),
            draws: Some((Purpose::Backlash, 0..1)),
            drawn: |scenario| matches!(scenario.rotor, RotorState::Braked(_)),
        };
        /// Electrical angle at the start, the same in all trials. Without it, each trial draws its angle from a uniform distribution.
        angle: Quantity<Degree> {
            range: Some(Range::new(-360.0, 360.0, "from -360 deg to 360 deg, electrical", "more than a turn is a mistake")),
            get: |scenario| scenario.start_angle.map(|angle| number(angle.to_degrees())),
            example: "\"43.2 deg\"",
        };
        /// Torque that a load exerts against forward motion, also at standstill.
        load: Quantity<NewtonMetre> [scenario.load_torque] {
            range: Some(Range::new(-LARGEST, LARGEST, "a torque, of either sign", "a load pulls either way")),
            applies: |scenario| scenario.rotor != RotorState::Locked,
            example: "\"2 N m\"",
        };
        /// Speed of the shaft at the start, negative if backwards, of a rotor that coasts ("free") or is "driven".
        speed: Quantity<RevolutionsPerMinute> [scenario.start_speed] {
            range: Some(Range::new(-1e5, 1e5, "from -100000 rpm to 100000 rpm", "the fastest machines have as much")),
            applies: |scenario| matches!(scenario.rotor, RotorState::Free | RotorState::Driven),
            example: "\"10 rpm\"",
        };
        /// Constant acceleration of the shaft of a rotor that is "driven"; `speed` is its speed at the start.
        acceleration: Quantity<RevolutionsPerMinuteSecond> [scenario.acceleration] {
            range: Some(Range::new(-1e7, 1e7, "from -10000000 rpm/s to 10000000 rpm/s", "a rotor of a gram's weight has as much at rated torque")),
            applies: |scenario| scenario.rotor == RotorState::Driven,
            example: "\"60 rpm/s\"",
        };
        /// Magnetisation of the stator's iron at the start, of a motor whose data sheet has a `[hysteresis]`.
        memory: Named<Memory> {
            get: |scenario| scenario.motor.magnetics.hysteresis().map(|_| {
                (if scenario.memory { Memory::Former } else { Memory::Virgin }).name().into()
            }),
            draws: Some((Purpose::Memory, 0..2)),
            drawn: |scenario| scenario.memory,
            example: "\"former\"",
        };
        /// Temperature of the winding. The drive does not know it.
        winding_temperature: Quantity<Celsius> { range: Some(TEMPERATURE), example: "\"90 °C\"" };
        /// Temperature of the magnets. The drive does not know it.
        magnet_temperature: Quantity<Celsius> { range: Some(TEMPERATURE), example: "\"80 °C\"" };
    }
}

impl RotorTable {
    /// Returns the motion of the rotor: held, free, braked or driven; held if `rotor.state` is not set.
    pub fn state(&self) -> Rotor {
        self.state.unwrap_or_default().0
    }
}
