//! A `[[link]]` of a robot file, and the numbers of all its tables.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::robot::{JointKind, Link, MdhLink};
use crate::units::{DEG, MM};

/// The widest limit of a joint that turns, deg. Every full revolution of every joint is a further posture for the same pose: with
/// six joints there are 4,096.
const WIDEST_DEG: f64 = 720.0;

/// The widest limit of a prismatic joint, mm: no rail is as long.
const WIDEST_MM: f64 = 100_000.0;

/// A link and the joint that moves it.
#[derive(Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(extend("if" = is_prismatic(), "then" = of_slide(), "else" = of_turn())))]
#[serde(deny_unknown_fields)]
pub(super) struct LinkEntry {
    /// Kind of the joint; one that turns unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = ["revolute", "prismatic"])))]
    kind: Option<String>,
    /// -1 if the joint counts the other way; never written, since such a row is turned round when it is read.
    #[serde(skip_serializing)]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = [1, -1])))]
    sign: Option<f64>,
    /// Angle from the axis before to this one, about x, deg.
    alpha_deg: f64,
    /// Distance between these axes, along x, mm.
    a_mm: f64,
    /// Angle about y, only for nearly parallel axes, deg.
    #[serde(default)]
    beta_deg: f64,
    /// Angle of the row at joint position zero, deg.
    #[serde(default)]
    theta_deg: f64,
    /// Distance along the axis of the joint, of a prismatic one at position zero, mm.
    d_mm: f64,
    /// Lower limit of a joint that turns, as it counts, deg; at least -720.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = -WIDEST_DEG, max = WIDEST_DEG)))]
    min_deg: Option<f64>,
    /// Its upper limit, deg; above `min_deg`, at most 720.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = -WIDEST_DEG, max = WIDEST_DEG)))]
    max_deg: Option<f64>,
    /// Lower limit of a prismatic joint, as it counts, mm; at least -100,000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = -WIDEST_MM, max = WIDEST_MM)))]
    min_mm: Option<f64>,
    /// Its upper limit, mm; above `min_mm`, at most 100,000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = -WIDEST_MM, max = WIDEST_MM)))]
    max_mm: Option<f64>,
    /// Mass of the link, kg; 0 if unknown.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    mass_kg: f64,
    /// Centre of that mass in the frame of the link, mm; required with a mass.
    com_mm: Option<[f64; 3]>,
}

/// In the schema: what holds of a prismatic joint.
#[cfg(feature = "schema")]
fn is_prismatic() -> serde_json::Value {
    serde_json::json!({"properties": {"kind": {"const": "prismatic"}}, "required": ["kind"]})
}

/// In the schema: the limits of a prismatic joint.
#[cfg(feature = "schema")]
fn of_slide() -> serde_json::Value {
    crate::schema::of_unit("mm", "deg")
}

/// In the schema: the limits of a joint that turns.
#[cfg(feature = "schema")]
fn of_turn() -> serde_json::Value {
    crate::schema::of_unit("deg", "mm")
}

impl LinkEntry {
    pub fn of(link: &Link) -> Self {
        let MdhLink { kind, alpha, a, beta, theta, d } = link.mdh;
        let entry = LinkEntry {
            alpha_deg: written(alpha / DEG),
            a_mm: written(a / MM),
            beta_deg: written(beta / DEG),
            theta_deg: written(theta / DEG),
            d_mm: written(d / MM),
            mass_kg: written(link.mass),
            com_mm: Some(mm(&link.com)),
            ..LinkEntry::default()
        };
        let [min, max] = link.limits.map(|limit| Some(written(limit / kind.unit().si)));
        match kind {
            JointKind::Revolute => LinkEntry { min_deg: min, max_deg: max, ..entry },
            JointKind::Prismatic => LinkEntry { kind: Some(kind.name().into()), min_mm: min, max_mm: max, ..entry },
        }
    }

    /// The link, after a successful [check](Self::check).
    pub fn link(&self) -> Link {
        let kind = self.kind().unwrap_or_default();
        let [(_, min), (_, max)] = self.limits(kind);
        Link {
            mdh: MdhLink {
                kind,
                alpha: self.alpha_deg * DEG,
                a: self.a_mm * MM,
                beta: self.beta_deg * DEG,
                theta: self.theta_deg * DEG,
                d: self.d_mm * MM,
            },
            limits: [min, max].map(|limit| limit.unwrap_or_default() * kind.unit().si),
            mass: self.mass_kg,
            com: metres(&self.com_mm.unwrap_or_default()),
        }
    }

    /// True if the joint counts against the right-hand rule about its z axis.
    pub fn counts_backwards(&self) -> bool {
        self.sign == Some(-1.0)
    }

