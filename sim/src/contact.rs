//! Contact of a plunger's flat disk with a ball: by geometry, and by the closed form that is checked against it.
//!
//! Tool frame: origin at the TCP, axis k from the TCP into the body of indicator k. The disk is on the + side of the ball and
//! extends along -k, so a ball pushed along +k pushes the plunger in. The tip's coordinate t is measured along the channel.

use std::array;

use calibench::cell::TriCal;
use calibench::units::MM;
use nalgebra::{Unit, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::Cylinder;

/// Radius of the disk-shaped tips, m.
pub const DISK_RADIUS: f64 = TriCal::PAPER.tip_radius;
/// Radius of the 1.5-inch master ball, m.
pub const MASTER_RADIUS: f64 = TriCal::PAPER.master_radius;
/// Radius of the 1-inch datum balls, m.
pub const DATUM_RADIUS: f64 = TriCal::PAPER.datum_radius;
/// Preset value of an indicator on the master ball, m: the difference of the two radii.
pub const MASTER_READING: f64 = MASTER_RADIUS - DATUM_RADIUS;
/// Measuring range of an indicator, m.
pub const TRAVEL: f64 = TriCal::PAPER.travel;
/// Travel of the plunger past its measuring range before its stop, m (assumed; the paper masters at the very end of the range).
pub const OVERTRAVEL: f64 = 0.1 * MM;
/// Tip coordinate of an ideally placed, free plunger, m: 12.5 mm short of the master ball.
pub const FREE_TIP: f64 = MASTER_RADIUS - TRAVEL;
/// Reading of an ideally placed, free plunger: -6.150 mm (paper section 2.1).
pub const FREE_READING: f64 = MASTER_READING - TRAVEL;
/// Thickness of the disk, m (assumed). It matters only for a ball that grazes the disk's side.
const DISK_THICKNESS: f64 = 2.0 * MM;
/// Newton iterations stop at steps of a ten-thousandth of a nanometre, m.
const SMALLEST_STEP: f64 = 1e-13;

/// Contact of a plunger on its way out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touch {
    /// No contact: the plunger is fully extended.
    Free,
    /// Contact with a ball before the end of its travel.
    At {
        /// Coordinate of the tip along the channel, m.
        tip: f64,
        /// True if the disk touches with its rim rather than its flat.
        on_rim: bool,
        /// Unit vector from the ball's centre to the point of contact, tool frame.
        normal: Vector3<f64>,
    },
    /// A ball that would push it through its stop.
    Beyond,
}

/// Line along which a disk travels, and the orientation of the disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Point of the line where the tip's coordinate is zero, m, tool frame.
    pub foot: Vector3<f64>,
    /// Direction in which the plunger is pushed in.
    pub along: Unit<Vector3<f64>>,
    /// Normal of the disk, away from the ball.
    pub normal: Unit<Vector3<f64>>,
    /// Tip coordinate of the free plunger, m.
    pub free_tip: f64,
    /// Tip coordinate of the plunger at its stop, m.
    pub stop_tip: f64,
}

impl Channel {
    /// The channel of an ideal gauge along axis `k` (0, 1, 2) of the tool frame.
    pub fn ideal(k: usize) -> Self {
        let axis = Vector3::ith_axis(k);
        Channel {
            foot: Vector3::zeros(),
            along: axis,
            normal: axis,
            free_tip: FREE_TIP,
            stop_tip: FREE_TIP + TRAVEL + OVERTRAVEL,
        }
    }

