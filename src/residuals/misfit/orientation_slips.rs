//! Ways in which the numbers of an orientation are misread: another form, other columns, another unit or sign, the inverse, a
//! left-handed frame. A reading is put back into its numbers, and these are read as what they should have been.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::robot::rotation_vector;
use crate::units::DEG;

/// A form of three numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// About Z, then the new Y, then the new X (A, B, C; roll, pitch and yaw backwards).
    Zyx,
    /// About X, then the new Y, then the new Z.
    Xyz,
    /// About Z, then the new Y, then the new Z.
    Zyz,
    /// A rotation vector.
    Vector,
}

impl Form {
    const ALL: [Form; 4] = [Form::Zyx, Form::Xyz, Form::Zyz, Form::Vector];

    fn rotation(self, n: [f64; 3]) -> Rotation3<f64> {
        let about = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
        let [x, y, z] = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
        match self {
            Form::Zyx => about(z, n[0]) * about(y, n[1]) * about(x, n[2]),
            Form::Xyz => about(x, n[0]) * about(y, n[1]) * about(z, n[2]),
            Form::Zyz => about(z, n[0]) * about(y, n[1]) * about(z, n[2]),
            Form::Vector => Rotation3::new(Vector3::from(n)),
        }
    }

    /// The numbers that state a rotation in this form: both solutions of the angles.
    fn numbers(self, r: &Rotation3<f64>) -> Vec<[f64; 3]> {
        let m = r.matrix();
        match self {
            Form::Vector => {
                let v = rotation_vector(r);
                let other = v - v.normalize() * TAU;
                vec![v.into(), other.into()].into_iter().filter(|v: &[f64; 3]| v.iter().all(|x| x.is_finite())).collect()
            }
            Form::Zyz => {
                let b = m[(2, 2)].clamp(-1.0, 1.0).acos();
                let (a, c) = (m[(1, 2)].atan2(m[(0, 2)]), m[(2, 1)].atan2(-m[(2, 0)]));
                vec![[a, b, c], [a + PI, -b, c + PI]]
            }
            Form::Zyx => {
                let (c, b, a) = r.euler_angles();
                vec![[a, b, c], [a + PI, PI - b, c + PI]]
            }
            Form::Xyz => {
                let (c, b, a) = r.inverse().euler_angles();
                vec![[-c, -b, -a], [PI - c, PI + b, PI - a]]
            }
        }
        .into_iter()
        .map(|n| if self == Form::Vector { n } else { n.map(within_a_turn) })
        .collect()
    }

    fn words(self) -> &'static str {
        match self {
            Form::Zyx => "angles about z, y and x (abc)",
            Form::Xyz => "angles about x, y and z",
            Form::Zyz => "angles about z, y and z",
            Form::Vector => "a rotation vector",
        }
    }
}

/// A way in which an orientation was misread.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Misread {
    /// Numbers of one form read as another, in other columns, with other signs, in another unit.
    Numbers { read: Form3, meant: Form3, columns: [usize; 3], signs: [f64; 3], unit: f64 },
    /// A quaternion with its numbers in other columns, and other signs.
    Quaternion { columns: [usize; 4], signs: [f64; 4] },
    /// The inverse, which is also a matrix read by rows for columns.
    Inverse,
    /// Columns of the matrix in another order or of another sign; the axes of the tool.
    Axes { columns: [usize; 3], signs: [f64; 3], inverse: bool, left: bool },
    /// Seen in a left-handed frame, whose z counts the other way.
    LeftHanded,
}

/// A form, opaque outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form3(Form);

/// Orders in which three columns may be read.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
/// Units of an angle that are confused: radians for degrees, gon for degrees and degrees for gon.
const UNITS: [f64; 4] = [1.0, 1.0 / DEG, 0.9, 1.0 / 0.9];

fn signs() -> impl Iterator<Item = [f64; 3]> {
    (0..8).map(|k: u32| [0, 1, 2].map(|b| if k >> b & 1 == 1 { -1.0 } else { 1.0 }))
}

