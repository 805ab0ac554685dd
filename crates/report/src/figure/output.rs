//! The two file formats.

use super::canvas::{Canvas, Kind};
use super::{Figure, FigureError, frame};
use image::codecs::png::PngEncoder;
use image::{ColorType, ImageEncoder, RgbImage};
use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};

/// Device pixels per logical pixel of an SVG. Its coordinates are whole numbers, hence eighths of a pixel.
const SVG_SCALE: u32 = 8;
/// Pixels of a PNG per logical pixel: type stays sharp in print.
const PNG_DENSITY: u32 = 2;
/// Pixels drawn per pixel of the PNG, in each direction: their mean smooths the edges.
const PNG_SAMPLES: u32 = 3;

pub(super) fn svg(figure: &Figure) -> Result<String, FigureError> {
    let mut document = String::new();
    let size = (figure.width * SVG_SCALE, figure.height * SVG_SCALE);
    let backend = SVGBackend::with_string(&mut document, size);
    let mut canvas = Canvas { backend, kind: Kind::Vector, scale: f64::from(SVG_SCALE) };
    frame::draw(&mut canvas, figure)?;
    canvas.backend.present().map_err(|e| FigureError::Draw(e.to_string()))?;
    drop(canvas);

    let drawn = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    let shown = format!("width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"", figure.width, figure.height);
    // Texts cannot contain either string: their quotation marks are escaped.
    Ok(document.replacen(&drawn, &shown, 1).replace(" stroke=\"none\" stroke-width=\"1\"", ""))
}

pub(super) fn png(figure: &Figure) -> Result<Vec<u8>, FigureError> {
    let scale = PNG_DENSITY * PNG_SAMPLES;
    let (width, height) = (figure.width * scale, figure.height * scale);
    let mut pixels = vec![0xFF; width as usize * height as usize * 3];
    let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
    let mut canvas = Canvas { backend, kind: Kind::Raster, scale: f64::from(scale) };
    frame::draw(&mut canvas, figure)?;
    canvas.backend.present().map_err(|e| FigureError::Draw(e.to_string()))?;
    drop(canvas);

    let large = RgbImage::from_raw(width, height, pixels)
        .ok_or_else(|| FigureError::Draw("the picture has not the size of its buffer".to_owned()))?;
    let (width, height) = (figure.width * PNG_DENSITY, figure.height * PNG_DENSITY);
    let small = image::imageops::thumbnail(&large, width, height);
    let mut file = Vec::new();
    PngEncoder::new(&mut file)
        .write_image(&small, width, height, ColorType::Rgb8)
        .map_err(|e| FigureError::Encode(e.to_string()))?;
    Ok(file)
}
