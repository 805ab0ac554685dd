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
use crate::import::arrays::MOST_POINTS;

/// A point of one flux: its currents, the flux and its line.
type Entry = ([f64; 2], f64, usize);

/// What the corner of a block says.
struct Block {
    /// Of ψ_d or ψ_q.
    flux: usize,
    flux_scale: f64,
    /// Which current is along the lines: 0 is i_d.
    lines: usize,
    /// Of the lines' and the columns' current.
    scales: [f64; 2],
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
            return Err(source.error(line.number, found, needed()));
        };
        if fields.len() != block.columns.len() + 1 {
            let found = format!("{} field(s) in `{}`", fields.len(), shortened(line.text));
            return Err(source.error(
                line.number,
                found,
                format!("{} as in the block's head", block.columns.len() + 1),
            ));
        }
        let value = |field: &str| {
            let found = || format!("`{}`", shortened(field));
            line.value(field).ok_or_else(|| source.error(line.number, found(), "a finite number".to_owned()))
        };
        let own = value(first)? * block.scales[0];
        for (field, across) in fields[1..].iter().zip(&block.columns) {
            let currents = if block.lines == 0 { [own, *across] } else { [*across, own] };
            fluxes[block.flux].push((currents, value(field)? * block.flux_scale, line.number));
        }
        if fluxes[block.flux].len() > MOST_POINTS {
            let needed = "at most 1,048,576 points, 1,024 × 1,024".to_owned();
            return Err(source.error(line.number, "more points".to_owned(), needed));
        }
    }
    let [mut d, mut q] = fluxes;
    let order = |a: &Entry, b: &Entry| a.0[0].total_cmp(&b.0[0]).then(a.0[1].total_cmp(&b.0[1]));
    d.sort_by(order);
    q.sort_by(order);
    if d.is_empty() || d.len() != q.len() || d.iter().zip(&q).any(|(d, q)| d.0 != q.0) {
        let found = format!("{} points of psi_d and {} of psi_q, or at other currents", d.len(), q.len());
        return Err(MapError::new(source.file, None, found, needed()));
    }
    let points = d.iter().zip(&q).map(|(d, q)| point([d.0[0], d.0[1], d.1, q.1], Place::Line(d.2)));
    Ok(MapSamples {
        file: source.file.to_owned(),
        points: points.collect(),
        pole_pairs: None,
        resistance: None,
    })
}

fn needed() -> String {
    r"a block for psi_d and one for psi_q at the same currents, each headed by its flux and its currents, lines\columns, such as `psi_d_Wb: i_d_A\i_q_A` and the values of i_q".to_owned()
}

fn corner(
    source: &Source,
    line: Line,
    text: &str,
    columns: &[&str],
    title: Option<Column>,
) -> Result<Block, MapError> {
    let error = |found: String| source.error(line.number, found, needed());
    let (flux, currents) =
        text.split_once(':').map_or((None, text), |(flux, currents)| (Some(flux), currents));
    let (own, across) = currents.split_once('\\').unwrap_or((currents, ""));
    let column = |name: &str| {
        let column = Column::parse(name).map_err(|units| {
            source.error(line.number, format!("`{}`", shortened(name)), format!("one of the units {units}"))
        })?;
        let column =
            column.ok_or_else(|| error(format!("`{}` in the corner of a block", shortened(name))))?;
        source.check(line.number, name, column)?;
        Ok(column)
    };
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
        _ => return Err(error(format!("`{}` in the corner of a block", shortened(text)))),
    };
    let values = columns.iter().map(|field| {
        let value = line.value(field).map(|value| value * across.scale);
        value.ok_or_else(|| {
            source.error(line.number, format!("`{}`", shortened(field)), "a finite number".to_owned())
        })
    });
    Ok(Block {
        flux: flux_place,
        flux_scale: flux.scale,
        lines,
        scales: [own.scale, across.scale],
        columns: values.collect::<Result<_, _>>()?,
    })
}
