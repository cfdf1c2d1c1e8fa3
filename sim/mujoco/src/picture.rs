//! Pictures of the cell, rendered off-screen.

use std::path::Path;

use calibench::files::FileError;
use calibench::files::disk::write_whole;
use thiserror::Error;

use super::machine::machine;
use super::plant::MujocoPlant;
use super::scenery::Camera;
use calibench_sim::gauge::Gauge;
use calibench_sim::mechanics::{BallForm, Parts, Plant, PlantError, Stand};
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;

/// Width of a picture, pixels.
const WIDTH: u32 = 1600;
/// Height of a picture, pixels.
const HEIGHT: u32 = 1200;

/// Errors of rendering a picture.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The cell cannot be simulated, or this machine cannot render.
    #[error("no picture can be drawn here: {0}")]
    Plant(#[from] PlantError),
    /// The picture cannot be encoded.
    #[error("the picture cannot be packed")]
    Png(#[from] png::EncodingError),
    /// It cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Renders the cell of a scenario with its motors at `q` (rad) to `cell.png` and `gauge.png` in a folder.
///
/// # Errors
/// When this machine cannot render, or the folder cannot be written.
pub fn draw(scenario: &Scenario, streams: &Streams, q: &[f64], folder: &Path) -> Result<(), PictureError> {
    let gauge = Gauge::draw(&scenario.truth().keys().indicators.plungers(), streams);
    let machine = machine(scenario, streams, &Parts::of(scenario, streams, &gauge))?;
    let mut plant = MujocoPlant::of(&machine)?;
    let stand = Stand {
        motors: q,
        came_far: true,
        commanded: q,
        approach: &vec![0; q.len()],
        plungers: None,
        sample: None,
        time_s: 0.0,
        temp_c: 20.0,
    };
    plant.settle(&stand, &mut BallForm { sigma: 0.0, random: streams.stream("ball form") })?;
    plant.engine().forward()?;
    for camera in [Camera::Cell, Camera::Gauge] {
        let pixels = plant.engine().picture(camera.name(), WIDTH as usize, HEIGHT as usize)?;
        let mut packed = Vec::new();
        let mut encoder = png::Encoder::new(&mut packed, WIDTH, HEIGHT);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&pixels)?;
        writer.finish()?;
        write_whole(&folder.join(format!("{}.png", camera.name())), &packed)?;
    }
    Ok(())
}
