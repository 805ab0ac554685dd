//! Effects of faults: on the case of a trial, on the nameplate (the data that the drive knows), and on the magnets.

use standstill_detect::{Nameplate, Signature};
use standstill_interface::Nanos;
use standstill_inverter::{Gate, Storage};
use standstill_numeric::whole;
use standstill_plant::Motor;
use standstill_sim::{Broken, Case, Fault, Misreading, Purpose, Short, Streams};

use super::{FaultMode, FaultPlace, FaultSettings};
use crate::document::FileError;

/// Applies the faults of a wrong data sheet (`sheet-signature`, `sheet-inductance`, `sheet-resistance`) to the
/// nameplate.
pub(crate) fn misinform(faults: &[FaultSettings], nameplate: &mut Nameplate<f64>) {
    for fault in faults {
        let [factor, _] = fault.size;
        match fault.mode {
            FaultMode::SheetSignature => {
                for signature in [&mut nameplate.signature, &mut nameplate.pulse_signature] {
                    *signature = match *signature {
                        Signature::Normal => Signature::Inverted,
                        Signature::Inverted => Signature::Normal,
                        Signature::None => Signature::None,
                    };
                }
            }
            FaultMode::SheetInductance => {
                nameplate.d_axis_inductance *= factor;
                nameplate.q_axis_inductance *= factor;
                nameplate.rated_pulse = Nanos::from_seconds(nameplate.rated_pulse.seconds() * factor);
            }
            FaultMode::SheetResistance => nameplate.resistance *= factor,
            _ => {}
        }
    }
}

/// Returns the motor with its magnets weakened by the faults of mode `magnet-weak`.
///
/// # Errors
/// The motor's core cannot describe the weakened magnets.
pub(crate) fn demagnetise(faults: &[FaultSettings], motor: Motor) -> Result<Motor, FileError> {
    let weak = faults.iter().enumerate().filter(|(_, fault)| fault.mode == FaultMode::MagnetWeak);
    weak.clone().try_fold(motor, |motor, (number, fault)| {
        let left = 1.0 - fault.size[0];
        motor.with_magnet(left).map_err(|why| {
            let needed = why.unwrap_or_else(|| "magnets that the motor's core describes".to_owned());
            let found = format!("{} % lost", fault.size[0] * 100.0);
            FileError::key(&format!("faults[{number}].magnitude"), &found, &needed)
        })
    })
}

/// A random draw of a fault, uniform from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultDraw {
    /// The faulty phase, leg or sensor.
    Place,
    /// The size, between the smallest and the largest size.
    Size,
    /// The sign of a fault, or the choice between two variants, such as a bit that is always set or always clear.
    Sign,
    /// The onset, between the earliest and the latest onset.
    Onset,
    /// The command from whose start the onset counts.
    Command,
    /// A further size. The fields are the index of this size in [`FaultMode::further`] and the key of this size.
    Further(usize, &'static str),
}

impl FaultDraw {
    /// Returns the name of the draw.
    pub fn name(self) -> &'static str {
        match self {
            Self::Place => "place",
            Self::Size => "size",
            Self::Sign => "sign",
            Self::Onset => "onset",
            Self::Command => "command",
            Self::Further(_, key) => key,
        }
    }
}

/// Drawn numbers of a fault. All except `command` are uniform from 0 to 1; `command` is the number of a command. A number that the fault
/// does not draw is zero or none.
#[derive(Clone, Copy, Default)]
struct Drawn {
    place: f64,
    size: f64,
    sign: f64,
    onset: f64,
    command: Option<u32>,
    further: [f64; 2],
}

impl FaultSettings {
    /// Iterates over the draws of the fault in a trial, in the order in which the trial's tape contains these draws. On the tape, the draws
    /// of the next fault follow.
    pub fn draws(&self) -> impl Iterator<Item = FaultDraw> + use<> {
        let further = self.mode.further().iter().enumerate();
        [FaultDraw::Place, FaultDraw::Size, FaultDraw::Sign, FaultDraw::Onset]
            .into_iter()
            .chain(self.command.map(|_| FaultDraw::Command))
            .chain(further.map(|(n, (key, _))| FaultDraw::Further(n, key)))
    }

