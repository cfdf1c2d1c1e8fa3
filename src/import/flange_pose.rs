//! Joints from the pose of the flange or TCP that a controller states, where a table has no joints: hand-eye files. Of the postures
//! of an arm at one pose it is supposed to be in the one nearest to joints that
//! the map states.

use std::path::Path;

use csv::StringRecord;
use nalgebra::{Rotation3, Translation3, Vector3};

use super::column_map::{MappedFlange, Source};
use super::table::{Places, place, value, vector_of};
use crate::compensate::NominalInverse;
use crate::files::FileError;
use crate::measure::dataset::samples_text::number;
use crate::robot::{Pose, Robot};
use crate::units::{DEG, MM};

/// Reads the joints of the rows, one after the other.
pub(super) struct FlangeReader<'a> {
    map: &'a MappedFlange,
    robot: &'a Robot,
    inverse: NominalInverse<'a>,
    /// Places of the coordinates, and of the numbers of the rotation.
    position: Vec<Places>,
    rotation: Vec<Places>,
    decimal: char,
}

impl<'a> FlangeReader<'a> {
    pub fn new(
        map: &'a MappedFlange,
        robot: &'a Robot,
        decimal: char,
        path: &Path,
        titles: Option<&[String]>,
    ) -> Result<Self, FileError> {
        let find = |source: &Source| place(path, titles, source);
        Ok(FlangeReader {
            map,
            robot,
            inverse: NominalInverse::new(robot),
            position: map.position.iter().map(|m| find(&m.source)).collect::<Result<_, _>>()?,
            rotation: map.rotation.numbers.iter().map(|(source, _)| find(source)).collect::<Result<_, _>>()?,
            decimal,
        })
    }

    /// The joints of a row, deg as text, or the reason why there are none.
    pub fn joints(&mut self, source: &StringRecord) -> Result<Vec<String>, String> {
        let mut at = Vector3::zeros();
        for (k, (mapped, places)) in self.map.position.iter().zip(&self.position).enumerate() {
            let text = value(source, places, mapped, self.decimal)?;
            at[k] = text.parse::<f64>().map_err(|_| "the position of the flange is empty")? * MM;
        }
        let turned = vector_of(source, &self.rotation, &self.map.rotation, self.decimal)?;
        let stated = Pose::from_parts(Translation3::from(at), Rotation3::new(turned));
        let flange = stated * self.map.tool.inverse();
        let root_from_last = self.robot.root.pose().inverse() * flange * self.robot.flange.pose().inverse();
        let q = self
            .inverse
            .nearest(&root_from_last, &self.map.near)
            .map_err(|why| format!("the nominal arm has no joints for the pose of the flange: {why}"))?;
        Ok(q.iter().map(|angle| number(*angle, DEG)).collect())
    }
}
