//! Labels of a drawn figure: which are cut off, and which lie on another.

use super::backend::{Point, Rect, Surface, Type};
use super::colour::Colour;
use super::{Figure, FigureError, chart, text};
use plotters_backend::text_anchor::HPos;
use std::cell::RefCell;
use std::rc::Rc;

/// Records the texts that are drawn, with the boxes that they take.
#[derive(Default)]
struct Texts(Vec<(String, Rect)>);

impl Surface for Texts {
    fn stroke(&mut self, _: &[Point], _: Colour, _: f64) {}
    fn polygon(&mut self, _: &[Point], _: Colour) {}
    fn disc(&mut self, _: Point, _: f64, _: Option<f64>, _: Colour) {}

    fn text(&mut self, text: &str, (x, y): Point, set: Type) {
        let wide = text::width(text, set.size);
        let before = match set.align {
            HPos::Left => 0.0,
            HPos::Center => 0.5 * wide,
            HPos::Right => wide,
        };
        // Capitals are 0.73 of the type size high, and no letter of the font goes deeper than 0.24 of it.
        let (left, right, up, down) = (-before, wide - before, 0.73 * set.size, 0.24 * set.size);
        let place = match set.turn {
            0 => Rect { left: x + left, right: x + right, top: y - up, bottom: y + down },
            -90 => Rect { left: x - up, right: x + down, top: y - right, bottom: y - left },
            90 => Rect { left: x - down, right: x + up, top: y + left, bottom: y + right },
            other => panic!("{text} is turned by {other}"),
        };
        self.0.push((text.to_owned(), place));
    }
}

impl Figure {
    /// Returns one sentence for each label that is cut off or lies on another when the figure is drawn: what tests of figures look at.
    ///
    /// # Errors
    /// The figure cannot be drawn, see [`Figure::svg`].
    #[doc(hidden)]
    pub fn faulty_labels(&self) -> Result<Vec<String>, FigureError> {
        self.check_size()?;
        let texts = Rc::new(RefCell::new(Texts::default()));
        chart::draw(texts.clone(), self, &mut |_, _| Ok(()))?;
        Ok(faults(&texts.take().0, f64::from(self.width), f64::from(self.height)))
    }
}

/// Texts that are cut off, and pairs of which one lies on the other.
fn faults(texts: &[(String, Rect)], wide: f64, tall: f64) -> Vec<String> {
    /// What strokes of two letters may share, in logical pixels.
    const TOUCH: f64 = 1.0;
    let within = |at: &Rect| at.left >= 0.0 && at.right <= wide && at.top >= 0.0 && at.bottom <= tall;
    let mut faults: Vec<String> = texts
        .iter()
        .filter(|(text, at)| !text.is_empty() && !within(at))
        .map(|(text, at)| format!("\"{text}\" is cut off: {at:?}"))
        .collect();
    let meet = |a: &Rect, b: &Rect| {
        a.right.min(b.right) - a.left.max(b.left) > TOUCH && a.bottom.min(b.bottom) - a.top.max(b.top) > TOUCH
    };
    for (number, (text, at)) in texts.iter().enumerate() {
        let others = texts[number + 1..].iter().filter(|(_, other)| meet(at, other));
        faults.extend(
            others.map(|(other, there)| format!("\"{other}\" lies on \"{text}\": {there:?}, {at:?}")),
        );
    }
    faults
}