    /// Computes the contact of the disk with a ball (`centre`, `radius`, m), in closed form on the flat and by a few
    /// Newton steps on the rim.
    ///
    /// Flat: `t = (n·(c - p) + R) / (n·d)`; rim: the largest t with `(rho(t) - r_disk)^2 + (n·(c - p - t d))^2 = R^2`, where
    /// p, d and n are the channel's foot, direction and normal and rho is the distance of the ball's centre from the disk's
    /// axis.
    pub fn touch(&self, centre: &Vector3<f64>, radius: f64) -> Touch {
        let from_foot = centre - self.foot;
        let advance = self.normal.dot(&self.along);
        let flat_tip = (self.normal.dot(&from_foot) + radius) / advance;
        // Height of the ball's centre over the disk, and its distance from the disk's axis as a vector.
        let seen_from_disk = |tip: f64| {
            let x = from_foot - self.along.as_ref() * tip;
            let height = self.normal.dot(&x);
            (height, x - self.normal.as_ref() * height)
        };
        let lateral_squared = seen_from_disk(flat_tip).1.norm_squared();
        if lateral_squared <= DISK_RADIUS * DISK_RADIUS {
            return self.at(flat_tip, false, self.normal.into_inner());
        }
        let gap = |tip: f64| {
            let (height, sideways) = seen_from_disk(tip);
            let lateral = sideways.norm();
            let over = (lateral - DISK_RADIUS).max(0.0);
            let distance = (over * over + height * height).sqrt();
            let slope = if over > 0.0 { -over * sideways.dot(&self.along) / lateral } else { 0.0 } - height * advance;
            (distance - radius, slope / distance)
        };
        // This start is exact if the disk travels along its normal; if it is tilted, the estimate assumes that the whole
        // lateral motion brings the rim nearer, so the rim cannot touch before this point.
        let over = lateral_squared.sqrt() - DISK_RADIUS;
        let reach = (radius * radius - over * over).max(0.0).sqrt();
        let askew = (self.along.into_inner() - self.normal.as_ref() * advance).norm();
        let on_rim = flat_tip - (radius - reach) / advance * (1.0 - askew * over / (reach * advance));
        let start = if on_rim < flat_tip { on_rim } else { flat_tip };
        match first_touch(start, gap) {
            Some(tip) if seen_from_disk(tip).0 <= 0.0 => {
                let (height, sideways) = seen_from_disk(tip);
                let rim = sideways * (DISK_RADIUS / sideways.norm());
                self.at(tip, true, (rim - sideways - self.normal.as_ref() * height) / radius)
            }
            // The ball passes the rim or grazes the disk's side, where the disk's thickness matters.
            _ => self.touch_by_geometry(centre, radius),
        }
    }

    /// Computes the contact of the disk with a ball (`centre`, `radius`, m) by parry's exact distance of a point from a
    /// cylinder.
    ///
    /// Flat and rim are not distinguished: the disk comes in from far outside, by Newton steps on its distance from the ball.
    /// That distance is convex in t (a convex body moves on a line), so the steps never pass the first touch. Correct to 1
    /// nm, also at grazing contact.
    pub fn touch_by_geometry(&self, centre: &Vector3<f64>, radius: f64) -> Touch {
        // parry's tolerances are absolute and made for sizes near one, hence millimetres.
        let from_foot = millimetres(&(centre - self.foot));
        let (along, normal) = (unitless(&self.along), unitless(&self.normal));
        let half_thickness = 0.5 * DISK_THICKNESS / MM;
        let disk = Cylinder::new(half_thickness, DISK_RADIUS / MM);
        let turned = Rotation::from_rotation_arc(Vector::Y, normal);
        let nearest = |tip: f64| {
            let pose = Pose::from_parts(along * (tip / MM) + normal * half_thickness, turned);
            disk.project_point(&pose, from_foot, false).point
        };
        let gap = |tip: f64| {
            let to_ball = from_foot - nearest(tip);
            let distance = to_ball.length();
            (distance * MM - radius, -to_ball.dot(along) / distance)
        };
        let far = (centre - self.foot).norm() + radius + 2.0 * DISK_RADIUS;
        let Some(tip) = first_touch(far, gap) else {
            return Touch::Free;
        };
        let contact = nearest(tip);
        let from_axis = contact - along * (tip / MM);
        // Rounding of the rotated pose leaves rim points off the rim's radius by a few 1e-15 mm.
        let on_rim = (from_axis - normal * from_axis.dot(normal)).length() >= (1.0 - 1e-12) * DISK_RADIUS / MM;
        let to_contact = (contact - from_foot).normalize();
        self.at(tip, on_rim, Vector3::new(to_contact.x, to_contact.y, to_contact.z))
    }

    fn at(&self, tip: f64, on_rim: bool, normal: Vector3<f64>) -> Touch {
        if tip > self.stop_tip {
            Touch::Beyond
        } else if tip > self.free_tip {
            Touch::At { tip, on_rim, normal }
        } else {
            Touch::Free
        }
    }
}

/// The largest root of a convex `gap` (value and slope), by Newton steps from `start` above it; `None` if the gap never closes.
fn first_touch(start: f64, gap: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
    let mut tip = start;
    // A grazing touch is a double root: the steps halve, and 60 halvings reduce a metre to nothing.
    for _ in 0..60 {
        let (distance, slope) = gap(tip);
        if distance <= 0.0 {
            break;
        }
        if slope <= 0.0 {
            return None;
        }
        let step = distance / slope;
        tip -= step;
        if step < SMALLEST_STEP {
            break;
        }
    }
    Some(tip)
}

