use super::*;
use crate::ledger::Ledger;

/// Capacitance of a terminal in F.
const TERMINAL: f64 = 2e-9;
/// Capacitance of the link in F.
const LINK: f64 = 40e-9;

/// Largest relative difference between two sums of charges or energies.
const ROUNDING: f64 = 1e-14;

fn before(potential: [f64; 3], link: f64) -> Joined {
    Joined { potential, link, share: TERMINAL / LINK }
}

/// Returns the energy in J that the capacitors of `link` in V and of these terminals in V store.
fn stored(potential: [f64; 3], link: f64) -> f64 {
    LINK * link * link / 2.0 + potential.map(|of| TERMINAL * of * of / 2.0).iter().sum::<f64>()
}

/// A capacitor C_t at the voltage `from` is connected to one with C_l at U: both end at (C_l U + C_t from) / (C_l + C_t). The switch
/// between them loses ½ q (U − from), with the charge q = C_t (U − from) / (1 + C_t/C_l).
#[test]
fn analytic_a_terminal_and_the_links_capacitor_share_their_charge() {
    let (from, link) = (13.0, 60.0);
    let before = before([from, 0.0, 7.0], link);
    let after = before.settle(|leg, link| [(link, true), (0.0, false), (7.0, false)][leg]);
    let common = (LINK * link + TERMINAL * from) / (LINK + TERMINAL);
    assert!((after.link - common).abs() < ROUNDING * link, "{after:?}");
    assert_eq!(after.potential, [after.link, 0.0, 7.0]);
    let charge = TERMINAL * (link - from) / (1.0 + TERMINAL / LINK);
    assert!((LINK * (link - after.link) - charge).abs() < ROUNDING * LINK * link);
    let mut ledger = Ledger::default();
    ledger.join(&before, &after, TERMINAL);
    let heat = charge * (link - from) / 2.0;
    assert!((ledger.device_loss - heat).abs() < 1e-12 * heat, "{ledger:?}, {heat:e} J");
    assert_eq!(ledger.source, 0.0);
}

/// The potentials of all legs at the upper rail fall with the link, also of those that were there before. A floating terminal is connected,
/// too, if the falling bound of its diode reaches it. C_l U + C_t Σ u of these legs is constant; the lost energy is heat.
#[test]
fn law_charge_and_energy_of_all_terminals_at_the_upper_rail() {
    let (link, drop) = (60.0, 0.7);
    for from in [
        // One leg that is newly at the rail, one that was there before, and one far from its bounds.
        [5.0, link, 30.0],
        // The third leg floats just below its bound: the bound falls with the link and reaches it.
        [5.0, link, link + drop - 0.5],
        [0.0, 0.0, link + drop],
        // The third leg floats above its bound.
        [link, link, link + drop + 3.0],
    ] {
        let before = before(from, link);
        let after = before.settle(|leg, link| {
            let bound = link + drop;
            if leg < 2 { (link, true) } else { (from[2].min(bound), from[2] >= bound) }
        });
        assert_eq!(after.potential[..2], [after.link; 2]);
        assert_eq!(after.potential[2], from[2].min(after.link + drop), "{from:?}");
        let (taken, given) = (
            (0..3).map(|k| TERMINAL * (after.potential[k] - from[k])).sum::<f64>(),
            LINK * (link - after.link),
        );
        assert!((taken - given).abs() < ROUNDING * LINK * link, "{from:?}: {taken:e} of {given:e} A·s");
        let mut ledger = Ledger::default();
        ledger.join(&before, &after, TERMINAL);
        let heat = stored(from, link) - stored(after.potential, after.link);
        assert!(heat > 0.0, "{from:?}");
        let off = ledger.device_loss - heat;
        assert!(off.abs() < ROUNDING * stored(from, link), "{from:?}: {off:e} of {heat:e} J");
    }
}

/// A stiff link keeps its voltage: the source gives C_t U (U − from); half of this is heat if the terminal was at 0 V.
#[test]
fn analytic_a_stiff_link_charges_a_terminal_at_a_loss_of_half_c_u_squared() {
    let before = Joined { potential: [0.0; 3], link: 60.0, share: 0.0 };
    let after = before.settle(|leg, link| if leg == 0 { (link, true) } else { (0.0, false) });
    assert_eq!((after.link, after.potential), (60.0, [60.0, 0.0, 0.0]));
    let mut ledger = Ledger::default();
    ledger.join(&before, &after, TERMINAL);
    assert_eq!(ledger.source, TERMINAL * 60.0 * 60.0);
    assert_eq!(ledger.device_loss, ledger.source / 2.0);
}

/// If all terminals already have the potentials of their devices, no potential changes, to the last bit.
#[test]
fn law_terminals_at_their_rails_leave_the_link_alone() {
    let before = before([59.3, 0.7, 59.3], 60.0 + 1e-14);
    let at = [before.potential[0], 0.7, before.potential[2]];
    let after = before.settle(|leg, _| (at[leg], leg != 1));
    assert_eq!((after.link, after.potential), (before.link, before.potential));
}
