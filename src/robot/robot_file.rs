//! The robot file: any chain of revolute and prismatic joints as TOML, format `calibench-robot/1`, in mm, deg and kg.

mod link_entry;
mod turned_round;

use std::path::Path;

use serde::{Deserialize, Serialize};

use self::link_entry::{Fault, LinkEntry, metres, mm, written};
use self::turned_round::turn_round;
use super::guessed_masses::guess_masses;
use super::sites::MOST_JOINTS;
use super::solids::{Shape, Solid};
use super::urdf::{ChainEnds, robot_from_urdf};
use super::{BUILT_IN, FramePose, Robot, built_in};
use crate::files::disk::{is_file, is_there};
use crate::files::{FileError, field_error, parse_toml, read_text};
use crate::units::{DEG, MM};

/// The value of the key `format`.
pub(crate) const ROBOT_FORMAT: &str = "calibench-robot/1";

/// The value of the key `masses` where they are guessed.
const GUESSED: &str = "guessed";

/// A chain of joints, with masses and bodies where they are known.
#[derive(Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct Document {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = ROBOT_FORMAT)))]
    format: String,
    /// Short name of the robot.
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    name: String,
    /// Source of the numbers.
    #[serde(default)]
    source: String,
    /// `guessed` if the masses of the links are guessed from the geometry, as they are where none are listed; without this key
    /// they are stated ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = [GUESSED])))]
    masses: Option<String>,
    /// Turns of the motor per turn of the joint, one for every joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    gear_ratios: Vec<f64>,
    /// The first frame in the base link, `Tr Rz Ry Rx`.
    #[serde(default, skip_serializing_if = "FrameEntry::is_identity")]
    root: FrameEntry,
    /// The tool link in the last frame, `Tr Rz Ry Rx`.
    #[serde(default, skip_serializing_if = "FrameEntry::is_identity")]
    flange: FrameEntry,
    /// The links, from the base on, one for every joint: row `Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d)`, or `Rz(theta) Tz(d + q)` of a prismatic joint.
    #[cfg_attr(feature = "schema", schemars(length(min = 1, max = MOST_JOINTS)))]
    link: Vec<LinkEntry>,
    /// Bodies of the arm, for clearance.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    solid: Vec<SolidEntry>,
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn robot_schema() -> schemars::Schema {
    crate::schema::of_file::<Document>("Robot", &[])
}

/// A constant frame.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct FrameEntry {
    /// Position along x, mm.
    x_mm: f64,
    /// Position along y, mm.
    y_mm: f64,
    /// Position along z, mm.
    z_mm: f64,
    /// Rotation about z, deg.
    a_deg: f64,
    /// Then about the rotated y, deg.
    b_deg: f64,
    /// Then about the rotated x, deg.
    c_deg: f64,
}

impl FrameEntry {
    fn is_identity(&self) -> bool {
        *self == FrameEntry::default()
    }

    fn of(frame: &FramePose) -> Self {
        let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) =
            (frame.xyz.map(|v| written(v / MM)), frame.rz_ry_rx.map(|v| written(v / DEG)));
        FrameEntry { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg }
    }

    fn frame(&self) -> FramePose {
        FramePose {
            xyz: [self.x_mm, self.y_mm, self.z_mm].map(|v| v * MM),
            rz_ry_rx: [self.a_deg, self.b_deg, self.c_deg].map(|v| v * DEG),
        }
    }

    /// The first component that is not finite.
    fn not_finite(&self) -> Option<&'static str> {
        let FrameEntry { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg } = *self;
        let all = [("x_mm", x_mm), ("y_mm", y_mm), ("z_mm", z_mm), ("a_deg", a_deg), ("b_deg", b_deg), ("c_deg", c_deg)];
        all.into_iter().find(|(_, v)| !v.is_finite()).map(|(name, _)| name)
    }
}

