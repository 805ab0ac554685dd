//! The legs of several inverters side by side as the windings see them.

#[cfg(test)]
mod tests;

use standstill_inverter::{AXES, Bridge, Conduction, DeviceKind, Devices, Modes, OpenLeg};
use standstill_numeric::{Heading, Lane, Mask, Symmetric, Wide};

use super::gates::{LegGates, On};
use super::plane::Plane;
use super::terminals::of_legs;

/// The legs: their devices, their gates, and which way their currents flow.
#[derive(Clone, Debug, Default)]
pub struct Legs<V: Wide> {
    /// Magnetic axes of the phases in the run's plane.
    pub axes: [Plane<V>; 3],
    /// Drop in V and resistance in Ω of switches and of diodes.
    switch: [V; 2],
    diode: [V; 2],
    /// Drop and resistance of the device that carries a leg's current against its switch while that is on.
    reverse: [V; 2],
    /// A bit for each machine with MOSFETs.
    mosfets: u32,
    /// How far beyond the rails in V the potential of a leg with both switches off may be.
    beyond: V,
    /// 1 over the capacitance of each terminal in 1/F, where terminals have any. A leg in which no device conducts then carries
    /// the current that charges it; no leg is blocked.
    pub elastance: Option<V>,
    /// The resistance in Ω that this current meets, where one phase against the two others resists so much. Each terminal has it for
    /// itself, so that what is met changes nowhere suddenly: a device begins to conduct, or ends, where its leg's current is zero, and
    /// with it the drop of that leg. The same in all directions, as a winding resists what rings in all of them, would jump there, and
    /// neither mode could last.
    ringing: V,
    /// Leg by leg.
    pub gates: [LegGates<V>; 3],
    /// A bit for each machine of which the leg's current flows out of it, into the motor.
    pub out: [u32; 3],
    /// A bit for each machine of which it flows into the leg. Without either the leg is blocked.
    pub into: [u32; 3],
    /// Voltage in V of terminals that are fed from elsewhere: the legs are then not there.
    pub fed: Option<Plane<V>>,
}

/// A leg with current, `u = rail · U_dc + offset − resistance · i`; of one without, zeros.
#[derive(Clone, Copy, Debug, Default)]
pub struct Leg<V> {
    /// 1 at the positive rail, 0 at the negative.
    pub rail: V,
    /// In V.
    pub offset: V,
    /// In Ω.
    pub resistance: V,
    /// +1 for current into the motor, −1 for current out of it, 0 for none.
    pub direction: V,
}

/// The legs at one time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conducting<V: Wide> {
    /// Leg by leg.
    pub leg: [Leg<V>; 3],
    /// Where they carry current.
    pub flows: [V::Mask; 3],
    /// Where none does.
    pub idle: V::Mask,
    /// Which switches are on.
    pub on: [On<V::Mask>; 3],
    /// All together, with the winding's resistance.
    pub terminals: Terminals<V>,
}

/// Legs and winding resistance as a winding without neutral sees them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Terminals<T> {
    /// Voltage per volt of the link.
    pub rail: Plane<T>,
    /// Voltage in V on top.
    pub offset: Plane<T>,
    /// Resistance of devices and winding in Ω.
    pub resistance: Symmetric<T>,
    /// Axis of the leg that is blocked while the others conduct; zero if there is none.
    pub blocked: Plane<T>,
    /// 1 if there is none, else 0.
    pub none_blocked: T,
}

/// Between which potentials a leg can be blocked, from below and from above, each as its share of the link's voltage and V on
/// top.
#[derive(Clone, Copy, Debug)]
pub struct Range<V> {
    low: [V; 2],
    high: [V; 2],
}

impl<V: Lane> Range<V> {
    /// The bounds in V at a link voltage in V.
    #[inline(always)]
    pub fn at(&self, link: V) -> [V; 2] {
        [self.low[0] * link + self.low[1], self.high[0] * link + self.high[1]]
    }
}

impl<V: Wide> Legs<V> {
    /// All blocked and off, of rotors at zero; whether their terminals have a capacitance.
    pub fn idle(capacitive: bool) -> Self {
        let elastance = capacitive.then_some(V::of(0.0));
        let mut legs = Self { elastance, gates: [LegGates::new(); 3], ..Self::default() };
        for lane in 0..V::LANES {
            legs.put_axes(lane, Heading::ZERO);
        }
        legs
    }

    /// The run's plane of a lane has this heading in the stator's.
    pub fn put_axes(&mut self, lane: usize, start: Heading) {
        for (to, axis) in self.axes.iter_mut().zip(AXES) {
            to.put(lane, Plane::from_stator(axis, start));
        }
    }

