//! One machine that carries out the commands of its caller, one after the other.

use standstill_interface::{Abc, Command, Nanos, Reading, Sampling, Stage};
use standstill_inverter::DcLink;

use super::bank::{Bank, Served};
use super::is_followed;
use crate::case::{Case, Finished, RunError};
use crate::control::{Control, Room, Want};
use crate::physics::plane::Plane;
use crate::sensing::{SensorSettings, Sensors};
use crate::trace::{Probe, Snapshot};

/// A machine, initially at rest, that carries out the commands of its caller. It serves programs without a detector, such as a
/// co-simulation. A copy continues independently of the original: after the same commands, the results of both are bit by bit the same.
///
/// ```
/// use standstill_interface::{Command, Nanos, Phase, Sampling, Stage};
/// use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter};
/// use standstill_sim::{Case, Driven};
///
/// let motor = standstill_plant::built_in("paper-5k5").expect("a built-in motor");
/// let inverter = Inverter {
///     bridge: Bridge::default(),
///     gates: [GateTiming::default(); 3],
///     link: DcLink::stiff(550.0),
///     carrier_period: Nanos::ZERO,
/// };
/// let mut drive = Driven::new(&Case::new(&motor, inverter));
/// let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(50));
/// let readings = drive.carry_out(&Command::hold(pulse, Sampling::once(Nanos::from_micros(50))))?;
/// let sampled = readings[0].current[Phase::A];
/// // An exact sensor at the end of the command reads what is there.
/// assert!(sampled > 0.5 && sampled == drive.now().current[0]);
/// # Ok::<(), standstill_sim::RunError>(())
/// ```
pub struct Driven<'a> {
    bank: Bank<'a, f64>,
    control: Control<'a>,
}

impl std::fmt::Debug for Driven<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Driven").field("time", &self.bank.here.time).finish_non_exhaustive()
    }
}

impl Clone for Driven<'_> {
    fn clone(&self) -> Self {
        Self { bank: self.bank.clone(), control: self.control.unwatched() }
    }
}

impl<'a> Driven<'a> {
    /// Makes a drive at rest with all switches off.
    pub fn new(case: &Case<'a>) -> Self {
        Self::watched(case, None, false, false)
    }

    /// Makes a motor at rest without an inverter. [`Driven::feed`] sets the potentials of its terminals. The case's inverter and sensors
    /// have no effect: there is no ripple of the link, no terminal capacitance and no filter.
    pub fn motor(case: &Case<'a>) -> Self {
        let mut alone = case.clone();
        alone.inverter.link = DcLink::stiff(case.inverter.link.voltage);
        alone.inverter.bridge.terminal_capacitance = 0.0;
        alone.sensors = Sensors::nominal(SensorSettings::IDEAL);
        let mut motor = Self::new(&alone);
        motor.bank.machine.legs.fed = Some(Plane::new(0.0, 0.0));
        motor
    }

    /// Makes a drive at rest with an observer. `ledger` says whether energies are integrated. `refereed` says whether the referee takes
    /// the steps.
    pub(super) fn watched(
        case: &Case<'a>,
        probe: Option<&'a mut dyn Probe>,
        ledger: bool,
        refereed: bool,
    ) -> Self {
        let probe = probe.filter(|probe| probe.watches());
        let resolution = probe.as_ref().and_then(|probe| probe.resolution());
        let follow = resolution.is_some() || ledger || is_followed(case);
        let mut bank = Bank::of(case, follow);
        bank.control.refereed = refereed;
        let control = Control::new(case.clone(), &mut bank, 0, probe, ledger, Room::default());
        Self { bank, control }
    }

    /// Carries out a command to its end and returns the readings taken during the command.
    ///
    /// # Errors
    /// The command is invalid, or the machine cannot continue. After an error the machine stays at the time of the error.
    pub fn carry_out(&mut self, command: &Command<f64>) -> Result<&[Reading<f64>], RunError> {
        let Self { bank, control } = self;
        let mut want = control.command(bank, command);
        loop {
            match want {
                Want::Command => return Ok(control.read::<f64>()),
                Want::Over(error) => {
                    control.read::<f64>();
                    return Err(error);
                }
                Want::Step => {}
            }
            bank.step();
            let Served { accepted, arrived, out_of_bounds, broken, carried_out, .. } = bank.outcome.served;
            if bank.control.follow && accepted != 0 {
                let thirds = [bank.within(1.0 / 3.0), bank.within(2.0 / 3.0)];
                control.follow(bank, &thirds);
            }
            if accepted != 0 {
                control.sample_within(bank);
            }
            if broken != 0 {
                want = control.recover(bank);
                continue;
            }
            if arrived | out_of_bounds != 0 {
                want = control.resume(bank, out_of_bounds != 0);
                continue;
            }
            // A run that arrived at an instant has already set the legs' next requests.
            for (k, carried_out) in carried_out.into_iter().enumerate() {
                if carried_out != 0 {
                    control.carry_out(bank, k);
                }
            }
        }
    }

    /// Holds the terminals of a [`Driven::motor`] at these potentials in V for a duration. A voltage added to all three potentials has no
    /// effect, because the winding's neutral is not connected.
    ///
    /// # Errors
    /// The errors of [`Driven::carry_out`], or [`RunError::NotFinite`] if a potential is not a finite number.
    pub fn feed(&mut self, potential: [f64; 3], duration: Nanos) -> Result<(), RunError> {
        if !potential.iter().all(|potential| potential.is_finite()) {
            return Err(RunError::NotFinite(self.bank.place(0)));
        }
        let machine = &mut self.bank.machine;
        machine.legs.fed = Some(Plane::from_stator(Abc(potential).clarke(), machine.start));
        self.carry_out(&Command::hold(Stage::off(duration), Sampling::NONE)).map(|_| ())
    }

    /// Returns the readings taken during the last command.
    pub fn readings(&self) -> &[Reading<f64>] {
        self.control.readings()
    }

    /// Returns the true present state of the machine, without the errors of its sensors.
    pub fn now(&self) -> Snapshot {
        self.control.now(&self.bank)
    }

    /// Notes the present position of the rotor.
    pub(super) fn note(&mut self) {
        self.control.note(&self.bank);
    }

    /// Ends the run and returns its result.
    pub(super) fn finish(mut self, error: Option<RunError>) -> Finished {
        self.control.finish(&mut self.bank, error)
    }
}
