//! Changes of a nameplate's number, and of the numbers that follow from it in the tables made from the nameplate.

use standstill_files::sheet::Sourced;
use standstill_quantity::{Quantity, Unit};

use super::super::DataSheet;
use super::whole::{Strength, winding};

/// A number of a `[nameplate]` that may differ from motor to motor of a kind. Rated current and DC link are not among them: the drive
/// is chosen by these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameplateNumber {
    /// `resistance`, in Ω.
    Resistance,
    /// `L_d`, in H.
    DAxisInductance,
    /// `L_q`, in H.
    QAxisInductance,
    /// `magnet_flux`, in Wb.
    MagnetFlux,
    /// `leakage`, in H.
    Leakage,
}

fn put<U: Unit>(number: &mut Sourced<U>, value: f64) {
    number.value = Quantity::si(value);
}

impl DataSheet {
    /// Replaces a number of the `[nameplate]`, in SI. The sheet then equals the one read from a file with this number,
    /// including winding and assumed inertia and friction. Without a nameplate, returns none and changes nothing.
    ///
    /// ```
    /// use standstill_plant::{DataSheet, NameplateNumber};
    ///
    /// let text = DataSheet::built_in_text("outrunner").ok_or("not built in")?;
    /// let mut sheet = DataSheet::parse("outrunner", text)?;
    /// sheet.set_nameplate(NameplateNumber::DAxisInductance, 13e-6).ok_or("no nameplate")?;
    /// let other = DataSheet::parse("outrunner", &text.replace("13.5 µH", "13 µH"))?;
    /// assert_eq!(sheet.motor()?, other.motor()?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_nameplate(&mut self, number: NameplateNumber, value: f64) -> Option<()> {
        let is_assumed = |key: &str| self.assumed.iter().any(|entry| entry.key == key);
        let [inertia, stiction, coulomb] =
            ["rotor.inertia", "rotor.stiction", "rotor.coulomb"].map(is_assumed);
        let sheet = &mut self.tables;
        let plate = sheet.nameplate.as_mut()?;
        let own = &mut sheet.winding;
        match number {
            NameplateNumber::Resistance => {
                put(&mut plate.resistance, value);
                put(&mut own.resistance, value);
            }
            NameplateNumber::DAxisInductance => put(&mut plate.d_axis_inductance, value),
            NameplateNumber::QAxisInductance => put(&mut plate.q_axis_inductance, value),
            NameplateNumber::MagnetFlux => {
                put(&mut plate.magnet_flux, value);
                put(own.magnet_flux.as_mut()?, value);
            }
            NameplateNumber::Leakage => {
                put(plate.leakage.as_mut()?, value);
                put(own.leakage.as_mut()?, value);
            }
        }
        let inductance = [plate.d_axis_inductance.number(), plate.q_axis_inductance.number()];
        let [mean, saliency] = winding(inductance, own.leakage.as_ref()?.number());
        put(own.mean_inductance.as_mut()?, mean);
        put(own.saliency.as_mut()?, saliency);
        if !(inertia || stiction || coulomb) {
            return Some(());
        }
        let strength = Strength {
            inductance,
            magnet_flux: plate.magnet_flux.number(),
            rated_current: plate.rated_current.number(),
            dc_link: plate.dc_link.number(),
            pole_pairs: plate.pole_pairs.number(),
        };
        let [assumed_inertia, friction] = strength.inertia_and_friction();
        let rotor = &mut sheet.rotor;
        if inertia {
            put(&mut rotor.inertia, assumed_inertia);
        }
        // Where one of the two is given, the other is it.
        if stiction && coulomb {
            put(&mut rotor.stiction, friction);
            put(&mut rotor.coulomb, friction);
        }
        Some(())
    }
}
