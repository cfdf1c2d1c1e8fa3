//! The surroundings of an arm as a file: `scene.toml`, format `calibench-scene/1`, in mm. For visualisation and collision
//! avoidance.

use std::path::Path;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::solids::{Shape, Solid, Surroundings};
use crate::files::disk::write_whole;
use crate::files::{FileError, field_error, parse_toml, read_text};
use crate::units::MM;

/// The value of the key `format`.
const SCENE_FORMAT: &str = "calibench-scene/1";

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    /// In the world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    solid: Vec<Body>,
    /// On the flange, in the last frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    carried: Vec<Body>,
}

/// A box (`min_mm`, `max_mm`) or a capsule (`from_mm`, `to_mm`, `radius_mm`), as a scenario writes them.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    name: String,
    min_mm: Option<[f64; 3]>,
    max_mm: Option<[f64; 3]>,
    from_mm: Option<[f64; 3]>,
    to_mm: Option<[f64; 3]>,
    radius_mm: Option<f64>,
}

impl Surroundings {
    /// Reads a scene file: `[[solid]]` bodies are fixed in the world, `[[carried]]` bodies on the flange.
    ///
    /// # Errors
    /// When it cannot be read, a key is unknown, or a body is neither a box nor a capsule: with line and key.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = read_text(path)?;
        let document: Document = parse_toml(path, &text)?;
        if document.format != SCENE_FORMAT {
            let remedy = format!("this version reads '{SCENE_FORMAT}'");
            return Err(field_error(path, &text, "format", format!("is '{}'", document.format), &remedy));
        }
        let solids = |bodies: &[Body], table: &str| {
            let solid = |(k, body): (usize, &Body)| {
                body.solid().ok_or_else(|| {
                    let remedy = "give min_mm below max_mm for a box, or from_mm, to_mm and a positive radius_mm for a capsule";
                    let problem = format!("'{}' is neither a box nor a capsule", body.name);
                    field_error(path, &text, &format!("{table}[{k}]"), &problem, remedy)
                })
            };
            bodies.iter().enumerate().map(solid).collect::<Result<Vec<Solid>, FileError>>()
        };
        Ok(Surroundings { fixed: solids(&document.solid, "solid")?, carried: solids(&document.carried, "carried")? })
    }

    /// Writes a scene file.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let bodies = |solids: &[Solid]| solids.iter().map(Body::of).collect();
        let document = Document { format: SCENE_FORMAT.into(), solid: bodies(&self.fixed), carried: bodies(&self.carried) };
        let text = toml::to_string(&document).expect("a document of strings, numbers and tables after them is always TOML");
        write_whole(path, text.as_bytes())
    }
}

impl Body {
    fn of(solid: &Solid) -> Self {
        // To 1e-9 mm: below any significance, above conversion noise.
        let mm = |v: Vector3<f64>| Some([v.x, v.y, v.z].map(|c| (c / MM * 1e9).round() / 1e9));
        let body = Body { name: solid.name.clone(), ..Body::default() };
        match &solid.shape {
            Shape::Capsule { ends: [from, to], radius } => {
                Body { from_mm: mm(*from), to_mm: mm(*to), radius_mm: Some((radius / MM * 1e9).round() / 1e9), ..body }
            }
            Shape::Box { centre, half_size } => Body { min_mm: mm(centre - half_size), max_mm: mm(centre + half_size), ..body },
        }
    }

    /// The body; `None` if the numbers make neither shape.
    fn solid(&self) -> Option<Solid> {
        let finite = |v: [f64; 3]| v.iter().all(|c| c.is_finite()).then(|| Vector3::from(v) * MM);
        match (self.min_mm, self.max_mm, self.from_mm, self.to_mm, self.radius_mm) {
            (Some(min), Some(max), None, None, None) if (0..3).all(|k| min[k] < max[k]) => {
                let (min, max) = (finite(min)?, finite(max)?);
                Some(Solid::cuboid(&self.name, 0, (min + max) / 2.0, (max - min) / 2.0))
            }
            (None, None, Some(from), Some(to), Some(radius)) if radius > 0.0 && radius.is_finite() => {
                Some(Solid::capsule(&self.name, 0, [finite(from)?, finite(to)?], radius * MM))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_survives_its_own_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        let scene = Surroundings {
            fixed: vec![Solid::cuboid("table", 0, Vector3::new(-0.1, 0.0, -0.11), Vector3::new(0.8, 0.7, 0.05))],
            carried: vec![Solid::capsule("disks", 0, [Vector3::zeros(), Vector3::new(0.0, 0.0, -0.035)], 0.04)],
        };
        scene.write(&path).unwrap();
        let back = Surroundings::read(&path).unwrap();
        // Written to 1e-9 mm, and a box by two corners, each rounded in this way.
        let near = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).amax() < 2e-12;
        match (&back.fixed[0].shape, &scene.fixed[0].shape) {
            (Shape::Box { centre: a, half_size: h }, Shape::Box { centre: b, half_size: g }) => {
                assert!(near(a, b) && near(h, g))
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(back.carried, scene.carried);
    }

    #[test]
    fn a_body_that_is_none_is_named_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, "format = 'calibench-scene/1'\n\n[[solid]]\nname = 'plate'\nmin_mm = [0, 0, 0]\n").unwrap();
        let error = Surroundings::read(&path).unwrap_err().to_string();
        assert!(error.contains("scene.toml:3") && error.contains("'plate' is neither"), "{error}");
    }
}