/// Every way that is tried.
pub(super) fn all() -> Vec<Misread> {
    let mut all = vec![Misread::Inverse, Misread::LeftHanded];
    for read in [Form::Zyx, Form::Xyz, Form::Vector] {
        for meant in Form::ALL {
            for columns in ORDERS {
                for signs in signs() {
                    for unit in UNITS {
                        let (read, meant) = (Form3(read), Form3(meant));
                        all.push(Misread::Numbers { read, meant, columns, signs, unit });
                    }
                }
            }
        }
    }
    for a in 0..4 {
        for b in (0..4).filter(|b| *b != a) {
            for c in (0..4).filter(|c| *c != a && *c != b) {
                let columns = [a, b, c, 6 - a - b - c];
                for [x, y, z] in signs() {
                    all.push(Misread::Quaternion { columns, signs: [x, y, z, 1.0] });
                }
            }
        }
    }
    for columns in ORDERS {
        for signs in signs() {
            for (inverse, left) in [(false, false), (true, false), (false, true), (true, true)] {
                all.push(Misread::Axes { columns, signs, inverse, left });
            }
        }
    }
    all.retain(|m| m.changes() > 0);
    all
}

impl Misread {
    /// Number of things that were wrong.
    pub fn changes(&self) -> usize {
        let negative = |signs: &[f64]| signs.iter().filter(|s| **s < 0.0).count();
        let moved = |columns: &[usize]| usize::from(columns.iter().enumerate().any(|(k, c)| *c != k));
        match self {
            Misread::Numbers { read, meant, columns, signs, unit } => {
                2 * usize::from(read != meant) + 2 * moved(columns) + negative(signs) + usize::from(*unit != 1.0)
            }
            Misread::Quaternion { columns, signs } => {
                // Real part first or last, as they are mostly confused.
                let usual = [[3, 0, 1, 2], [1, 2, 3, 0]].contains(columns);
                if usual { 1 + negative(signs) } else { 2 * moved(columns) + negative(signs).min(4 - negative(signs)) }
            }
            Misread::Inverse => 1,
            Misread::LeftHanded => 2,
            Misread::Axes { columns, signs, inverse, .. } => {
                let any = moved(columns) + negative(signs);
                if any == 0 { 0 } else { 2 + any + usize::from(*inverse) }
            }
        }
    }

    /// What was meant by a reading: more than one rotation where its numbers may have been wrapped into a turn.
    pub fn readings(&self, r: &Rotation3<f64>) -> Vec<Rotation3<f64>> {
        match self {
            Misread::Numbers { read, meant, columns, signs, unit } => {
                let mut all = Vec::new();
                for n in read.0.numbers(r) {
                    for turns in wraps(*unit, read.0 == Form::Vector) {
                        let n = [0, 1, 2].map(|k| (n[columns[k]] + turns[columns[k]] * TAU) * unit * signs[k]);
                        all.push(meant.0.rotation(n));
                    }
                }
                all
            }
            Misread::Quaternion { columns, signs } => {
                let q = UnitQuaternion::from_rotation_matrix(r).into_inner();
                let q = [q.i, q.j, q.k, q.w];
                let n: [f64; 4] = [0, 1, 2, 3].map(|k| q[columns[k]] * signs[k]);
                vec![UnitQuaternion::from_quaternion(Quaternion::new(n[3], n[0], n[1], n[2])).to_rotation_matrix()]
            }
            Misread::Inverse => vec![r.inverse()],
            Misread::LeftHanded => {
                let v = rotation_vector(r);
                vec![Rotation3::new(Vector3::new(-v.x, -v.y, v.z))]
            }
            Misread::Axes { columns, signs, inverse, left } => {
                let mut change = Matrix3::zeros();
                (0..3).for_each(|k| change[(columns[k], k)] = signs[k]);
                let m = if *inverse { r.matrix().transpose() } else { *r.matrix() };
                // On one side the change is absorbed by the tool; a mirror has to act on both.
                let changed = if change.determinant() < 0.0 {
                    change * m * change.transpose()
                } else if *left {
                    change * m
                } else {
                    m * change
                };
                vec![Rotation3::from_matrix_unchecked(changed)]
            }
        }
    }

