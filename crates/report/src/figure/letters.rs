//! The letters of the bundled font: how wide each is, and its outline.

use std::collections::HashMap;
use std::sync::LazyLock;
use tiny_skia::PathBuilder;

/// DejaVu Sans; `assets/letters.py` describes the lines.
static LETTERS: LazyLock<Letters> =
    LazyLock::new(|| Letters::of(include_str!("../../assets/DejaVuSans-letters.txt")));

struct Letters {
    /// Size of the type in the font's unit.
    em: f32,
    by_code: HashMap<u32, Letter>,
}

/// A letter in the unit of its font, the baseline at 0, upwards positive.
pub(super) struct Letter {
    pub advance: f32,
    /// Points of lines and of parabolas.
    outline: Vec<(char, [f32; 4])>,
}

impl Letters {
    fn of(text: &'static str) -> Self {
        let mut lines = text.lines();
        let em = lines.next().and_then(|line| line.parse().ok()).expect("a size first");
        let by_code = lines.map(|line| Letter::of(line).expect("a letter in each line")).collect();
        Self { em, by_code }
    }
}

impl Letter {
    fn of(line: &str) -> Option<(u32, Self)> {
        let mut words = line.split_ascii_whitespace();
        let code = u32::from_str_radix(words.next()?, 16).ok()?;
        let advance = words.next()?.parse().ok()?;
        let mut outline = Vec::new();
        while let Some(command) = words.next() {
            let count = match command {
                "Z" => 0,
                "M" | "L" => 2,
                "Q" => 4,
                _ => return None,
            };
            let mut points = [0.0; 4];
            for value in &mut points[..count] {
                *value = words.next()?.parse().ok()?;
            }
            outline.push((command.chars().next()?, points));
        }
        Some((code, Self { advance, outline }))
    }

    /// Appends the outline with its start at `x`.
    pub fn draw(&self, path: &mut PathBuilder, x: f32) {
        for &(command, [x1, y1, x2, y2]) in &self.outline {
            match command {
                'M' => path.move_to(x + x1, y1),
                'L' => path.line_to(x + x1, y1),
                'Q' => path.quad_to(x + x1, y1, x + x2, y2),
                _ => path.close(),
            }
        }
    }
}

/// Returns the type sizes per unit of the font.
pub(super) fn unit() -> f64 {
    1.0 / f64::from(LETTERS.em)
}

/// Returns a letter; that of code 0 for characters which the font has not.
pub(super) fn letter(c: char) -> &'static Letter {
    let letters = &LETTERS.by_code;
    letters.get(&u32::from(c)).or_else(|| letters.get(&0)).expect("the letter of code 0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_the_font_has_the_letters_of_the_trade() {
        for c in "Az09µΩΔαβγδθψωφλ°±−×·≤≥√²³⁻⁷₀₉→–—≈∞äöüß".chars()
        {
            assert!(LETTERS.by_code.contains_key(&u32::from(c)), "{c}");
        }
    }

    #[test]
    fn law_contours_are_closed_and_stay_within_the_type() {
        for (code, Letter { advance, outline }) in &LETTERS.by_code {
            let begins = outline.iter().filter(|(command, _)| *command == 'M').count();
            let ends = outline.iter().filter(|(command, _)| *command == 'Z').count();
            assert_eq!(begins, ends, "{code:x}");
            assert!(outline.last().is_none_or(|(command, _)| *command == 'Z'), "{code:x}");
            let em = LETTERS.em;
            assert!((0.0..=1.5 * em).contains(advance), "{code:x}");
            assert!(
                outline.iter().flat_map(|(_, points)| points).all(|value| value.abs() <= 1.5 * em),
                "{code:x}"
            );
        }
    }
}
