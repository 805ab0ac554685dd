//! The legs of several inverters side by side: the voltages and resistances that they connect to the windings.

#[cfg(test)]
mod tests;

use standstill_inverter::{AXES, Bridge, Conduction, DeviceKind, Devices, Modes, OpenLeg};
use standstill_numeric::{Heading, Lane, MOST_LANES, Mask, Symmetric, Wide};

use super::gates::{LegGates, On};
use super::plane::Plane;
use super::terminals::of_legs;

/// The legs of the inverters, with their devices, their gates and the directions of their currents.
#[derive(Clone, Debug, Default)]
pub struct Legs<V: Wide> {
    /// For each leg, the magnetic axis of the phase that it feeds, as a vector in the run's plane.
    pub axes: [Plane<V>; 3],
    /// Voltage drop in V and resistance in Ω of a switch.
    switch: [V; 2],
    /// Voltage drop in V and resistance in Ω of a diode.
    diode: [V; 2],
    /// Voltage drop in V and resistance in Ω of a leg with a switch on that carries a current in this switch's reverse direction.
    reverse: [V; 2],
    /// Bit mask of the machines whose switches are MOSFETs.
    mosfets: u32,
    /// Voltage in V by which the potential of a leg may exceed the rails while both its switches are off. Infinite for a leg with an open
    /// wire.
    beyond: [V; 3],
    /// Resistance in Ω of each wire's contacts, in series with its phase.
    contact: [V; 3],
    /// Phase that each leg of each machine feeds.
    wires: [[usize; 3]; MOST_LANES],
    /// Inverse capacitance of each terminal in 1/F; none if the terminals have no capacitance. With a capacitance, the current of a leg
    /// without a conducting device charges its terminal, so that no leg is blocked.
    pub elastance: Option<V>,
    /// Rate 1/(R C) in 1/s at which the dividers discharge the terminals. None if the terminals have no capacitance or the dividers draw
    /// no current.
    pub leak: Option<V>,
    /// Resistance in Ω in series with each leg without a conducting device. It damps the ringing of the terminal's capacitance with the
    /// winding. A resistance in the leg makes no voltage jump when a device begins or ceases to conduct, because the leg's current is
    /// zero then. A resistance of the whole winding would make a jump, after which neither mode could last.
    ringing: V,
    /// Gates of each leg.
    pub gates: [LegGates<V>; 3],
    /// For each leg, a bit for each machine whose current flows out of the leg, into the motor.
    pub out: [u32; 3],
    /// For each leg, a bit for each machine whose current flows into the leg, out of the motor. A leg with neither of the two bits is
    /// blocked.
    pub into: [u32; 3],
    /// Voltage vector in V of the terminals, if an external source holds them. The legs then have no effect.
    pub fed: Option<Plane<V>>,
}

/// Coefficients of the terminal voltage of a conducting leg, `u = rail · U_dc + offset − resistance · i`. For a leg without current, all
/// coefficients are zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Leg<V> {
    /// Coefficient of the link's voltage: 1 at the positive rail, 0 at the negative rail.
    pub rail: V,
    /// Constant part of the voltage in V.
    pub offset: V,
    /// Resistance in Ω.
    pub resistance: V,
    /// Direction of the current: +1 into the motor, −1 out of it, 0 for none.
    pub direction: V,
}

/// The legs at one time. The struct states which legs carry current, and describes each of them as a voltage source with a resistance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conducting<V: Wide> {
    /// Coefficients of each leg's terminal voltage.
    pub leg: [Leg<V>; 3],
    /// Lanes where each leg carries current.
    pub flows: [V::Mask; 3],
    /// Lanes where no leg carries current.
    pub idle: V::Mask,
    /// Switches that are on in each leg.
    pub on: [On<V::Mask>; 3],
    /// The voltage vector and the resistance matrix of the three legs together, including the winding's resistance.
    pub terminals: Terminals<V>,
}

/// The three legs and the winding's resistance as one voltage source with an internal resistance. The voltage is a vector, the resistance
/// a matrix. The winding's neutral is not connected.
#[derive(Clone, Copy, Debug, Default)]
pub struct Terminals<T> {
    /// Part of the terminals' voltage vector that is proportional to the link's voltage, in V per V.
    pub rail: Plane<T>,
    /// Constant part of the terminals' voltage vector in V.
    pub offset: Plane<T>,
    /// Resistance of devices, contacts and winding in Ω, as a matrix in the run's plane.
    pub resistance: Symmetric<T>,
    /// Magnetic axis of the leg that is blocked while the other two legs conduct. Zero if there is no such leg.
    pub blocked: Plane<T>,
    /// 0 if one leg is blocked while the other two conduct, else 1.
    pub none_blocked: T,
}

