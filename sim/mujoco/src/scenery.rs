//! Scenery: bodies of arm and cell, light, colours. For display only: none of it collides or has weight.

use std::io;

use calibench::robot::solids::{Shape, Solid, Surroundings};
use calibench::units::MM;
use nalgebra::Vector3;

use super::element::{Xml, element, numbers};

/// The bodies of a cell, as known to its planner.
#[derive(Debug, Clone, Default)]
pub struct Scenery {
    /// Bodies of the arm, each on its frame, and those on the flange, on the last frame.
    moving: Vec<Solid>,
    /// Bodies that stay on the table, and those that belong to the artifact.
    fixed: Vec<Solid>,
    artifact: Vec<Solid>,
}

/// Viewpoints of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Camera {
    /// The whole cell.
    Cell,
    /// The gauge and the space in front of it.
    Gauge,
}

impl Camera {
    /// Its name in the model.
    pub fn name(self) -> &'static str {
        match self {
            Camera::Cell => "cell",
            Camera::Gauge => "gauge",
        }
    }
}

/// Half the length of a plunger's rod as rendered, m.
const ROD: f64 = 9.0 * MM;

impl Scenery {
    /// Scenery of an arm of `joints` joints with these bodies, in the surroundings `with` and `without` the artifact.
    pub fn new(arm: &[Solid], joints: usize, with: &Surroundings, without: &Surroundings) -> Self {
        let carried = with.carried.iter().map(|s| Solid { frame: joints, ..s.clone() });
        // Balls are written as bodies of their own.
        let comes_and_goes = |s: &&Solid| {
            let is_ball = matches!(s.shape, Shape::Capsule { ends: [a, b], .. } if a == b);
            !is_ball && !without.fixed.contains(s)
        };
        Scenery {
            moving: arm.iter().cloned().chain(carried).collect(),
            fixed: without.fixed.clone(),
            artifact: with.fixed.iter().filter(comes_and_goes).cloned().collect(),
        }
    }

    pub(super) fn write_settings(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "visual", {}, |xml| {
            element!(xml, "global", { "offwidth" = 1600, "offheight" = 1200, "fovy" = 38 })?;
            element!(xml, "quality", { "shadowsize" = 4096, "offsamples" = 8 })?;
            element!(xml, "headlight", { "ambient" = "0.35 0.35 0.35", "diffuse" = "0.35 0.35 0.35", "specular" = "0.1 0.1 0.1" })?;
            element!(xml, "map", { "znear" = 0.01, "zfar" = 20 })?;
            Ok(())
        })?;
        element!(xml, "statistic", { "center" = "-0.3 0 0.2", "extent" = 1.0 })?;
        element!(xml, "asset", {}, |xml| {
            element!(xml, "texture", {
                "type" = "skybox", "builtin" = "gradient", "rgb1" = "0.96 0.97 0.98", "rgb2" = "0.72 0.77 0.82", "width" = 256, "height" = 1536
            })?;
            for (name, colour, shine) in COLOURS {
                element!(xml, "material", { "name" = name, "rgba" = colour, "specular" = shine, "shininess" = shine })?;
            }
            Ok(())
        })?;
        Ok(())
    }

    pub(super) fn write_world(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "light", { "pos" = "1.2 -1.5 2.5", "dir" = "-0.5 0.55 -1", "diffuse" = "0.6 0.6 0.6", "castshadow" = "true" })?;
        element!(xml, "camera", { "name" = Camera::Cell.name(), "pos" = "1.05 -1.35 1.0", "xyaxes" = "0.80 0.60 0 -0.28 0.37 0.89" })?;
        self.fixed.iter().try_for_each(|solid| write_solid(xml, solid, "table"))
    }

    /// Writes a camera that looks along the three plungers at the ball, fixed to the tool.
    pub(super) fn write_tool(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "camera", { "name" = Camera::Gauge.name(), "pos" = "-0.10 -0.04 -0.17", "mode" = "targetbody", "target" = "tool" })?;
        Ok(())
    }

    pub(super) fn write_artifact(&self, xml: &mut Xml) -> io::Result<()> {
        self.artifact.iter().try_for_each(|solid| write_solid(xml, solid, "artifact"))
    }

    pub(super) fn write_link(&self, xml: &mut Xml, frame: usize) -> io::Result<()> {
        let last = self.moving.iter().map(|s| s.frame).max().unwrap_or(0);
        let colour = if frame == last { "gauge" } else { "arm" };
        self.moving.iter().filter(|s| s.frame == frame).try_for_each(|solid| write_solid(xml, solid, colour))
    }

    pub(super) fn write_plunger(&self, xml: &mut Xml, k: usize) -> io::Result<()> {
        element!(xml, "geom", {
            "type" = "cylinder", "size" = numbers(&[1.5 * MM, ROD]), "pos" = numbers(&[0.0, 0.0, ROD]), "contype" = 0, "conaffinity" = 0,
            "material" = format!("plunger{k}")
        })?;
        Ok(())
    }
}

/// Okabe and Ito's colours for the three axes, greys for the rest.
const COLOURS: [(&str, &str, f64); 8] = [
    ("arm", "0.93 0.55 0.18 1", 0.3),
    ("gauge", "0.55 0.60 0.66 0.35", 0.4),
    ("table", "0.80 0.80 0.78 1", 0.0),
    ("artifact", "0.62 0.66 0.70 1", 0.3),
    ("plunger0", "0.835 0.369 0 1", 0.4),
    ("plunger1", "0 0.620 0.451 1", 0.4),
    ("plunger2", "0 0.447 0.698 1", 0.4),
    ("ball", "0.30 0.32 0.36 1", 0.9),
];

fn write_solid(xml: &mut Xml, solid: &Solid, material: &str) -> io::Result<()> {
    let (kind, size, place) = match &solid.shape {
        Shape::Capsule { ends: [a, b], radius } if a != b => {
            let ends: Vec<f64> = a.iter().chain(b.iter()).copied().collect();
            ("capsule", radius.to_string(), ("fromto", numbers(&ends)))
        }
        Shape::Capsule { ends: [a, _], radius } => ("sphere", radius.to_string(), ("pos", at(a))),
        Shape::Box { centre, half_size } => ("box", at(half_size), ("pos", at(centre))),
    };
    let attributes = [("type", kind), ("size", &size), (place.0, &place.1), ("material", material)];
    let untouchable = [("contype", "0"), ("conaffinity", "0")];
    xml.create_element("geom").with_attributes(attributes.into_iter().chain(untouchable)).write_empty()?;
    Ok(())
}

fn at(v: &Vector3<f64>) -> String {
    numbers(v.as_slice())
}