/// A capsule (`from_mm`, `to_mm`, `radius_mm`) or a box (`centre_mm`, `half_size_mm`).
#[derive(Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct SolidEntry {
    /// Name of the body.
    name: String,
    /// Frame that carries it: 0 is the base, k the frame of link k.
    frame: usize,
    /// One end of the axis of a capsule, mm.
    from_mm: Option<[f64; 3]>,
    /// The other end, mm.
    to_mm: Option<[f64; 3]>,
    /// Radius of the capsule, mm.
    radius_mm: Option<f64>,
    /// Centre of a box, mm.
    centre_mm: Option<[f64; 3]>,
    /// Half the size of the box along each axis, mm.
    half_size_mm: Option<[f64; 3]>,
}

/// A robot as a dataset, a scenario or an option names it: `ur10`, `arm.toml`, `arm.urdf`, or `arm.urdf#BASE:TOOL` with the names
/// of the first and the last link.
///
/// ```
/// use calibench::robot::robot_file::RobotReference;
///
/// let reference = RobotReference::parse("arm.urdf#pedestal:tool0");
/// assert_eq!(reference.name, "arm.urdf");
/// assert_eq!(reference.ends.base.as_deref(), Some("pedestal"));
/// assert_eq!(reference.ends.tool.as_deref(), Some("tool0"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotReference<'a> {
    /// A built-in name, or a path.
    pub name: &'a str,
    /// Links between which the chain of a URDF file is taken.
    pub ends: ChainEnds,
}

impl<'a> RobotReference<'a> {
    /// Reads a reference.
    #[must_use]
    pub fn parse(text: &'a str) -> Self {
        let named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        match text.rsplit_once('#').filter(|(path, _)| is_urdf(Path::new(path))) {
            None => RobotReference { name: text, ends: ChainEnds::default() },
            Some((name, links)) => {
                let (base, tool) = links.split_once(':').unwrap_or(("", links));
                RobotReference { name, ends: ChainEnds { base: named(base), tool: named(tool) } }
            }
        }
    }

    /// True if the robot is built in, or its file is in the folder.
    #[must_use]
    pub fn is_in(&self, folder: &Path) -> bool {
        BUILT_IN.contains(&self.name) || is_file(&folder.join(self.name))
    }
}

fn is_urdf(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("urdf"))
}

/// Loads a robot: `reference` is a built-in name, or a path relative to the folder `relative_to`; see [`RobotReference`].
///
/// ```
/// use std::path::Path;
///
/// use calibench::robot::robot_file::robot;
///
/// assert_eq!(robot("panda", Path::new("campaign"))?.joints(), 7);
/// assert!(robot("panda.toml", Path::new("campaign")).is_err_and(|e| e.path == Path::new("campaign/panda.toml")));
/// # Ok::<(), calibench::files::FileError>(())
/// ```
///
/// # Errors
/// When the name is not built in and there is no such file, or the file is not a robot.
pub fn robot(reference: &str, relative_to: &Path) -> Result<Robot, FileError> {
    let RobotReference { name: reference, ends } = RobotReference::parse(reference);
    if let Some(robot) = built_in(reference) {
        return Ok(robot);
    }
    let path = relative_to.join(reference);
    if !is_there(&path) {
        let remedy = format!("name a robot file, or one of the built-in robots: {}", BUILT_IN.join(", "));
        return Err(FileError::whole(&path, format!("there is no robot '{reference}'"), remedy));
    }
    if is_urdf(&path) { robot_from_urdf(&path, &ends).map(|urdf| urdf.robot) } else { load_robot(&path) }
}

/// Reads a robot file; without masses, the robot gets [guessed](Robot::masses_guessed) ones.
///
/// # Errors
/// When it cannot be read, a key is unknown, missing or of the wrong type, or a number is impossible: with line and key.
pub fn load_robot(path: &Path) -> Result<Robot, FileError> {
    robot_from_toml(path, &read_text(path)?)
}