    /// Checks link `i`, counted from 0.
    pub fn check(&self, i: usize) -> Result<(), Fault> {
        let key = |name: &str| format!("link[{i}].{name}");
        let Some(kind) = self.kind() else {
            return Err((key("kind"), "is not a kind of joint", "write 'revolute' or 'prismatic'"));
        };
        if self.sign.is_some_and(|sign| sign.abs() != 1.0) {
            return Err((key("sign"), "is not a sign", "write 1, or -1 for a joint that counts the other way"));
        }
        let numbers = [
            ("alpha_deg", self.alpha_deg),
            ("a_mm", self.a_mm),
            ("beta_deg", self.beta_deg),
            ("theta_deg", self.theta_deg),
            ("d_mm", self.d_mm),
            ("mass_kg", self.mass_kg),
        ];
        if let Some((name, _)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
            return Err((key(name), "is not a finite number", "give a number"));
        }
        self.check_limits(kind).map_err(|(name, problem, remedy)| (key(&name), problem, remedy))?;
        if self.mass_kg < 0.0 {
            return Err((key("mass_kg"), "is negative", "give the mass, or 0 where it is unknown"));
        }
        match self.com_mm {
            None if self.mass_kg > 0.0 => {
                Err((key("com_mm"), "is missing", "a mass needs its centre, in the link's MDH frame"))
            }
            Some(com) if com.iter().any(|c| !c.is_finite()) => Err((key("com_mm"), "is not finite", "give three numbers")),
            _ => Ok(()),
        }
    }

    fn check_limits(&self, kind: JointKind) -> Result<(), Fault> {
        let wrong = |name: &str, problem, remedy| Err((name.to_owned(), problem, remedy));
        let (others, remedy) = match kind {
            JointKind::Revolute => (self.limits(JointKind::Prismatic), "give min_deg and max_deg, or kind = 'prismatic'"),
            JointKind::Prismatic => (self.limits(JointKind::Revolute), "give min_mm and max_mm"),
        };
        if let Some((name, _)) = others.iter().find(|(_, value)| value.is_some()) {
            let problem = match kind {
                JointKind::Revolute => "is a limit of a prismatic joint, and this one turns",
                JointKind::Prismatic => "is a limit of a joint that turns, and this one is prismatic",
            };
            return wrong(name, problem, remedy);
        }
        let limits = self.limits(kind);
        if let Some((name, _)) = limits.iter().find(|(_, value)| value.is_none()) {
            return wrong(name, "is missing", "give both limits of the joint");
        }
        let limits = limits.map(|(name, value)| (name, value.unwrap_or(f64::NAN)));
        if let Some((name, _)) = limits.iter().find(|(_, value)| !value.is_finite()) {
            return wrong(name, "is not a finite number", "give a number");
        }
        let [(min, least), (_, most)] = limits;
        if least >= most {
            return match kind {
                JointKind::Revolute => wrong(min, "is not below max_deg", "give the smallest angle first"),
                JointKind::Prismatic => wrong(min, "is not below max_mm", "give the smallest position first"),
            };
        }
        let beyond = |widest: f64| limits.iter().find(|(_, limit)| limit.abs() > widest);
        match (kind, beyond(WIDEST_DEG), beyond(WIDEST_MM)) {
            (JointKind::Revolute, Some((name, _)), _) => {
                wrong(name, "is more than two turns", "give at most 720 deg: more whole turns reach nothing new")
            }
            (JointKind::Prismatic, _, Some((name, _))) => wrong(name, "is more than 100 m", "give it in millimetres"),
            _ => Ok(()),
        }
    }

    /// The kind of the joint, if it is one.
    fn kind(&self) -> Option<JointKind> {
        match self.kind.as_deref() {
            None => Some(JointKind::Revolute),
            Some(name) => [JointKind::Revolute, JointKind::Prismatic].into_iter().find(|kind| kind.name() == name),
        }
    }

    /// The limits of a joint of this kind, by their keys.
    fn limits(&self, kind: JointKind) -> [(&'static str, Option<f64>); 2] {
        match kind {
            JointKind::Revolute => [("min_deg", self.min_deg), ("max_deg", self.max_deg)],
            JointKind::Prismatic => [("min_mm", self.min_mm), ("max_mm", self.max_mm)],
        }
    }
}

/// Key, problem and remedy.
pub(super) type Fault = (String, &'static str, &'static str);

pub(super) fn mm(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z].map(|c| written(c / MM))
}

pub(super) fn metres(mm: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(*mm).map(|c| c * MM)
}

/// Numbers in files are rounded to 1e-9 mm and deg: below any significance, above conversion noise.
pub(super) fn written(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}
