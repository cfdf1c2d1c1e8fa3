//! A URDF file as links and joints, each with its line; joint origins with their places in the text.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use nalgebra::{Unit, Vector3};

use roxmltree::{Document, Node};

use crate::files::FileError;
use crate::robot::{FramePose, JointKind, Pose};

/// A link.
pub(super) struct UrdfLink {
    pub name: String,
    pub inertial: Option<Inertial>,
}

/// Mass and its centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inertial {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the link, m.
    pub com: Vector3<f64>,
}

/// Type of a joint, as the format has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JointType {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Planar,
    Floating,
}

impl JointType {
    const ALL: [(JointType, &str); 6] = [
        (JointType::Fixed, "fixed"),
        (JointType::Revolute, "revolute"),
        (JointType::Continuous, "continuous"),
        (JointType::Prismatic, "prismatic"),
        (JointType::Planar, "planar"),
        (JointType::Floating, "floating"),
    ];

    /// Kind of a joint of an arm; a continuous one is revolute.
    pub fn moves(self) -> JointKind {
        if self == JointType::Prismatic { JointKind::Prismatic } else { JointKind::Revolute }
    }

    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }
}

/// A joint.
pub(super) struct UrdfJoint {
    pub name: String,
    pub line: usize,
    pub kind: JointType,
    /// Index of the parent link.
    pub parent: usize,
    /// Index of the child link.
    pub child: usize,
    /// Pose of the child in the parent at joint position zero.
    pub origin: Pose,
    /// Place of the origin in the text.
    pub origin_place: OriginPlace,
    /// Axis in the child.
    pub axis: Unit<Vector3<f64>>,
    /// Limits, rad, or m of a prismatic joint; `None` if it has none.
    pub limits: Option<[f64; 2]>,
    /// Name of the joint that it follows.
    pub mimics: Option<String>,
}

/// Place of an origin in the text.
#[derive(Debug, Clone)]
pub(super) enum OriginPlace {
    /// An element, the byte at which an attribute can be inserted, and the ranges of the values that it has.
    Element { insert: usize, xyz: Option<Range<usize>>, rpy: Option<Range<usize>> },
    /// No element; the byte at which one can be inserted.
    Missing { insert: usize },
}

/// The links and joints of a URDF file.
pub(super) struct UrdfDocument {
    pub name: String,
    pub links: Vec<UrdfLink>,
    pub joints: Vec<UrdfJoint>,
}

/// Largest believable coordinate, m: an arm with its rail and stand.
const FARTHEST: f64 = 100.0;

/// Largest believable mass of a link, kg.
const HEAVIEST: f64 = 1e5;

/// Reads the text of a URDF file.
struct Reader<'a> {
    path: &'a Path,
    xml: &'a Document<'a>,
}

impl UrdfDocument {
    /// # Errors
    /// With the line, if the text is not a URDF.
    pub fn read(path: &Path, text: &str) -> Result<Self, FileError> {
        let text = &without_unbound_prefixes(text);
        let xml = Document::parse(text).map_err(|e| FileError {
            line: Some(e.pos().row as usize),
            ..FileError::whole(path, format!("is not XML: {e}"), "give the file as the robot's package has it")
        })?;
        Reader { path, xml: &xml }.document()
    }
}

