//! Colours, those of Okabe and Ito, which readers with any colour vision tell apart.

use rerun::Color;

const fn rgb(r: u8, g: u8, b: u8) -> [u8; 3] {
    [r, g, b]
}

/// The three axes of the gauge: vermillion, bluish green, blue.
pub const AXES: [[u8; 3]; 3] = [rgb(213, 94, 0), rgb(0, 158, 115), rgb(0, 114, 178)];
/// Before a step: orange.
pub const BEFORE: [u8; 3] = rgb(230, 159, 0);
/// After it, and the arm as identified: sky blue.
pub const AFTER: [u8; 3] = rgb(86, 180, 233);
/// The arm as drawn: reddish purple.
pub const DRAWN: [u8; 3] = rgb(204, 121, 167);
/// What is looked at now: yellow.
pub const NOW: [u8; 3] = rgb(240, 228, 66);
/// The arm that stands.
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
/// Behind charts and scenes.
pub const GROUND: [u8; 3] = rgb(18, 21, 26);

/// Opaque.
pub fn solid([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}

/// So much of it, the rest background: lines of the viewer are never see-through.
pub fn dim(colour: [u8; 3], share: f32) -> Color {
    let [r, g, b] = [0, 1, 2].map(|k| (share * f32::from(colour[k]) + (1.0 - share) * f32::from(GROUND[k])) as u8);
    Color::from_rgb(r, g, b)
}
