//! Derivatives that follow exactly from others. If they were computed by separate simulations, their different rounding
//! errors would make parameters seem identifiable that no reading determines.

use standstill_inverter::DeviceKind;

use super::parameters::{Parameter, Point};
use super::pieces::{Edge, Piece};
use super::record::{CHANNELS, Request};
use super::solve::{Derivative, Problem};

impl Problem {
    /// Returns the derivatives with respect to a parameter that has the same effect as a shift of some edges, in a piece in which
    /// every edge is an unknown: the sum of the derivatives of these edges. A delay of the channels is a shift of all edges, a dead
    /// time one of the edges that turn legs on, so no reading tells the two apart. A derivative computed differently would: its
    /// rounding errors differ from those of the edges.
    pub fn of_edges(
        &self,
        parameter: Parameter,
        piece: &Piece,
        columns: &[Derivative],
        shifts: impl Fn(usize) -> bool,
    ) -> Option<Derivative> {
        let place = self.free.iter().position(|free| *free == parameter)?;
        let edges = || columns.iter().filter(|(place, _)| *place >= self.free.len());
        if edges().count() < piece.edges.len() {
            return None;
        }
        let mut all = vec![[0.0; CHANNELS]; piece.rows.len()];
        for (_, column) in edges().filter(|(place, _)| shifts(self.edges[place - self.free.len()].1)) {
            for (sum, one) in all.iter_mut().zip(column) {
                for (sum, one) in sum.iter_mut().zip(one) {
                    *sum += one;
                }
            }
        }
        Some((place, all))
    }

    /// Returns true if the derivative with respect to the switches' resistance follows from two others: every current passes the
    /// winding and either a switch or a diode, so what the winding's resistance gains and both of theirs lose changes no current. Where a
    /// MOSFET's channel and its diode conduct side by side, that does not hold.
    pub fn has_switch_by_others(&self, point: &Point) -> bool {
        let devices = &point.plant.devices;
        let most = 2.0 * self.frame.current;
        let are_apart =
            devices.kind == DeviceKind::Igbt || devices.switch_resistance * most < devices.diode_drop;
        let all = [Parameter::Resistance, Parameter::DiodeResistance, Parameter::SwitchResistance];
        are_apart && all.iter().all(|parameter| self.free.contains(parameter))
    }

    /// Returns the derivatives with respect to the switches' resistance: those of the winding's less those of the
    /// diodes'. If they were computed by separate simulations, their different rounding errors would seem to bound the
    /// resistance, although no reading does.
    pub fn of_switch(&self, columns: &[Derivative]) -> Option<Derivative> {
        let place = |of: Parameter| self.free.iter().position(|free| *free == of);
        let column = |of: Parameter| {
            let place = place(of)?;
            columns.iter().find(|(other, _)| *other == place).map(|(_, column)| column)
        };
        let (winding, diode) = (column(Parameter::Resistance)?, column(Parameter::DiodeResistance)?);
        let less = |(a, b): (&[f64; CHANNELS], &[f64; CHANNELS])| std::array::from_fn(|k| a[k] - b[k]);
        Some((place(Parameter::SwitchResistance)?, winding.iter().zip(diode).map(less).collect()))
    }

    /// Returns which edges of a piece turn legs on after all were off, if every other edge turns all off: then a dead time is a
    /// shift of the former. None if some legs change while others conduct, or if not every edge is an unknown.
    pub fn turning_on(&self, number: usize) -> Option<Vec<bool>> {
        let piece = &self.pieces[number];
        let off = [Request::Off; 3];
        let before = std::iter::once(piece.first).chain(piece.edges.iter().map(|edge| edge.legs));
        let turns_on: Vec<bool> = before.take(piece.edges.len()).map(|legs| legs == off).collect();
        let are_all_unknown = self.edges.iter().filter(|(of, _)| *of == number).count() == piece.edges.len();
        let is_plain = |(on, edge): (&bool, &Edge)| *on != (edge.legs == off);
        (are_all_unknown && turns_on.iter().zip(&piece.edges).all(is_plain)).then_some(turns_on)
    }
}