    /// Puts a bridge into a lane, all off.
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
        self.beyond.put(lane, if bridge.open_leg == OpenLeg::Open { f64::INFINITY } else { diode_drop });
        if let Some(elastance) = &mut self.elastance {
            elastance.put(lane, 1.0 / bridge.terminal_capacitance);
            self.ringing.put(lane, bridge.terminal_resistance);
        }
        self.gates.iter_mut().for_each(|gates| gates.clear(lane));
        self.put(lane, [Conduction::Blocked; 3]);
    }

    /// The legs of a lane conduct so from now on. One leg alone carries nothing, unless the others have a capacitance.
    pub fn put(&mut self, lane: usize, modes: Modes) {
        let conducting = modes.iter().filter(|mode| **mode != Conduction::Blocked).count();
        let flows = conducting > 1 || self.elastance.is_some();
        for (k, mode) in modes.into_iter().enumerate() {
            let bit = |to: &mut u32, on: bool| *to = *to & !(1 << lane) | u32::from(on) << lane;
            bit(&mut self.out[k], flows && mode.direction() > 0.0);
            bit(&mut self.into[k], flows && mode.direction() < 0.0);
        }
    }

    /// +1 for current into the motor, −1 for current out of it, 0 for none.
    pub fn direction(&self, lane: usize, k: usize) -> f64 {
        f64::from(self.out[k] >> lane & 1) - f64::from(self.into[k] >> lane & 1)
    }

    /// Whether a lane's switches are MOSFETs: all edges of their gates then matter.
    pub fn has_mosfets(&self, lane: usize) -> bool {
        self.mosfets >> lane & 1 == 1
    }

    /// A bit for each machine without current.
    pub fn idle_lanes(&self) -> u32 {
        if self.elastance.is_some() || self.fed.is_some() {
            0
        } else {
            !(self.out[0] | self.out[1] | self.out[2])
        }
    }

    /// Conduction modes of a lane at a time in ns.
    pub fn modes(&self, lane: usize, time: f64) -> Modes {
        let kind = if self.has_mosfets(lane) { DeviceKind::Mosfet } else { DeviceKind::Igbt };
        std::array::from_fn(|k| match self.direction(lane, k) {
            0.0 => Conduction::Blocked,
            direction if direction > 0.0 => kind.outflow(self.gates[k].of(lane, time)),
            _ => kind.inflow(self.gates[k].of(lane, time)),
        })
    }

    /// Current in A of each phase.
    #[inline(always)]
    pub fn phases(&self, current: Plane<V>) -> [V; 3] {
        let [a, b, c] = &self.axes;
        [a.dot(current), b.dot(current), c.dot(current)]
    }

    /// The next gate edges after times in ns that may change what the legs do.
    #[inline(always)]
    pub fn next_edge(&self, time: V) -> V {
        let mut edge = V::of(f64::INFINITY);
        for k in 0..3 {
            let [out, into] = self.flow(k);
            edge = edge.least(self.gates[k].next_edge(time, out, into, V::Mask::of_bits(self.mosfets)));
        }
        edge
    }

    /// Where a request of each leg has been carried out at times in ns.
    #[inline(always)]
    pub fn carried_out(&self, time: V) -> [V::Mask; 3] {
        [self.carried_out_of(0, time), self.carried_out_of(1, time), self.carried_out_of(2, time)]
    }

    /// Puts the requests that follow by alternation in the place of those carried out; what is left of these.
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

    /// The legs at times in ns, with windings of such a resistance in Ω.
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

    /// Where devices of the one leg that is blocked begin to conduct.
    #[inline(always)]
    pub fn range_of_blocked(&self, at: &Conducting<V>) -> Range<V> {
        let [a, b, c] = [!at.flows[0], !at.flows[1], !at.flows[2]];
        self.range(&On {
            high: (a & at.on[0].high) | (b & at.on[1].high) | (c & at.on[2].high),
            low: (a & at.on[0].low) | (b & at.on[1].low) | (c & at.on[2].low),
        })
    }

    /// Where devices of a leg with such gates begin to conduct.
    #[inline(always)]
    pub fn range(&self, on: &On<V::Mask>) -> Range<V> {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (switch, reverse) = (self.switch[0], self.reverse[0]);
        Range {
            low: [
                V::only(on.high, one),
                V::choose(on.high, -switch, V::choose(on.low, -reverse, -self.beyond)),
            ],
            high: [
                V::choose(on.low, zero, one),
                V::choose(on.low, switch, V::choose(on.high, reverse, self.beyond)),
            ],
        }
    }
}