fn robot_from_toml(path: &Path, text: &str) -> Result<Robot, FileError> {
    let document: Document = parse_toml(path, text)?;
    let wrong = |key: &str, problem: &str, remedy: &str| field_error(path, text, key, problem, remedy);
    if document.format != ROBOT_FORMAT {
        let problem = format!("is '{}'", document.format);
        return Err(wrong("format", &problem, &format!("this version reads '{ROBOT_FORMAT}'")));
    }
    if document.name.trim().is_empty() {
        return Err(wrong("name", "is empty", "give the robot a short name"));
    }
    if document.masses.as_ref().is_some_and(|masses| masses != GUESSED) {
        return Err(wrong("masses", "is not 'guessed'", "leave the key out where the masses are stated ones"));
    }
    let joints = document.link.len();
    if joints == 0 {
        return Err(wrong("link", "has no entries", "give one [[link]] for every joint"));
    }
    if joints > MOST_JOINTS {
        let remedy = format!("an arm has no more than {MOST_JOINTS} joints");
        return Err(wrong("link", &format!("has {joints} entries"), &remedy));
    }
    for (i, link) in document.link.iter().enumerate() {
        link.check(i).map_err(|(key, problem, remedy)| wrong(&key, problem, remedy))?;
    }
    if !document.gear_ratios.is_empty() && document.gear_ratios.len() != joints {
        let problem = format!("has {} entries for {joints} joints", document.gear_ratios.len());
        return Err(wrong("gear_ratios", &problem, "give one ratio for every joint, or leave the key out"));
    }
    if document.gear_ratios.iter().any(|r| !(r.is_finite() && *r > 0.0)) {
        return Err(wrong("gear_ratios", "has a ratio that is not positive", "give motor turns per turn of the joint"));
    }
    for (table, entry) in [("root", &document.root), ("flange", &document.flange)] {
        if let Some(name) = entry.not_finite() {
            return Err(wrong(&format!("{table}.{name}"), "is not a finite number", "give a number"));
        }
    }
    let mut solids = Vec::with_capacity(document.solid.len());
    for (k, entry) in document.solid.iter().enumerate() {
        let solid = solid_of(k, entry, joints).map_err(|(key, problem, remedy)| wrong(&key, problem, remedy))?;
        solids.push(solid);
    }
    let mut robot = Robot {
        name: document.name,
        source: document.source,
        links: document.link.iter().map(LinkEntry::link).collect(),
        gear_ratios: document.gear_ratios,
        solids,
        root: document.root.frame(),
        flange: document.flange.frame(),
        masses_guessed: document.masses.is_some(),
    };
    for (i, _) in document.link.iter().enumerate().filter(|(_, link)| link.counts_backwards()) {
        turn_round(&mut robot, i);
    }
    // Guessed masses are kept as they are written: the compliances of a calibration beside them were fitted to these.
    robot.masses_guessed &= robot.has_masses();
    guess_masses(&mut robot);
    Ok(robot)
}

fn solid_of(k: usize, entry: &SolidEntry, joints: usize) -> Result<Solid, Fault> {
    let key = |name: &str| format!("solid[{k}].{name}");
    if entry.frame > joints {
        return Err((key("frame"), "is beyond the last link", "0 is the base, k the frame of link k"));
    }
    let points = [entry.from_mm, entry.to_mm, entry.centre_mm, entry.half_size_mm];
    if points.iter().flatten().flatten().chain(&entry.radius_mm).any(|v| !v.is_finite()) {
        return Err((format!("solid[{k}]"), "has a number that is not finite", "give numbers"));
    }
    let shape = match (entry.from_mm, entry.to_mm, entry.radius_mm, entry.centre_mm, entry.half_size_mm) {
        (Some(from), Some(to), Some(radius), None, None) => {
            if radius <= 0.0 {
                return Err((key("radius_mm"), "is not positive", "give the radius of the capsule"));
            }
            Shape::Capsule { ends: [metres(&from), metres(&to)], radius: radius * MM }
        }
        (None, None, None, Some(centre), Some(half_size)) => {
            if half_size.iter().any(|h| *h <= 0.0) {
                return Err((key("half_size_mm"), "is not positive", "give half the size along each axis"));
            }
            Shape::Box { centre: metres(&centre), half_size: metres(&half_size) }
        }
        _ => {
            let remedy = "give from_mm, to_mm and radius_mm (a capsule), or centre_mm and half_size_mm (a box)";
            return Err((format!("solid[{k}]"), "is neither a capsule nor a box", remedy));
        }
    };
    Ok(Solid { name: entry.name.clone(), frame: entry.frame, shape })
}

