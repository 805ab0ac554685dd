//! Effects outside of the simulation. This is the only list; the manual's page repeats it.

/// Effects that the simulation does not model, so that no verdict covers them.
pub const NOT_MODELLED: [&str; 10] = [
    "switches that are shorted or stuck on, a missing dead time, an open body diode: what shorts the link or leaves a current without a path",
    "shorts between phases, shorts to the frame, turns shorted in one coil or pole pair alone, single weak pole pairs, parallel \
     branches of a winding",
    "the arc of a wire that opens: its current ends at once",
    "travelling waves on cables, which are a capacitance at each terminal",
    "heat: temperatures stay as they are during a start, and no pulse demagnetises a magnet",
    "slots beyond the harmonics of inductances (4θ) and magnet flux (5th, 7th) that the data sheet has; end effects; the depth to which \
     eddy currents reach, which are one branch for each axis",
    "shafts and gears that twist: the rotor is one inertia with friction, load, cogging and the play of a brake",
    "disturbances from outside of the drive, and what parts of it do to each other beyond the keys of the scenario",
    "faults of the processor: memory, clock tree, program flow; a program that is built for another processor than the one that ran here",
    "anything after the angle is named: the start itself, sensors of position, brakes, the driven machine",
];

#[cfg(test)]
mod tests {
    #[test]
    fn law_the_manual_has_the_same_list() {
        let page = include_str!("../../../../docs/qualification.md");
        let (_, list) = page.split_once("## What is not modelled\n").expect("a section");
        let listed: Vec<&str> = list.lines().filter_map(|line| line.strip_prefix("* ")).collect();
        assert_eq!(listed, super::NOT_MODELLED);
    }
}