/// Returns the three readings (m) of an ideal, mastered gauge on a ball (`centre` in the tool frame, `radius`, m).
///
/// `reading_k = c_k + sqrt(R^2 - max(0, rho_k - r_disk)^2) - 12.7 mm`, rho_k being the distance of the centre from axis k;
/// -6.150 mm if nothing touches, and limited by the stop.
#[inline]
pub fn readings_closed_form(centre: [f64; 3], radius: f64) -> [f64; 3] {
    let [x, y, z] = centre;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let lateral_squared = [yy + zz, zz + xx, xx + yy];
    let reading = |c: f64, half_chord: f64| {
        (c + half_chord - (MASTER_RADIUS - MASTER_READING)).clamp(FREE_READING, MASTER_READING + OVERTRAVEL)
    };
    // All three on the flat, as in nearly all probings: no square root is needed.
    if lateral_squared.iter().all(|&square| square <= DISK_RADIUS * DISK_RADIUS) {
        return centre.map(|c| reading(c, radius));
    }
    array::from_fn(|k| {
        let over = (lateral_squared[k].sqrt() - DISK_RADIUS).max(0.0);
        let half_chord_squared = radius * radius - over * over;
        let met = reading(centre[k], half_chord_squared.max(0.0).sqrt());
        if half_chord_squared > 0.0 { met } else { FREE_READING }
    })
}

fn millimetres(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x / MM, v.y / MM, v.z / MM)
}

fn unitless(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centred_ball_stands_halfway_and_the_master_ball_at_the_end_of_the_range() {
        for k in 0..3 {
            let channel = Channel::ideal(k);
            for (radius, expected) in [(DATUM_RADIUS, DATUM_RADIUS), (MASTER_RADIUS, MASTER_RADIUS)] {
                match channel.touch(&Vector3::zeros(), radius) {
                    Touch::At { tip, on_rim: false, normal } => {
                        assert_eq!(tip, expected);
                        assert_eq!(normal, Vector3::ith(k, 1.0));
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    #[test]
    fn a_ball_beside_the_disk_leaves_the_plunger_free() {
        let channel = Channel::ideal(2);
        let just_clear = DISK_RADIUS + DATUM_RADIUS + 1e-6;
        assert_eq!(channel.touch(&Vector3::new(just_clear, 0.0, 9.0 * MM), DATUM_RADIUS), Touch::Free);
        assert_eq!(readings_closed_form([just_clear, 0.0, 6.0 * MM], DATUM_RADIUS)[2], FREE_READING);
    }

    #[test]
    fn a_ball_too_near_pushes_the_plunger_to_its_stop() {
        let beyond = Vector3::new(0.0, 0.0, MASTER_READING + 2.0 * OVERTRAVEL);
        assert_eq!(Channel::ideal(2).touch(&beyond, DATUM_RADIUS), Touch::Beyond);
        assert_eq!(Channel::ideal(2).touch_by_geometry(&beyond, DATUM_RADIUS), Touch::Beyond);
    }

    #[test]
    fn a_ball_that_is_nowhere_is_not_met() {
        for nowhere in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let centre = Vector3::new(nowhere, 0.0, 0.0);
            assert_eq!(Channel::ideal(2).touch(&centre, DATUM_RADIUS), Touch::Free);
            assert_eq!(Channel::ideal(2).touch_by_geometry(&centre, DATUM_RADIUS), Touch::Free);
        }
    }

    /// A tilted disk reads `tilt x offset` more, 1 um per mm and mrad, and is hardly affected by the size of a centred ball.
    #[test]
    fn tilt_is_crosstalk_from_the_side() {
        let tilt = 1e-3;
        let normal = Unit::new_normalize(Vector3::new(tilt, 0.0, 1.0));
        let channel = Channel { normal, ..Channel::ideal(2) };
        let tip = |x: f64, radius: f64| match channel.touch(&Vector3::new(x, 0.0, 0.0), radius) {
            Touch::At { tip, .. } => tip,
            other => panic!("{other:?}"),
        };
        assert!((tip(1.0 * MM, DATUM_RADIUS) - tip(0.0, DATUM_RADIUS) - 1e-6).abs() < 1e-12);
        let between_balls = (tip(0.0, MASTER_RADIUS) - MASTER_RADIUS) - (tip(0.0, DATUM_RADIUS) - DATUM_RADIUS);
        let second_order = 0.5 * tilt * tilt * (MASTER_RADIUS - DATUM_RADIUS);
        assert!((between_balls - second_order).abs() < 1e-14, "{between_balls}");
    }
}
