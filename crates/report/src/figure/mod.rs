//! Figures: a description of panels, axes and layers, and its drawing as SVG or PNG.
//!
//! A [`Figure`] holds data and labels only. Ticks, margins, legends and the thinning of long series follow from the
//! description, so that every figure of the project looks the same. Drawing happens in memory and is deterministic:
//! equal figures give equal bytes.
//!
//! In every text, the index of a one-letter symbol is written after an underscore and set below the line, as in `i_a`
//! or `L_d`; names like `pulse_test` do not change.
//!
//! Coordinates that are not finite are gaps: a line breaks there, a marker is left out.
//!
//! The crate plotters draws the figures. Series for which there is no [`Layer`] can be drawn with it on the [`Chart`]
//! of a panel.
//!
//! ```
//! use standstill_report::figure::plotters::prelude::*;
//! use standstill_report::figure::{Axis, Figure, Panel, px, stroke_px};
//!
//! let (time, current) = (Axis::new("time t (ms)").range(0.0, 4.0), Axis::new("current i (A)").range(-1.0, 1.0));
//! let panels = vec![Panel::new(time, current)];
//! let figure = Figure { title: "Decay".into(), subtitle: None, width: 600, height: 300, panels };
//! let svg = figure.svg_with(|_panel, chart| {
//!     let decay = (0..=400).map(|k| 0.01 * f64::from(k)).map(|t| (t, (-t).exp()));
//!     chart.draw_series(LineSeries::new(decay, RED.stroke_width(stroke_px(1.5))))?;
//!     chart.draw_series([Circle::new((1.0, 0.37), px(4.0), BLUE.filled())]).map(drop)
//! })?;
//! assert!(svg.contains("#ff0000") && svg.contains("<circle"));
//! # Ok::<(), standstill_report::figure::FigureError>(())
//! ```

mod axis;
mod backend;
mod chart;
mod colour;
mod extent;
mod heat;
mod layers;
mod legend;
mod letters;
mod number;
pub(crate) mod plotly;
mod png;
mod reduce;
mod style;
mod svg;
#[cfg(any(test, feature = "testing"))]
mod testing;
#[cfg(test)]
mod tests;
mod text;
mod ticks;

pub use axis::{Axis, AxisScale, Scale, Ticks};
pub use backend::{Backend, Drawn, px, stroke_px};
pub use chart::Chart;
pub use heat::cell_edges;
pub(crate) use number::digits;
pub use number::{rounded, significant};
pub use plotters;
pub use style::Style;

use plotters::drawing::DrawingAreaErrorKind;
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;
use thiserror::Error;

/// A whole figure: a title and panels stacked from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// First line, in the largest type. May be empty.
    pub title: String,
    /// Smaller text under the title: the conditions under which the data were obtained.
    pub subtitle: Option<String>,
    /// Width in logical pixels, 200 to 4000. A PNG has twice as many.
    pub width: u32,
    /// Height in logical pixels, 200 to 4000. A PNG has twice as many.
    pub height: u32,
    /// The panels, top to bottom. Neighbours with the same horizontal axis share one set of tick labels.
    pub panels: Vec<Panel>,
}

/// A pair of axes with its layers.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Panel {
    /// Title above the legend; required only for figures with several panels. May be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis. A [`Layer::Lanes`] replaces its range and ticks by the names of the lanes.
    pub y: Axis,
    /// Layers, the first at the back.
    pub layers: Vec<Layer>,
    /// Share of the figure's height relative to the other panels; 1 unless finite and positive.
    pub weight: f64,
    /// Whether the labelled layers are explained in a row above the panel.
    pub legend: bool,
}