/// The robot as the text of a robot file.
pub fn to_toml(robot: &Robot) -> String {
    let solid = |s: &Solid| {
        let entry = SolidEntry { name: s.name.clone(), frame: s.frame, ..SolidEntry::default() };
        match &s.shape {
            Shape::Capsule { ends, radius } => SolidEntry {
                from_mm: Some(mm(&ends[0])),
                to_mm: Some(mm(&ends[1])),
                radius_mm: Some(written(radius / MM)),
                ..entry
            },
            Shape::Box { centre, half_size } => {
                SolidEntry { centre_mm: Some(mm(centre)), half_size_mm: Some(mm(half_size)), ..entry }
            }
        }
    };
    let document = Document {
        format: ROBOT_FORMAT.into(),
        name: robot.name.clone(),
        source: robot.source.clone(),
        masses: robot.masses_guessed.then(|| GUESSED.into()),
        gear_ratios: robot.gear_ratios.clone(),
        root: FrameEntry::of(&robot.root),
        flange: FrameEntry::of(&robot.flange),
        link: robot.links.iter().map(LinkEntry::of).collect(),
        solid: robot.solids.iter().map(solid).collect(),
    };
    toml::to_string(&document).expect("a document of strings, numbers and tables after them is always TOML")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::robot::{JointKind, MdhLink};

    const GOOD: &str = "format = 'calibench-robot/1'
name = 'two'
gear_ratios = [100.0, 80]

[[link]]
alpha_deg = 0.0
a_mm = 0
d_mm = 400.0
min_deg = -170.0
max_deg = 170.0
mass_kg = 8.0
com_mm = [1.0, 2.0, 3.0]

[[link]]
alpha_deg = 90.0
a_mm = 25.0
d_mm = 0.0
min_deg = -100.0
max_deg = 100.0

[[solid]]
name = 'base'
frame = 0
from_mm = [0.0, 0.0, 0.0]
to_mm = [0.0, 0.0, 100.0]
radius_mm = 80.0
";

    fn read(text: &str) -> Result<Robot, FileError> {
        robot_from_toml(Path::new("two.toml"), text)
    }

    #[test]
    fn built_in_robots_survive_their_own_file() {
        for name in BUILT_IN {
            let robot = built_in(name).unwrap();
            let back = read(&to_toml(&robot)).unwrap();
            assert_eq!((&back.name, &back.source, &back.gear_ratios), (&robot.name, &robot.source, &robot.gear_ratios));
            for (read, written) in back.links.iter().zip(&robot.links) {
                // Written to 1e-9 mm and deg, so within half of that.
                let angle = |m: &MdhLink| Vector3::new(m.alpha, m.beta, m.theta);
                assert!((angle(&read.mdh) - angle(&written.mdh)).amax() < 1e-11);
                assert!((read.mdh.a - written.mdh.a).abs() < 1e-12 && (read.mdh.d - written.mdh.d).abs() < 1e-12);
                assert!(
                    (read.limits[0] - written.limits[0]).abs() < 1e-11 && (read.limits[1] - written.limits[1]).abs() < 1e-11
                );
                assert!((read.com - written.com).amax() < 1e-12 && (read.mass - written.mass).abs() < 1e-9);
            }
            assert_eq!(back.links.len(), robot.links.len());
            assert_eq!(back.solids.len(), robot.solids.len());
            assert_eq!(to_toml(&back), to_toml(&robot));
        }
    }

    #[test]
    fn a_small_file_is_read_with_its_defaults() {
        let robot = read(GOOD).unwrap();
        assert_eq!(robot.joints(), 2);
        assert_eq!(robot.gear_ratios, [100.0, 80.0]);
        assert_eq!(robot.links[0].com, Vector3::new(1.0, 2.0, 3.0) * MM);
        assert_eq!((robot.links[1].mass, robot.links[1].mdh.beta, robot.links[1].mdh.theta), (0.0, 0.0, 0.0));
        assert_eq!(robot.solids[0].name, "base");
    }

    #[test]
    fn every_fault_is_named_with_line_key_and_remedy() {
        let faults = [
            ("calibench-robot/1", "calibench-robot/9", 1, "format"),
            ("name = 'two'", "name = ''", 2, "name"),
            ("[100.0, 80]", "[100.0]", 3, "gear_ratios"),
            ("[100.0, 80]", "[100.0, -80]", 3, "gear_ratios"),
            ("a_mm = 25.0", "a_mm = nan", 16, "link[1].a_mm"),
            ("d_mm = 400.0", "d_mm = inf", 8, "link[0].d_mm"),
            ("a_mm = 25.0", "a_mm = '25'", 16, "link[1].a_mm"),
            ("a_mm = 25.0", "a_cm = 2.5", 16, "link[1].a_cm"),
            ("a_mm = 25.0\n", "", 14, "link[1].a_mm"),
            ("min_deg = -100.0", "min_deg = 100.0", 18, "link[1].min_deg"),
            ("mass_kg = 8.0", "mass_kg = -8.0", 11, "link[0].mass_kg"),
            ("com_mm = [1.0, 2.0, 3.0]", "com_mm = [1.0, 2.0]", 12, "link[0].com_mm"),
            ("com_mm = [1.0, 2.0, 3.0]", "", 5, "link[0].com_mm"),
            ("frame = 0", "frame = 3", 23, "solid[0].frame"),
            ("radius_mm = 80.0", "radius_mm = 0.0", 26, "solid[0].radius_mm"),
            ("radius_mm = 80.0", "", 21, "solid[0]"),
            ("to_mm = [0.0, 0.0, 100.0]", "to_mm = [0.0, nan, 100.0]", 25, "solid[0].to_mm[1]"),
        ];
        for (good, bad, line, field) in faults {
            assert!(GOOD.contains(good), "{good}");
            let error = read(&GOOD.replacen(good, bad, 1)).expect_err(bad);
            assert_eq!((error.line, error.field.as_str()), (Some(line), field), "{bad}: {error}");
            assert!(!error.problem.is_empty() && !error.remedy.is_empty());
        }
        assert_eq!(read("format = 'calibench-robot/1'\nname = 'x'\nlink = []\n").unwrap_err().field, "link");
    }

    #[test]
    fn a_prismatic_joint_has_its_limits_in_millimetres() {
        let rail = GOOD.replacen("min_deg = -170.0\nmax_deg = 170.0", "kind = 'prismatic'\nmin_mm = 0\nmax_mm = 2500.0", 1);
        let robot = read(&rail).unwrap();
        assert_eq!((robot.kind(0), robot.kind(1)), (JointKind::Prismatic, JointKind::Revolute));
        assert_eq!(robot.links[0].limits, [0.0, 2.5]);
        assert_eq!(read(&to_toml(&robot)).unwrap().links[0], robot.links[0]);
        for (good, bad, line, field) in [
            ("kind = 'prismatic'", "kind = 'sliding'", 9, "link[0].kind"),
            ("kind = 'prismatic'", "kind = 'revolute'", 10, "link[0].min_mm"),
            ("min_mm = 0\n", "min_deg = 0\n", 10, "link[0].min_deg"),
            ("min_mm = 0\n", "", 5, "link[0].min_mm"),
            ("min_mm = 0\n", "min_mm = 2500.0\n", 10, "link[0].min_mm"),
            ("max_mm = 2500.0", "max_mm = 2500000.0", 11, "link[0].max_mm"),
            ("max_mm = 2500.0", "max_mm = nan", 11, "link[0].max_mm"),
            ("kind = 'prismatic'", "kind = 'prismatic'\nsign = 2", 10, "link[0].sign"),
        ] {
            assert!(rail.contains(good), "{good}");
            let error = read(&rail.replacen(good, bad, 1)).expect_err(bad);
            assert_eq!((error.line, error.field.as_str()), (Some(line), field), "{bad}: {error}");
        }
    }

    #[test]
    fn a_reference_is_a_name_or_a_path() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("two.toml"), GOOD).unwrap();
        assert_eq!(robot("panda", folder.path()).unwrap().joints(), 7);
        assert_eq!(robot("two.toml", folder.path()).unwrap().name, "two");
        assert!(robot("three.toml", folder.path()).unwrap_err().remedy.contains("kr6_r700"));
        std::fs::write(folder.path().join("empty.toml"), "").unwrap();
        assert!(robot("empty.toml", folder.path()).is_err());
    }
}
