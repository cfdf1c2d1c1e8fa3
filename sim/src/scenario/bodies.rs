//! Bodies in the cell and on the flange, which must not touch.

use calibench::files::FileError;
use calibench::robot::solids::{Solid, Surroundings};
use calibench::units::MM;
use nalgebra::Vector3;

use super::keys::{CarriedToml, ScenarioToml, SolidToml};
use super::sources::Sources;
use crate::contact::DATUM_RADIUS;

/// The bodies of a cell.
#[derive(Debug, Clone)]
pub(super) struct Bodies {
    /// Permanent bodies of the cell.
    fixed: Vec<Solid>,
    /// Bodies removed with the artifact: its parts, and the balls.
    artifact: Vec<Solid>,
    /// Bodies on the flange.
    carried: Vec<Solid>,
}

impl Bodies {
    /// These bodies, of which none is removed with the artifact.
    pub fn permanent(Surroundings { fixed, carried }: Surroundings) -> Self {
        Bodies { fixed, artifact: Vec::new(), carried }
    }

    /// The bodies that a scenario describes.
    pub fn of(toml: &ScenarioToml, joints: usize, sources: &Sources) -> Result<Self, FileError> {
        let mut bodies = Bodies { fixed: Vec::new(), artifact: Vec::new(), carried: Vec::new() };
        for (k, solid) in toml.solids.iter().enumerate() {
            let body = Written::from(solid).body(&format!("solid[{k}]"), joints, sources)?;
            if solid.on_artifact { &mut bodies.artifact } else { &mut bodies.fixed }.push(body);
        }
        for (k, carried) in toml.carried.iter().enumerate() {
            bodies.carried.push(Written::from(carried).body(&format!("carried[{k}]"), joints, sources)?);
        }
        bodies.artifact.extend(toml.balls.iter().map(|b| {
            let centre = Vector3::new(b.x_mm, b.y_mm, b.z_mm) * MM;
            Solid::ball(&b.id, centre, DATUM_RADIUS)
        }));
        Ok(bodies)
    }

    /// All bodies.
    pub fn with_artifact(&self) -> Surroundings {
        let fixed = self.fixed.iter().chain(&self.artifact).cloned().collect();
        Surroundings { fixed, carried: self.carried.clone() }
    }

    /// Bodies that remain when the artifact has been removed.
    pub fn without_artifact(&self) -> Surroundings {
        Surroundings { fixed: self.fixed.clone(), carried: self.carried.clone() }
    }
}

/// A box or a capsule as specified in the file.
struct Written<'a> {
    name: &'a str,
    corners: [Option<[f64; 3]>; 2],
    ends: [Option<[f64; 3]>; 2],
    radius: Option<f64>,
}

impl<'a> From<&'a SolidToml> for Written<'a> {
    fn from(s: &'a SolidToml) -> Self {
        Written { name: &s.name, corners: [s.min_mm, s.max_mm], ends: [s.from_mm, s.to_mm], radius: s.radius_mm }
    }
}

impl<'a> From<&'a CarriedToml> for Written<'a> {
    fn from(s: &'a CarriedToml) -> Self {
        Written { name: &s.name, corners: [s.min_mm, s.max_mm], ends: [s.from_mm, s.to_mm], radius: s.radius_mm }
    }
}

impl Written<'_> {
    fn body(&self, key: &str, joints: usize, sources: &Sources) -> Result<Solid, FileError> {
        let v = |a: [f64; 3]| Vector3::from(a) * MM;
        match (self.corners, self.ends, self.radius) {
            ([Some(min), Some(max)], [None, None], None) if (0..3).all(|i| min[i] < max[i]) => {
                Ok(Solid::cuboid(self.name, joints, (v(min) + v(max)) / 2.0, (v(max) - v(min)) / 2.0))
            }
            ([None, None], [Some(from), Some(to)], Some(radius)) if radius > 0.0 => {
                Ok(Solid::capsule(self.name, joints, [v(from), v(to)], radius * MM))
            }
            _ => Err(sources.wrong(
                key,
                format!("'{}' is neither a box nor a capsule", self.name),
                "give min_mm below max_mm for a box, or from_mm, to_mm and a positive radius_mm for a capsule",
            )),
        }
    }
}
