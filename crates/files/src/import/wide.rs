//! Wide tables: a block for ψ_d and one for ψ_q, with one current along the lines and the other along the columns.
//!
//! ```text
//! psi_d_Wb: i_d_A\i_q_A, -10, 0, 10      the flux, then the current of the lines \ that of the columns
//!                   -10, …
//! ```
//! The flux may also stand alone on the line before.

use super::columns::{Column, Quantity};
use super::csv::{Line, Source, point, shortened};
use super::{MapError, MapSamples, Place};

/// A point of one flux: its currents, the flux and its line.
type Entry = ([f64; 2], f64, usize);

/// Head of a block: its flux and its currents.
struct Block {
    /// Index of the flux: 0 is ψ_d, 1 is ψ_q.
    flux: usize,
    flux_scale: f64,
    /// Current along the lines: 0 for i_d, 1 for i_q.
    lines: usize,
    /// Unit of the lines' current, in A.
    own_scale: f64,
    /// The columns' current in A.
    columns: Vec<f64>,
}

pub(super) fn read<'a>(
    source: &Source,
    lines: impl Iterator<Item = Line<'a>>,
) -> Result<MapSamples, MapError> {
    let mut fluxes: [Vec<Entry>; 2] = Default::default();
    let mut block: Option<Block> = None;
    let mut title: Option<Column> = None;
    for line in lines {
        let fields = line.fields();
        let first = fields.first().copied().unwrap_or_default();
        if first.contains('\\') {
            block = Some(corner(source, line, first, &fields[1..], title.take())?);
            continue;
        }
        let named = Column::parse(first)
            .ok()
            .flatten()
            .filter(|column| matches!(column.quantity, Quantity::Dq(2 | 3)));
        if let Some(column) = named.filter(|_| fields[1..].iter().all(|field| field.is_empty())) {
            source.check(line.number, first, column)?;
            title = Some(column);
            continue;
        }
        let Some(block) = &block else {
            let found = format!("`{}` before a block", shortened(line.text));
            return Err(source.error(line.number, found, NEEDED));
        };
        if fields.len() != block.columns.len() + 1 {
            let found = format!("{} field(s) in `{}`", fields.len(), shortened(line.text));
            let needed = format!("{} as in the block's head", block.columns.len() + 1);
            return Err(source.error(line.number, found, needed));
        }
        let own = source.number(line, "", first, block.own_scale)?;
        for (field, across) in fields[1..].iter().zip(&block.columns) {
            let currents = if block.lines == 0 { [own, *across] } else { [*across, own] };
            let flux = source.number(line, "", field, block.flux_scale)?;
            fluxes[block.flux].push((currents, flux, line.number));
        }
        source.bounded(line.number, fluxes[block.flux].len())?;
    }
    let [mut d, mut q] = fluxes;
    let order = |a: &Entry, b: &Entry| a.0[0].total_cmp(&b.0[0]).then(a.0[1].total_cmp(&b.0[1]));
    d.sort_by(order);
    q.sort_by(order);
    if d.is_empty() || d.len() != q.len() || d.iter().zip(&q).any(|(d, q)| d.0 != q.0) {
        let found = format!("{} points of psi_d and {} of psi_q, or at other currents", d.len(), q.len());
        return Err(MapError::new(source.file, None, found, NEEDED));
    }
    let points = d.iter().zip(&q).map(|(d, q)| point([d.0[0], d.0[1], d.1, q.1], Place::Line(d.2)));
    Ok(MapSamples {
        file: source.file.to_owned(),
        points: points.collect(),
        pole_pairs: None,
        resistance: None,
    })
}

const NEEDED: &str = r"a block for psi_d and one for psi_q at the same currents, each headed by its flux and its currents, lines\columns, such as `psi_d_Wb: i_d_A\i_q_A` and the values of i_q";

fn corner(
    source: &Source,
    line: Line,
    text: &str,
    columns: &[&str],
    title: Option<Column>,
) -> Result<Block, MapError> {
    let error = |found: String| source.error(line.number, found, NEEDED);
    let (flux, currents) =
        text.split_once(':').map_or((None, text), |(flux, currents)| (Some(flux), currents));
    let (own, across) = currents.split_once('\\').unwrap_or((currents, ""));
    let corner_of = |text: &str| error(format!("`{}` in the corner of a block", shortened(text)));
    let column = |name: &str| source.column(line.number, name)?.ok_or_else(|| corner_of(name));
    let flux = flux
        .map(column)
        .transpose()?
        .or(title)
        .ok_or_else(|| error("a block without its flux".to_owned()))?;
    let (own, across) = (column(own)?, column(across)?);
    let (flux_place, lines) = match (flux.quantity, own.quantity, across.quantity) {
        (Quantity::Dq(flux @ (2 | 3)), Quantity::Dq(own @ (0 | 1)), Quantity::Dq(across @ (0 | 1)))
            if own != across =>
        {
            (flux - 2, own)
        }
        _ => return Err(corner_of(text)),
    };
    let values = columns.iter().map(|field| source.number(line, "", field, across.scale));
    let columns = values.collect::<Result<_, _>>()?;
    Ok(Block { flux: flux_place, flux_scale: flux.scale, lines, own_scale: own.scale, columns })
}