/// Something drawn in a panel, in the units of its axes.
///
/// Layers of one panel with the same label share one legend entry, so that a line and its samples can be
/// given as two layers.
#[derive(Clone, Debug, PartialEq)]
pub enum Layer {
    /// Straight connections between points in the given order.
    Line {
        /// Legend entry.
        label: Option<String>,
        /// `(x, y)`
        points: Vec<(f64, f64)>,
        /// Colour and dashes.
        style: Style,
    },
    /// Each value holds until the next point, as a sampled or switched quantity does.
    Steps {
        /// Legend entry.
        label: Option<String>,
        /// `(x, y)`, by increasing `x`.
        points: Vec<(f64, f64)>,
        /// Colour and dashes.
        style: Style,
    },
    /// A marker per point; many points become small and translucent, so that density shows.
    Points {
        /// Legend entry.
        label: Option<String>,
        /// `(x, y)`
        points: Vec<(f64, f64)>,
        /// Colour and marker.
        style: Style,
    },
    /// The translucent area between two curves.
    Band {
        /// Legend entry.
        label: Option<String>,
        /// `(x, lower, upper)`, by increasing `x`.
        points: Vec<(f64, f64, f64)>,
        /// Colour.
        style: Style,
    },
    /// A marker with a whisker from a lower to an upper value.
    ErrorBars {
        /// Legend entry.
        label: Option<String>,
        /// `(x, y, lower, upper)`
        points: Vec<(f64, f64, f64, f64)>,
        /// Colour and marker.
        style: Style,
    },
    /// A ring with a whisker from a lower to an upper value. It is distinct from the marks and lines beside it. It has
    /// no key in the legend; the legend entry of its label switches it.
    Hollow {
        /// Legend entry that it belongs to.
        label: Option<String>,
        /// `(x, y, lower, upper)`
        points: Vec<(f64, f64, f64, f64)>,
        /// Colour.
        style: Style,
    },
    /// Hatched strips from bottom to top, which mark values that must not be chosen. They are not data.
    Hatched {
        /// Legend entry, which is there without strips too: it explains rings as well.
        label: Option<String>,
        /// `(from, to)` on the horizontal axis; an end that is infinite is that of the panel.
        spans: Vec<(f64, f64)>,
    },
    /// A bar with an arrow pointing down from it: all that is known is that the value lies below.
    UpperLimits {
        /// Legend entry.
        label: Option<String>,
        /// `(x, upper limit)`
        points: Vec<(f64, f64)>,
        /// Colour.
        style: Style,
    },
    /// Cells whose colour shows a value, with a colour bar to the right of the panel. A panel may have one such layer.
    ///
    /// Cells without a value are hatched, and the legend explains the hatching.
    Heat {
        /// Edges of the columns on the horizontal axis, in increasing order and one more than there are columns;
        /// [`cell_edges`] has them for given centres. On [`Axis::categories`] they are −0.5, 0.5, 1.5, ….
        x_edges: Vec<f64>,
        /// Edges of the rows on the vertical axis, in ascending order.
        y_edges: Vec<f64>,
        /// Values of the cells, row by row from the first of `y_edges` on, and column by column in a row. Values that
        /// are missing at the end or not finite leave their cells empty.
        values: Vec<f64>,
        /// Colour bar: description and unit of the values, values at its lightest and darkest end (without a range,
        /// those of the data), ticks and scale. Values beyond the ends, on a logarithmic scale also zero and negative
        /// ones, have the colour of the end.
        colour: Axis,
        /// Legend entry of cells without a value.
        blank: String,
        /// Texts of the values for cells and read-outs, in as many digits as each value supports; empty for cells
        /// without text. Texts are written into at most 100 cells, if all cells have enough room.
        texts: Vec<String>,
    },
    /// A thin dashed line across the panel, for a limit.
    HorizontalRule {
        /// Written to the right of the panel.
        label: Option<String>,
        /// Position on the vertical axis.
        y: f64,
    },
    /// A thin dashed line from bottom to top, for an instant.
    VerticalRule {
        /// Written above the panel.
        label: Option<String>,
        /// Position on the horizontal axis.
        x: f64,
    },
    /// Strips that show which of a few states each of several things is in.
    Lanes {
        /// The strips, top to bottom.
        lanes: Vec<Lane>,
        /// The names of the states; they fill the legend. Up to six differ in fill and hatching.
        categories: Vec<String>,
    },
}

/// A short way to write each of the layers that have points.
macro_rules! layers_of_points {
    ($($name:ident: $variant:ident of $point:ty),* $(,)?) => {
        impl Layer {
            $(
                #[doc = concat!("[`Layer::", stringify!($variant), "`]; an empty label is none.")]
                pub fn $name(label: &str, style: Style, points: impl IntoIterator<Item = $point>) -> Self {
                    Self::$variant { label: some(label), points: points.into_iter().collect(), style }
                }
            )*
        }
    };
}

layers_of_points! {
    line: Line of (f64, f64),
    steps: Steps of (f64, f64),
    points: Points of (f64, f64),
    band: Band of (f64, f64, f64),
    error_bars: ErrorBars of (f64, f64, f64, f64),
    hollow: Hollow of (f64, f64, f64, f64),
    upper_limits: UpperLimits of (f64, f64),
}

fn some(label: &str) -> Option<String> {
    (!label.is_empty()).then(|| label.to_owned())
}

impl Layer {
    /// Makes a [`Layer::HorizontalRule`]; an empty label means none.
    pub fn level(label: &str, y: f64) -> Self {
        Self::HorizontalRule { label: some(label), y }
    }

    /// Makes a [`Layer::VerticalRule`]; an empty label means none.
    pub fn instant(label: &str, x: f64) -> Self {
        Self::VerticalRule { label: some(label), x }
    }
}