/// Lower and upper limit of the potential of a blocked leg. Each limit is a share of the link's voltage plus a constant in V.
#[derive(Clone, Copy, Debug)]
pub struct Range<V> {
    low: [V; 2],
    high: [V; 2],
}

impl<V: Lane> Range<V> {
    /// Returns the limits in V for a link voltage in V.
    #[inline(always)]
    pub fn at(&self, link: V) -> [V; 2] {
        [self.low[0] * link + self.low[1], self.high[0] * link + self.high[1]]
    }

    /// Returns the changes of the limits in V for a change of the link's voltage by `link` in V.
    #[inline(always)]
    pub fn rise(&self, link: V) -> [V; 2] {
        [self.low[0] * link, self.high[0] * link]
    }
}

impl<V: Wide> Legs<V> {
    /// Makes legs that are all blocked and off, for rotors at angle zero. `capacitive` says whether the terminals have a capacitance.
    /// `leaky` says whether dividers discharge it.
    pub fn idle(capacitive: bool, leaky: bool) -> Self {
        let elastance = capacitive.then_some(V::of(0.0));
        let leak = (capacitive && leaky).then_some(V::of(0.0));
        let wires = [[0, 1, 2]; MOST_LANES];
        let mut legs = Self { elastance, leak, gates: [LegGates::new(); 3], wires, ..Self::default() };
        for lane in 0..V::LANES {
            legs.put_axes(lane, Heading::ZERO);
        }
        legs
    }

    /// Sets the magnetic axes of the phases in a lane. `start` is the heading of the run's plane in the stator's plane.
    pub fn put_axes(&mut self, lane: usize, start: Heading) {
        for (to, phase) in self.axes.iter_mut().zip(self.wires[lane]) {
            to.put(lane, Plane::from_stator(AXES[phase], start));
        }
    }

    /// Sets the phase that each leg of a lane feeds. Must be called before [`Self::put_axes`].
    pub fn put_wires(&mut self, lane: usize, wires: [usize; 3]) {
        self.wires[lane] = wires;
    }

    /// Returns the phase that each leg of a lane feeds.
    pub fn wires(&self, lane: usize) -> [usize; 3] {
        self.wires[lane]
    }

    /// Sets the resistance in Ω of the contacts of a lane's wires.
    pub fn put_contacts(&mut self, lane: usize, contacts: [f64; 3]) {
        self.contact.iter_mut().zip(contacts).for_each(|(to, contact)| to.put(lane, contact));
    }

    /// Returns the resistance in Ω of a lane's winding and contacts, as a matrix in the run's plane. `winding` is the resistance of one
    /// phase in Ω.
    pub fn resistance(&self, lane: usize, winding: f64) -> Symmetric {
        let alone = Symmetric::new(winding, 0.0, winding);
        let contact = self.contact.each_ref().map(|contact| contact.get(lane));
        if contact == [0.0; 3] {
            return alone;
        }
        of_legs(&self.axes.each_ref().map(|axis| axis.get(lane)), &contact, alone)
    }

    /// Connects a divider of this resistance in Ω between each terminal of a lane and the negative rail. Must be called after
    /// [`Self::put_bridge`].
    pub fn put_load(&mut self, lane: usize, resistance: Option<f64>) {
        if let (Some(leak), Some(elastance), Some(resistance)) = (&mut self.leak, &self.elastance, resistance)
        {
            leak.put(lane, elastance.get(lane) / resistance);
        }
    }

    /// Sets how far the potentials of a lane's legs may exceed the rails while no device conducts: by the diodes' drop, or without limit
    /// if the wire is open or the bridge has no diodes.
    pub fn put_open(&mut self, lane: usize, bridge: &Bridge) {
        let diode_drop = bridge.devices.diode_drop;
        for (to, open) in self.beyond.iter_mut().zip(bridge.disconnected) {
            to.put(lane, if open || bridge.open_leg == OpenLeg::Open { f64::INFINITY } else { diode_drop });
        }
    }

