//! Colours that people with any kind of colour vision can tell apart.

use plotters::style::RGBColor;

/// Colours of lines, in the order of their use (Okabe & Ito 2008).
pub(crate) const LINES: [RGBColor; 4] = [
    RGBColor(0, 114, 178),   // blue
    RGBColor(230, 159, 0),   // orange
    RGBColor(0, 158, 115),   // green
    RGBColor(204, 121, 167), // purple
];
/// What the paper states (Okabe & Ito's vermillion, and a darker shade).
pub(super) const PAPER: [RGBColor; 2] = [RGBColor(213, 94, 0), RGBColor(140, 50, 0)];
/// Text.
pub(crate) const INK: RGBColor = RGBColor(40, 40, 40);
/// Text of lesser weight, and axes.
pub(crate) const PALE_INK: RGBColor = RGBColor(110, 110, 110);
/// Lines of the grid.
pub(crate) const GRID: RGBColor = RGBColor(226, 226, 226);

/// Colours of a scale from 0 to 1 in equal steps: `cividis` (Nuñez, Anderton & Renslow 2018), light
/// for little, so that blank paper is nothing.
const SCALE: [RGBColor; 5] = [
    RGBColor(254, 232, 130),
    RGBColor(190, 174, 113),
    RGBColor(124, 123, 120),
    RGBColor(64, 77, 107),
    RGBColor(0, 32, 77),
];

/// The colour of a share of the largest value.
pub(super) fn of_share(share: f64) -> RGBColor {
    let last = SCALE.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between the first and the last colour"
    )]
    let below = (at.floor() as usize).min(last - 1);
    let (RGBColor(r, g, b), RGBColor(x, y, z)) = (SCALE[below], SCALE[below + 1]);
    let mix = |from: u8, to: u8| {
        let value = f64::from(from) + (at - below as f64) * (f64::from(to) - f64::from(from));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between two bytes"
        )]
        let byte = value.round() as u8;
        byte
    };
    RGBColor(mix(r, x), mix(g, y), mix(b, z))
}