    /// Name in files.
    pub fn name(&self) -> String {
        match self {
            Misread::Numbers { read, meant, columns, signs, unit } => {
                let parts = [
                    (read != meant, "orientation_form"),
                    (*columns != [0, 1, 2], "orientation_columns"),
                    (signs.iter().any(|s| *s < 0.0), "orientation_sign"),
                    (*unit != 1.0, "orientation_unit"),
                ];
                let named: Vec<&str> = parts.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
                named.join("+")
            }
            Misread::Quaternion { columns, .. } if *columns == [0, 1, 2, 3] => "orientation_sign".into(),
            Misread::Quaternion { .. } => "orientation_form".into(),
            Misread::Inverse => "orientation_inverse".into(),
            Misread::Axes { .. } => "orientation_columns".into(),
            Misread::LeftHanded => "orientation_left_handed".into(),
        }
    }

    /// The correction, as the beginning of a sentence that continues with "leaves 0.1 instead of 28 deg".
    pub fn words(&self) -> String {
        match self {
            Misread::Numbers { read, meant, columns, signs, unit } => {
                let mut words = String::from("the numbers of the orientations ");
                let mut parts = Vec::new();
                if read != meant {
                    parts.push(format!("taken as {} instead of {}", meant.0.words(), read.0.words()));
                }
                if *columns != [0, 1, 2] {
                    parts.push(format!("in the order {}", columns.map(|c| (c + 1).to_string()).join(", ")));
                }
                let other: Vec<String> = (0..3).filter(|k| signs[*k] < 0.0).map(|k| (k + 1).to_string()).collect();
                if !other.is_empty() {
                    parts.push(format!("with number {} of the other sign", other.join(" and ")));
                }
                match *unit {
                    u if u > 2.0 => parts.push("taken as radians where degrees are stated".into()),
                    u if u < 1.0 => parts.push("taken as gon (400 to the turn) where degrees are stated".into()),
                    u if u > 1.0 => parts.push("taken as degrees where gon are stated".into()),
                    _ => {}
                }
                words += &parts.join(" and ");
                words
            }
            Misread::Quaternion { columns: [3, 0, 1, 2] | [1, 2, 3, 0], .. } => {
                "the real part of the quaternions taken from the other end (quaternion_xyzw for quaternion_wxyz, or the reverse)".into()
            }
            Misread::Quaternion { columns, signs } => {
                let of = |k: usize| format!("{}{}", if signs[k] < 0.0 { "-" } else { "" }, ["x", "y", "z", "w"][columns[k]]);
                format!("the numbers of the quaternions taken as {}", [0, 1, 2, 3].map(of).join(", "))
            }
            Misread::Inverse => "the orientations inverted (a matrix by rows for columns, or the world in the tool)".into(),
            Misread::Axes { columns, signs, inverse, .. } => {
                let of = |k: usize| format!("{}{}", if signs[k] < 0.0 { "-" } else { "" }, ["x", "y", "z"][columns[k]]);
                let inverse = if *inverse { ", inverted," } else { "" };
                format!("the axes of the orientations{inverse} taken as {}", [0, 1, 2].map(of).join(", "))
            }
            Misread::LeftHanded => "the orientations taken as those of a left-handed frame (mirrored)".into(),
        }
    }
}

/// Whole turns that numbers of another unit may have lost.
fn wraps(unit: f64, vector: bool) -> Vec<[f64; 3]> {
    let turns: &[f64] = if unit < 1.0 && !vector { &[0.0, 1.0, -1.0] } else { &[0.0] };
    let mut all = Vec::new();
    for a in turns {
        for b in turns.iter().take(1) {
            for c in turns {
                all.push([*a, *b, *c]);
            }
        }
    }
    all
}

fn within_a_turn(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}