    /// Puts a bridge into a lane, with all switches off.
    pub fn put_bridge(&mut self, lane: usize, bridge: &Bridge) {
        let Devices { kind, switch_drop, switch_resistance, diode_drop, diode_resistance } = bridge.devices;
        let reverse = bridge.devices.reverse();
        for (to, of) in [
            (&mut self.switch, [switch_drop, switch_resistance]),
            (&mut self.diode, [diode_drop, diode_resistance]),
            (&mut self.reverse, reverse),
        ] {
            to[0].put(lane, of[0]);
            to[1].put(lane, of[1]);
        }
        self.mosfets = self.mosfets & !(1 << lane) | u32::from(kind == DeviceKind::Mosfet) << lane;
        self.put_open(lane, bridge);
        self.put_contacts(lane, [0.0; 3]);
        if let Some(elastance) = &mut self.elastance {
            elastance.put(lane, 1.0 / bridge.terminal_capacitance);
            self.ringing.put(lane, bridge.terminal_resistance);
        }
        self.gates.iter_mut().for_each(|gates| gates.clear(lane));
        self.put(lane, [Conduction::Blocked; 3]);
    }

    /// Sets the conduction modes of a lane's legs from now on. If only one leg conducts, its current is zero, unless the terminals of the
    /// other legs have a capacitance.
    pub fn put(&mut self, lane: usize, modes: Modes) {
        let conducting = modes.iter().filter(|mode| **mode != Conduction::Blocked).count();
        let flows = conducting > 1 || self.elastance.is_some();
        for (k, mode) in modes.into_iter().enumerate() {
            let bit = |to: &mut u32, on: bool| *to = *to & !(1 << lane) | u32::from(on) << lane;
            bit(&mut self.out[k], flows && mode.direction() > 0.0);
            bit(&mut self.into[k], flows && mode.direction() < 0.0);
        }
    }

    /// Returns the direction of a leg's current: +1 into the motor, −1 out of it, 0 for none.
    pub fn direction(&self, lane: usize, k: usize) -> f64 {
        f64::from(self.out[k] >> lane & 1) - f64::from(self.into[k] >> lane & 1)
    }

    /// Returns whether a lane's switches are MOSFETs. With MOSFETs, every edge of a gate affects conduction.
    pub fn has_mosfets(&self, lane: usize) -> bool {
        self.mosfets >> lane & 1 == 1
    }

    /// Returns a mask with a bit for each machine in which no leg carries current.
    pub fn idle_lanes(&self) -> u32 {
        if self.elastance.is_some() || self.fed.is_some() {
            0
        } else {
            !(self.out[0] | self.out[1] | self.out[2])
        }
    }

    /// Returns the conduction modes of a lane at a time in ns.
    pub fn modes(&self, lane: usize, time: f64) -> Modes {
        let kind = if self.has_mosfets(lane) { DeviceKind::Mosfet } else { DeviceKind::Igbt };
        std::array::from_fn(|k| match self.direction(lane, k) {
            0.0 => Conduction::Blocked,
            direction if direction > 0.0 => kind.outflow(self.gates[k].of(lane, time)),
            _ => kind.inflow(self.gates[k].of(lane, time)),
        })
    }

    /// Returns the current in A of each phase.
    #[inline(always)]
    pub fn phases(&self, current: Plane<V>) -> [V; 3] {
        let [a, b, c] = &self.axes;
        [a.dot(current), b.dot(current), c.dot(current)]
    }

    /// Returns for each lane the time in ns of the next gate edge after `time` that may affect the legs' currents.
    #[inline(always)]
    pub fn next_edge(&self, time: V) -> V {
        let mut edge = V::of(f64::INFINITY);
        for k in 0..3 {
            let [out, into] = self.flow(k);
            edge = edge.least(self.gates[k].next_edge(time, out, into, V::Mask::of_bits(self.mosfets)));
        }
        edge
    }

    /// Returns for each leg the lanes in which the leg's pending request has been carried out at `time` in ns.
    #[inline(always)]
    pub fn carried_out(&self, time: V) -> [V::Mask; 3] {
        [self.carried_out_of(0, time), self.carried_out_of(1, time), self.carried_out_of(2, time)]
    }

    /// In lanes with alternating requests, replaces executed requests by the next ones. Returns the other lanes with an executed request:
    /// for these the caller must set the next request.
    #[inline(always)]
    pub fn follow_on(&mut self, carried_out: [V::Mask; 3]) -> [V::Mask; 3] {
        let [a, b, c] = &mut self.gates;
        [a.follow_on(carried_out[0]), b.follow_on(carried_out[1]), c.follow_on(carried_out[2])]
    }

    #[inline(always)]
    fn carried_out_of(&self, k: usize, time: V) -> V::Mask {
        let [out, into] = self.flow(k);
        self.gates[k].carried_out(time, out, into, V::Mask::of_bits(self.mosfets))
    }

    #[inline(always)]
    fn flow(&self, k: usize) -> [V::Mask; 2] {
        [V::Mask::of_bits(self.out[k]), V::Mask::of_bits(self.into[k])]
    }

