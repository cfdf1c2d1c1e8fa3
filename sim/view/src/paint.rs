//! Colours of Okabe and Ito, which readers with any colour vision can distinguish.

use rerun::Color;

const fn rgb(r: u8, g: u8, b: u8) -> [u8; 3] {
    [r, g, b]
}

/// The three axes of the gauge: vermillion, bluish green, blue.
pub const AXES: [[u8; 3]; 3] = [rgb(213, 94, 0), rgb(0, 158, 115), rgb(0, 114, 178)];
/// Before a step: orange.
pub const BEFORE: [u8; 3] = rgb(230, 159, 0);
/// After it, and the identified arm: sky blue.
pub const AFTER: [u8; 3] = rgb(86, 180, 233);
/// The nominal arm: reddish purple.
pub const DRAWN: [u8; 3] = rgb(204, 121, 167);
/// The current item: yellow.
pub const NOW: [u8; 3] = rgb(240, 228, 66);
/// The solid arm.
pub const ARM: [u8; 3] = rgb(196, 200, 206);
/// Gauge body.
pub const GAUGE: [u8; 3] = rgb(120, 124, 130);
/// Table and artifact.
pub const CELL: [u8; 3] = rgb(74, 80, 90);
/// Balls.
pub const BALL: [u8; 3] = rgb(226, 228, 232);
/// Frames of charts.
pub const GRID: [u8; 3] = rgb(150, 156, 166);
/// The band in which a ball counts as centred.
pub const BAND: [u8; 3] = rgb(24, 62, 54);
/// Background of charts and scenes.
pub const GROUND: [u8; 3] = rgb(18, 21, 26);

/// Opaque.
pub fn solid([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}

/// Mixes this share of the colour with the background: lines of the viewer cannot be translucent.
pub fn dim(colour: [u8; 3], share: f32) -> Color {
    let [r, g, b] = [0, 1, 2].map(|k| (share * f32::from(colour[k]) + (1.0 - share) * f32::from(GROUND[k])) as u8);
    Color::from_rgb(r, g, b)
}