    /// Adds the fault to a trial's case.
    fn apply(&self, case: &mut Case<'_>, drawn: Drawn) {
        let Drawn { place, size, sign, onset, command, further } = drawn;
        let between = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
        let size = between(self.size, size);
        let way = if sign < 0.5 { 1.0 } else { -1.0 };
        let places = self.mode.places(case.sensors.settings.arrangement);
        let k = match self.at {
            FaultPlace::A => 0,
            FaultPlace::B => 1,
            FaultPlace::C => 2,
            FaultPlace::Any => whole::<usize>(place * places as f64).min(places - 1),
        };
        let (m, n) = ((k + 1) % 3, (k + 2) % 3);
        let from = between(self.onset, onset);
        let until =
            if self.lasts.is_finite() { Nanos::from_seconds(from + self.lasts) } else { Nanos(u64::MAX) };
        let sensor = |how| Broken::Sensor(k, how);
        let (inverter, sensors) = (&mut case.inverter, &mut case.sensors);
        let broken = match self.mode {
            FaultMode::PhaseOpen => Broken::Wire(k),
            FaultMode::ContactResistance => Broken::Contact(k, size),
            FaultMode::TurnsShorted => {
                let [resistance, coupling] = [0, 1].map(|n: usize| between(self.further[n], further[n]));
                Broken::Shorted(k, Short { share: size, resistance, coupling })
            }
            FaultMode::TerminalsSwapped => {
                let mut wires = [0, 1, 2];
                wires.swap(m, n);
                Broken::Wires(wires)
            }
            FaultMode::TerminalsTurned => Broken::Wires(if way > 0.0 { [1, 2, 0] } else { [2, 0, 1] }),
            FaultMode::UpperSwitchOpen => Broken::Switch(k, Gate::High),
            FaultMode::LowerSwitchOpen => Broken::Switch(k, Gate::Low),
            FaultMode::LegOff => Broken::Switch(k, Gate::Off),
            FaultMode::CurrentDead => sensor(Misreading::Dead),
            FaultMode::CurrentFrozen => sensor(Misreading::Frozen),
            FaultMode::CurrentStuck => sensor(Misreading::Stuck(way * size)),
            FaultMode::CurrentBit => sensor(Misreading::Bit(whole(size.round()), way > 0.0)),
            FaultMode::CurrentGain => sensor(Misreading::Gain(size)),
            FaultMode::CurrentOffset => sensor(Misreading::Offset(way * size)),
            FaultMode::CurrentSign => sensor(Misreading::Gain(-1.0)),
            FaultMode::CurrentsSwapped => Broken::Exchanged(m, n),
            FaultMode::ReferenceDrift => Broken::Drift(way * size),
            FaultMode::LinkGain => Broken::Sensor(3, Misreading::Gain(size)),
            FaultMode::LinkStuck => Broken::Sensor(3, Misreading::Stuck(size)),
            FaultMode::ComparatorStuck => Broken::Deaf,
            FaultMode::CommandLate => Broken::Late(inverter.carrier_period),
            FaultMode::DutyLimited => Broken::Duty(size),
            FaultMode::SampleLost => Broken::Stale,
            // These change the scenario, in `misinform` and `demagnetise`.
            FaultMode::MagnetWeak
            | FaultMode::SheetSignature
            | FaultMode::SheetInductance
            | FaultMode::SheetResistance => return,
            FaultMode::DeadTimeLong => {
                for gates in &mut inverter.gates {
                    gates.dead_time = Nanos::from_seconds(gates.dead_time.seconds() * size);
                }
                return;
            }
            FaultMode::LinkCapacitorAged => {
                if let Some(storage) = &mut inverter.link.storage {
                    storage.capacitance *= size;
                }
                return;
            }
            FaultMode::SupplyWeak => {
                inverter.link.storage =
                    inverter.link.storage.map(|storage| Storage { source_resistance: size, ..storage });
                return;
            }
            FaultMode::SupplyLimited => {
                inverter.link.most_current = Some(size);
                return;
            }
            FaultMode::CurrentSlow => {
                sensors.corner[k] *= size;
                return;
            }
            FaultMode::SampleLate => {
                sensors.settings.sample_delay = sensors.settings.sample_delay + Nanos::from_seconds(size);
                return;
            }
            FaultMode::TimerOff => {
                sensors.comparator.tick /= 1.0 - size;
                return;
            }
        };
        // `settings` limits the faults of a scenario to the number that a case can hold.
        case.faults.push(Fault { broken, command, from: Nanos::from_seconds(from), until });
    }
}

/// Adds all faults to the case of a trial.
pub(crate) fn apply(faults: &[FaultSettings], case: &mut Case<'_>, streams: Streams) {
    if faults.is_empty() {
        return;
    }
    let mut draws = streams.open(Purpose::Fault);
    for fault in faults {
        let mut drawn = Drawn::default();
        for draw in fault.draws() {
            let share = draws.uniform();
            match draw {
                FaultDraw::Place => drawn.place = share,
                FaultDraw::Size => drawn.size = share,
                FaultDraw::Sign => drawn.sign = share,
                FaultDraw::Onset => drawn.onset = share,
                FaultDraw::Command => {
                    drawn.command = fault.command.map(|[first, last]| {
                        let count = f64::from(last - first + 1);
                        (first + whole::<u32>(share * count)).min(last)
                    });
                }
                FaultDraw::Further(n, _) => drawn.further[n] = share,
            }
        }
        fault.apply(case, drawn);
    }
}