/// A strip of a [`Layer::Lanes`].
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Written in place of a tick label.
    pub label: String,
    /// `(from, to, index of the category)`, from and to on the horizontal axis. A category that does not
    /// exist, and any stretch not covered, is left blank.
    pub spans: Vec<(f64, f64, usize)>,
}

/// Why a figure could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FigureError {
    /// Width or height are outside 200 to 4000 logical pixels.
    #[error("a figure of {width} by {height} pixels is outside 200 to 4000")]
    Size {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// The figure could not be drawn or encoded as PNG.
    #[error("the figure could not be drawn: {0}")]
    Draw(String),
}

impl From<DrawingAreaErrorKind<Infallible>> for FigureError {
    fn from(why: DrawingAreaErrorKind<Infallible>) -> Self {
        Self::Draw(why.to_string())
    }
}

impl Panel {
    /// Makes a panel of weight 1 with a legend and no title and no layers yet.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { title: String::new(), x, y, layers: Vec::new(), weight: 1.0, legend: true }
    }

    /// Returns the panel with a title.
    pub fn titled(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Returns whether it has something to show besides rules.
    pub fn has_data(&self) -> bool {
        extent::has_data(self)
    }

    fn has_lanes(&self) -> bool {
        self.layers.iter().any(|layer| matches!(layer, Layer::Lanes { .. }))
    }

    fn has_cells(&self) -> bool {
        self.layers.iter().any(|layer| matches!(layer, Layer::Heat { .. }))
    }

    /// Returns the vertical axis, on which lanes have their names.
    fn lane_axis(&self) -> Axis {
        let lanes = self.layers.iter().find_map(|layer| match layer {
            Layer::Lanes { lanes, .. } => Some(lanes),
            _ => None,
        });
        let Some(lanes) = lanes else { return self.y.clone() };
        let places = (0..lanes.len()).rev().map(|i| i as f64 + 0.5);
        let names = places.zip(lanes).map(|(at, lane)| (at, lane.label.clone())).collect();
        Axis { ticks: Ticks::Named(names), scale: AxisScale::Linear, ..self.y.clone() }
    }

    /// Returns the panel with one more layer in front.
    pub fn with(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }
}

impl Figure {
    /// Usual width in logical pixels: that of a column of text.
    pub(crate) const WIDTH: u32 = 900;

    /// Makes a figure of the usual width with a subtitle; `height` in logical pixels.
    pub fn new(
        title: impl Into<String>,
        subtitle: impl Into<String>,
        height: u32,
        panels: impl Into<Vec<Panel>>,
    ) -> Self {
        let (title, panels) = (title.into(), panels.into());
        Self { title, subtitle: Some(subtitle.into()), width: Self::WIDTH, height, panels }
    }

    /// Returns whether any panel has something to show besides rules.
    pub fn has_data(&self) -> bool {
        self.panels.iter().any(Panel::has_data)
    }

    /// Returns the figure as an SVG document of its logical size.
    ///
    /// Text stays text, set in DejaVu Sans where that is installed and in a font of similar widths elsewhere.
    pub fn svg(&self) -> Result<String, FigureError> {
        self.svg_with(|_, _| Ok(()))
    }

    /// Returns the figure as a PNG file of twice its logical size.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        self.png_with(|_, _| Ok(()))
    }

    /// Draws the figure like [`Figure::svg`], with series of the caller's own: `more` draws on the [`Chart`] of each panel, by its
    /// index, over the panel's layers and in its coordinates.
    pub fn svg_with(&self, mut more: impl FnMut(usize, &mut Chart) -> Drawn) -> Result<String, FigureError> {
        self.check_size()?;
        let svg = Rc::new(RefCell::new(svg::Svg::new(self.width, self.height)));
        chart::draw(svg.clone(), self, &mut more)?;
        Ok(svg.take().finish())
    }

    /// Draws the figure like [`Figure::png`], with series of the caller's own as in [`Figure::svg_with`].
    pub fn png_with(&self, mut more: impl FnMut(usize, &mut Chart) -> Drawn) -> Result<Vec<u8>, FigureError> {
        self.check_size()?;
        let size = FigureError::Size { width: self.width, height: self.height };
        let png = Rc::new(RefCell::new(png::Png::new(self.width, self.height).ok_or(size)?));
        chart::draw(png.clone(), self, &mut more)?;
        png.borrow().finish().map_err(|why| FigureError::Draw(why.to_string()))
    }

    fn check_size(&self) -> Result<(), FigureError> {
        let (width, height) = (self.width, self.height);
        let fits = [width, height].iter().all(|size| (200..=4000).contains(size));
        if fits { Ok(()) } else { Err(FigureError::Size { width, height }) }
    }
}