    /// Returns the conduction of the legs at `time` in ns. `winding` is the resistance of one phase of the winding in Ω.
    #[inline(always)]
    pub fn at<const RARE: bool>(&self, time: V, winding: V) -> Conducting<V> {
        let capacitive = self.elastance_if::<RARE>().is_some();
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let legs = [self.leg(0, time), self.leg(1, time), self.leg(2, time)];
        let [(a, flows_a, on_a), (b, flows_b, on_b), (c, flows_c, on_c)] = legs;
        let none = Plane::default();
        let mut terminals = Terminals {
            rail: none,
            offset: none,
            resistance: Symmetric::new(winding, zero, winding),
            blocked: none,
            none_blocked: one,
        };
        if let Some(voltage) = self.fed {
            let (all, idle) = (V::Mask::of_bits(u32::MAX), V::Mask::of_bits(0));
            terminals.offset = voltage;
            return Conducting { leg: [a, b, c], flows: [all; 3], idle, on: [on_a, on_b, on_c], terminals };
        }
        let flows = [flows_a, flows_b, flows_c];
        let mut idle = !(flows[0] | flows[1] | flows[2]);
        if capacitive {
            idle = V::Mask::of_bits(0);
        }
        for (k, (leg, flows, _)) in legs.iter().enumerate() {
            let (axis, all) = (self.axes[k], &mut terminals);
            all.rail = all.rail + axis * (leg.rail * (2.0 / 3.0));
            all.offset = all.offset + axis * (leg.offset * (2.0 / 3.0));
            if !capacitive {
                let blocked = V::only(!(idle | *flows), one);
                all.blocked = all.blocked + axis * blocked;
                all.none_blocked = all.none_blocked - blocked;
            }
        }
        let mut met = [a.resistance, b.resistance, c.resistance];
        if capacitive {
            met = three!(k => V::choose(flows[k], met[k], self.ringing));
        }
        met = three!(k => met[k] + self.contact[k]);
        terminals.resistance = of_legs(&self.axes, &met, terminals.resistance);
        Conducting { leg: [a, b, c], flows, idle, on: [on_a, on_b, on_c], terminals }
    }

    #[inline(always)]
    fn leg(&self, k: usize, time: V) -> (Leg<V>, V::Mask, On<V::Mask>) {
        let one = V::of(1.0);
        let on = self.gates[k].at(time);
        let [out, into] = self.flow(k);
        let flows = out | into;
        let switch = (out & on.high) | (into & on.low);
        let upper = (out & on.high) | (into & !on.low);
        let reverse = (out & on.low) | (into & on.high);
        let other = |n: usize| V::choose(reverse, self.reverse[n], self.diode[n]);
        let drop = V::choose(switch, self.switch[0], other(0));
        let leg = Leg {
            rail: V::only(upper, one),
            offset: V::choose(out, -drop, V::only(into, drop)),
            resistance: V::only(flows, V::choose(switch, self.switch[1], other(1))),
            direction: V::choose(out, one, V::only(into, -one)),
        };
        (leg, flows, on)
    }

    /// Returns the limits of the potential of the blocked leg. Beyond a limit one of the leg's devices begins to conduct. Valid for
    /// machines with exactly one blocked leg.
    #[inline(always)]
    pub fn range_of_blocked(&self, at: &Conducting<V>) -> Range<V> {
        let [a, b, c] = [!at.flows[0], !at.flows[1], !at.flows[2]];
        let on = On {
            high: (a & at.on[0].high) | (b & at.on[1].high) | (c & at.on[2].high),
            low: (a & at.on[0].low) | (b & at.on[1].low) | (c & at.on[2].low),
        };
        let [of_a, of_b, of_c] = self.beyond;
        self.range_beyond(&on, V::choose(a, of_a, V::choose(b, of_b, of_c)))
    }

    /// Returns the limits of the potential of leg `k` while these switches are on. Beyond a limit one of the leg's devices begins to
    /// conduct.
    #[inline(always)]
    pub fn range(&self, k: usize, on: &On<V::Mask>) -> Range<V> {
        self.range_beyond(on, self.beyond[k])
    }

    #[inline(always)]
    fn range_beyond(&self, on: &On<V::Mask>, beyond: V) -> Range<V> {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (switch, reverse) = (self.switch[0], self.reverse[0]);
        Range {
            low: [V::only(on.high, one), V::choose(on.high, -switch, V::choose(on.low, -reverse, -beyond))],
            high: [
                V::choose(on.low, zero, one),
                V::choose(on.low, switch, V::choose(on.high, reverse, beyond)),
            ],
        }
    }
}