impl Reader<'_> {
    fn line(&self, node: Node<'_, '_>) -> usize {
        self.xml.text_pos_at(node.range().start).row as usize
    }

    fn wrong(&self, node: Node<'_, '_>, field: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        FileError { line: Some(self.line(node)), field: field.into(), ..FileError::whole(self.path, problem, remedy) }
    }

    fn document(&self) -> Result<UrdfDocument, FileError> {
        let root = self.xml.root_element();
        let is_xacro = |name: &str| name.contains("xacro");
        if let Some(node) = root.descendants().find(|n| n.tag_name().namespace().is_some_and(is_xacro)) {
            let remedy = "expand it first: `xacro FILE.xacro > FILE.urdf`";
            return Err(self.wrong(node, node.tag_name().name(), "is a xacro element", remedy));
        }
        if root.tag_name().name() != "robot" {
            let problem = format!("the file is a <{}>, not a <robot>", root.tag_name().name());
            return Err(self.wrong(root, "robot", problem, "give a URDF file"));
        }
        if children(root, "link").next().is_none() {
            return Err(self.wrong(root, "link", "the file has no links", "give the expanded file, not an include"));
        }
        let mut links: Vec<UrdfLink> = Vec::new();
        for node in children(root, "link") {
            let name = self.text(node, "name")?;
            if links.iter().any(|link| link.name == name) {
                return Err(self.wrong(node, "link", format!("'{name}' is there twice"), "give every link its own name"));
            }
            links.push(UrdfLink { inertial: self.inertial(node)?, name });
        }
        let mut joints: Vec<UrdfJoint> = Vec::new();
        for node in children(root, "joint") {
            let joint = self.joint(node, &links)?;
            if joints.iter().any(|other| other.name == joint.name) {
                let problem = format!("'{}' is there twice", joint.name);
                return Err(self.wrong(node, "joint", problem, "give every joint its own name"));
            }
            if let Some(other) = joints.iter().find(|other| other.child == joint.child) {
                let problem = format!("'{}' is the child of joint '{}' already", links[joint.child].name, other.name);
                return Err(self.wrong(
                    node,
                    "joint",
                    problem,
                    "a chain has no loops: let every link be the child of one joint",
                ));
            }
            let mut at = joint.parent;
            while let Some(above) = joints.iter().find(|other| other.child == at && at != joint.child) {
                at = above.parent;
            }
            if at == joint.child {
                let problem =
                    format!("closes a loop: '{}' is carried by '{}' already", links[joint.parent].name, links[at].name);
                return Err(self.wrong(node, "joint", problem, "a chain has no loops: let no link carry itself"));
            }
            joints.push(joint);
        }
        Ok(UrdfDocument { name: root.attribute("name").unwrap_or("robot").to_owned(), links, joints })
    }

    fn joint(&self, node: Node<'_, '_>, links: &[UrdfLink]) -> Result<UrdfJoint, FileError> {
        let name = self.text(node, "name")?;
        let kind = self.text(node, "type")?;
        let Some((kind, _)) = JointType::ALL.into_iter().find(|(_, known)| *known == kind) else {
            let known = JointType::ALL.map(|(_, name)| name).join(", ");
            return Err(self.wrong(
                node,
                "type",
                format!("'{kind}' of joint '{name}' is not a joint type"),
                &format!("use {known}"),
            ));
        };
        let link = |tag: &'static str| -> Result<usize, FileError> {
            let remedy = "name the parent and the child of every joint";
            let of = child(node, tag).ok_or_else(|| self.wrong(node, tag, format!("joint '{name}' has none"), remedy))?;
            let link = self.text(of, "link")?;
            let known = links.iter().position(|l| l.name == link);
            known.ok_or_else(|| self.wrong(of, tag, format!("there is no link '{link}'"), "name a link of the file"))
        };
        let (parent, child_link) = (link("parent")?, link("child")?);
        let (origin, origin_place) = self.origin(node)?;
        let axis = match child(node, "axis") {
            Some(axis) => self.vector(axis, "xyz")?.unwrap_or(Vector3::x()),
            // The default of the format.
            None => Vector3::x(),
        };
        let is_actuated = kind != JointType::Fixed && kind != JointType::Floating;
        let axis = Unit::try_new(axis, 1e-9).or((!is_actuated).then(Vector3::x_axis));
        let axis = axis.ok_or_else(|| {
            self.wrong(node, "axis", format!("that of joint '{name}' has no length"), "give the direction of the axis")
        })?;
        let limits = match child(node, "limit") {
            Some(limit) => {
                let end = |name: &str| Ok::<_, FileError>(self.numbers::<1>(limit, name)?.map_or(0.0, |[v]| v));
                let range = [end("lower")?, end("upper")?];
                if matches!(kind, JointType::Revolute | JointType::Prismatic) && range[0] > range[1] {
                    let problem = format!("the lower limit of joint '{name}' is above the upper one");
                    return Err(self.wrong(limit, "limit", problem, "give the range of the joint, in rad or m"));
                }
                // Both are zero in files that do not know them.
                (range[0] < range[1]).then_some(range)
            }
            None => None,
        };
        let mimics = child(node, "mimic").map(|m| self.text(m, "joint")).transpose()?;
        let line = self.line(node);
        Ok(UrdfJoint { name, line, kind, parent, child: child_link, origin, origin_place, axis, limits, mimics })
    }

    fn origin(&self, node: Node<'_, '_>) -> Result<(Pose, OriginPlace), FileError> {
        let Some(origin) = child(node, "origin") else {
            let insert = node.first_child().map_or(node.range().end, |first| first.range().start);
            return Ok((Pose::identity(), OriginPlace::Missing { insert }));
        };
        let place = |name: &str| origin.attribute_node(name).map(|attribute| attribute.range_value());
        let insert = origin.range().start + "<origin".len();
        Ok((self.pose(origin)?, OriginPlace::Element { insert, xyz: place("xyz"), rpy: place("rpy") }))
    }

    /// Roll, pitch and yaw are the angles about x, y and z of `Rz Ry Rx`.
    fn pose(&self, origin: Node<'_, '_>) -> Result<Pose, FileError> {
        let xyz = self.position(origin)?;
        let rpy = self.vector(origin, "rpy")?.unwrap_or_default();
        Ok(FramePose { xyz: xyz.into(), rz_ry_rx: [rpy.z, rpy.y, rpy.x] }.pose())
    }

    fn inertial(&self, link: Node<'_, '_>) -> Result<Option<Inertial>, FileError> {
        let Some(inertial) = child(link, "inertial") else { return Ok(None) };
        let com = match child(inertial, "origin") {
            Some(origin) => self.position(origin)?,
            None => Vector3::zeros(),
        };
        let Some(mass) = child(inertial, "mass") else { return Ok(None) };
        let value = self.numbers::<1>(mass, "value")?.map_or(0.0, |[v]| v);
        if !(0.0..=HEAVIEST).contains(&value) {
            return Err(self.wrong(mass, "mass", format!("is {value} kg"), "give the mass in kg"));
        }
        Ok(Some(Inertial { mass: value, com }))
    }

    fn position(&self, origin: Node<'_, '_>) -> Result<Vector3<f64>, FileError> {
        let xyz = self.vector(origin, "xyz")?.unwrap_or_default();
        if xyz.amax() > FARTHEST {
            return Err(self.wrong(origin, "xyz", format!("is {:.0} m away", xyz.amax()), "give it in m, as URDF has it"));
        }
        Ok(xyz)
    }

    fn text(&self, node: Node<'_, '_>, name: &str) -> Result<String, FileError> {
        let problem = || format!("<{}> has none", node.tag_name().name());
        node.attribute(name).map(str::to_owned).ok_or_else(|| self.wrong(node, name, problem(), "give it"))
    }

    fn vector(&self, node: Node<'_, '_>, name: &str) -> Result<Option<Vector3<f64>>, FileError> {
        Ok(self.numbers::<3>(node, name)?.map(Vector3::from))
    }

    /// The numbers of an attribute; `None` if there is no such attribute.
    fn numbers<const N: usize>(&self, node: Node<'_, '_>, name: &str) -> Result<Option<[f64; N]>, FileError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let numbers: Option<Vec<f64>> =
            text.split_whitespace().map(|t| t.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let numbers = numbers.and_then(|v| <[f64; N]>::try_from(v).ok());
        let what = if N == 1 { "a finite number".to_owned() } else { format!("{N} finite numbers separated by spaces") };
        numbers.map(Some).ok_or_else(|| self.wrong(node, name, format!("'{text}' is not {what}"), "give it in m and rad"))
    }
}

fn children<'a, 'i>(node: Node<'a, 'i>, tag: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.has_tag_name(tag))
}

fn child<'a, 'i>(node: Node<'a, 'i>, tag: &'static str) -> Option<Node<'a, 'i>> {
    children(node, tag).next()
}

/// Largest number of undeclared prefixes that are read over.
const UNBOUND: usize = 32;

/// The text with every element and attribute of an undeclared namespace prefix under a plain name of the same length, so that
/// places in the file stay: other readers of URDFs know no namespaces, and so many files do not declare theirs. Xacro stays,
/// since it is refused by name.
pub(super) fn without_unbound_prefixes(text: &str) -> Cow<'_, str> {
    let mut plain = Cow::Borrowed(text);
    for _ in 0..UNBOUND {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(&plain) else { break };
        if prefix == "xacro" {
            break;
        }
        let mut replaced = plain.clone().into_owned();
        for before in ["<", "</", " ", "\t", "\n"] {
            replaced = replaced.replace(&format!("{before}{prefix}:"), &format!("{before}{prefix}_"));
        }
        if replaced == plain {
            break;
        }
        plain = Cow::Owned(replaced);
    }
    plain
}
