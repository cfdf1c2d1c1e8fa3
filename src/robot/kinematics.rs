//! Forward kinematics of a deviating arm, and the exact columns of its position Jacobian, of one posture or of several at once.
//!
//! `T_world_tool = T(base) * prod_i [ flex_{i-1} Rx(alpha) Tx(a) Ry(beta) Rz(q + theta) Tz(d) ] * flex_n * tool` (paper Eq. 1, 2, 5, 6).
//! Every site of deviation is a screw, so its column is either an axis, or `axis x (tcp - point)`: exact, with no differences taken.
//!
//! What is written here works on a number of each of several [`Postures`], in lanes; the [`Posture`] is the instance of one lane, and has
//! the bytes that it has among others.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::frame::Frames;
use super::lanes::{Axes, Group, Numbers, Vector, in_lanes};
use super::{Axis6, Frame, FramePose, MdhEntry, Pose, Robot, Site, SiteIndex, Vectors, turns};

/// Sine and cosine of an angle in each lane.
#[derive(Clone, Copy)]
struct Turn<S: Simd> {
    sin: Numbers<S>,
    cos: Numbers<S>,
}

/// Sines and cosines of an angle in each posture, kept from the last evaluation: twists hardly ever change between samples.
#[derive(Debug, Clone, Copy)]
struct Trigs<const L: usize> {
    angle: [f64; L],
    sin: [f64; L],
    cos: [f64; L],
}

impl<const L: usize> Trigs<L> {
    const ZERO: Self = Trigs { angle: [0.0; L], sin: [0.0; L], cos: [1.0; L] };

    #[inline(always)]
    fn of<S: Simd>(&self, group: Group<S>) -> Turn<S> {
        Turn { sin: group.of(&self.sin), cos: group.of(&self.cos) }
    }

    #[inline(always)]
    fn differ(&self, angle: &[f64; L]) -> bool {
        // All bits at once: a comparison a lane would be a branch a lane.
        (0..L).fold(0, |bits, l| bits | (angle[l].to_bits() ^ self.angle[l].to_bits())) != 0
    }

    #[inline(always)]
    fn turn(&mut self, angle: &[f64; L]) {
        if self.differ(angle) {
            self.evaluate(angle);
        }
    }

    #[cold]
    fn evaluate(&mut self, angle: &[f64; L]) {
        for l in 0..L {
            // Most often all postures share it.
            (self.sin[l], self.cos[l]) = if l > 0 && angle[l].to_bits() == angle[l - 1].to_bits() {
                (self.sin[l - 1], self.cos[l - 1])
            } else {
                angle[l].sin_cos()
            };
        }
        self.angle = *angle;
    }
}

/// An MDH line in each posture, `theta` being the joint's angle and what is added to it.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))] // A register of eight numbers is then no two lines of the cache.
struct Lines<const L: usize> {
    alpha: Trigs<L>,
    a: [f64; L],
    beta: Trigs<L>,
    skewed: bool,
    theta: Trigs<L>,
    d: [f64; L],
}

impl<const L: usize> Lines<L> {
    const ZERO: Self = {
        let (alpha, beta, theta) = (Trigs::ZERO, Trigs::ZERO, Trigs::ZERO);
        Lines { alpha, a: [0.0; L], beta, skewed: false, theta, d: [0.0; L] }
    };

    /// The frames at the end of this line, of those where it begins.
    #[inline(always)]
    fn next<S: Simd>(&self, group: Group<S>, frame: &Axes<S>) -> Axes<S> {
        let (alpha, theta) = (self.alpha.of(group), self.theta.of(group));
        let y = frame.y * alpha.cos + frame.z * alpha.sin;
        let mut z = frame.z * alpha.cos - frame.y * alpha.sin;
        let mut x = frame.x;
        // Skewed are few lines, and each product here would wait for the one before.
        if self.skewed {
            let beta = self.beta.of(group);
            (x, z) = (x * beta.cos - z * beta.sin, x * beta.sin + z * beta.cos);
        }
        let o = frame.o + frame.x * group.of(&self.a) + z * group.of(&self.d);
        Axes { x: x * theta.cos + y * theta.sin, y: y * theta.cos - x * theta.sin, z, o }
    }
}

/// The arm in `L` postures at once: all its frames, the TCP, and the column of any site. Reused from sample to sample without allocation.
///
/// Joints, deviations and what comes out of them are lists of `[f64; L]`, a number a posture.
#[derive(Debug, Clone)]
pub struct Postures<const L: usize> {
    sites: SiteIndex,
    /// Rz, Ry, Rx of the base, of which frame 0 keeps the axes: a base seldom turns between samples.
    base_turned: [Trigs<L>; 3],
    /// Frame k before its flex displacement; 0 is the base.
    rigid: Vec<Frames<L>>,
    /// Frame k after it; only kept up when something flexes.
    flexed: Vec<Frames<L>>,
    flexible: bool,
    /// Rz and Ry of each flex displacement.
    flex_turned: Vec<[Trigs<L>; 2]>,
    lines: Vec<Lines<L>>,
    /// TCP in the last frame.
    tool: Vectors<L>,
    tcp: Vectors<L>,
}

/// The arm in one posture.
pub type Posture = Postures<1>;

/// What a batch of postures is made of, one number a posture.
#[derive(Debug, Clone, Copy)]
pub struct Stances<'a, const L: usize> {
    /// Nominal base in the world: x, y, z (m), rz, ry, rx (rad).
    pub base: &'a [[f64; L]; 6],
    /// TCP in the last frame, m.
    pub tool: &'a [[f64; L]; 3],
    /// Joint angles, rad (N).
    pub q: &'a [[f64; L]],
    /// Deviation of every site, SI (see [`SiteIndex`]).
    pub deviations: &'a [[f64; L]],
}

impl<const L: usize> Postures<L> {
    /// A workspace for this arm.
    pub fn new(robot: &Robot) -> Self {
        let n = robot.joints();
        Postures {
            sites: SiteIndex::new(n),
            base_turned: [Trigs::ZERO; 3],
            rigid: vec![Frames::identity(); n + 1],
            flexed: vec![Frames::identity(); n + 1],
            flexible: false,
            flex_turned: vec![[Trigs::ZERO; 2]; n + 1],
            lines: vec![Lines::ZERO; n],
            tool: Vectors::ZERO,
            tcp: Vectors::ZERO,
        }
    }

    /// Moves the arm to all of them.
    #[inline]
    pub fn set_all(&mut self, robot: &Robot, stances: &Stances<'_, L>) {
        in_lanes::<L, _>(Stand { postures: self, robot, stances });
    }

    /// Turns the joints to `q` (rad, N) where base, tool and links are as they were set last: of the deviations, only those of the
    /// joints' angles are other than they were then.
    #[inline]
    pub fn turn_all(&mut self, robot: &Robot, q: &[[f64; L]], deviations: &[[f64; L]]) {
        in_lanes::<L, _>(Turned { postures: self, robot, q, deviations });
    }

    /// Sets base, tool and links.
    #[inline(always)]
    fn shape(&mut self, robot: &Robot, base: &[[f64; L]; 6], tool: &[[f64; L]; 3], deviations: &[[f64; L]]) {
        let n = robot.joints();
        assert!(deviations.len() == self.sites.len() && self.lines.len() == n);
        self.place_base(base, deviations);
        for (i, lines) in self.lines.iter_mut().enumerate() {
            let dev = &deviations[self.sites.link(i)..][..5];
            let mdh = &robot.links[i].mdh;
            lines.alpha.turn(&sum(mdh.alpha, &dev[0]));
            lines.a = sum(mdh.a, &dev[1]);
            lines.beta.turn(&sum(mdh.beta, &dev[2]));
            lines.skewed = (0..L).fold(0, |bits, l| bits | lines.beta.angle[l].to_bits()) << 1 != 0;
            lines.d = sum(mdh.d, &dev[4]);
        }
        self.flexible = (0..=n).fold(false, |any, k| any | flexes(&deviations[self.sites.flex(k)..][..6]));
        let tip = self.sites.tool();
        let plus = |k: usize| std::array::from_fn(|l| tool[k][l] + deviations[tip + k][l]);
        self.tool = Vectors { x: plus(0), y: plus(1), z: plus(2) };
    }

    /// Turns the joints.
    #[inline(always)]
    fn turn<S: Simd>(&mut self, simd: S, robot: &Robot, q: &[[f64; L]], deviations: &[[f64; L]]) {
        let n = robot.joints();
        assert!(deviations.len() == self.sites.len() && q.len() == n && self.lines.len() == n);
        // All sines first: between their calls the frames below would leave the registers.
        for (i, lines) in self.lines.iter_mut().enumerate() {
            let (drawn, dev) = (robot.links[i].mdh.theta, &deviations[self.sites.link(i) + 3]);
            (0..L).for_each(|l| lines.theta.angle[l] = q[i][l] + drawn + dev[l]);
        }
        self.find_sines(simd);
        if self.flexible {
            self.bend(0, deviations);
            for i in 0..n {
                for first in (0..L).step_by(S::F64_LANES) {
                    let group = Group::new(simd, first);
                    let next = self.lines[i].next(group, &self.flexed[i].of(group));
                    self.rigid[i + 1].put_all(group, &next);
                }
                self.bend(i + 1, deviations);
            }
            for first in (0..L).step_by(S::F64_LANES) {
                let group = Group::new(simd, first);
                self.tcp.put_all(group, self.flexed[n].of(group).point(self.tool.of(group)));
            }
        } else {
            for first in (0..L).step_by(S::F64_LANES) {
                let group = Group::new(simd, first);
                let mut frame = self.rigid[0].of(group);
                for (lines, rigid) in self.lines.iter().zip(&mut self.rigid[1..]) {
                    frame = lines.next(group, &frame);
                    rigid.put_all(group, &frame);
                }
                self.tcp.put_all(group, frame.point(self.tool.of(group)));
            }
        }
    }

    /// Sets the base, which is frame 0 before its flex displacement.
    #[inline(always)]
    fn place_base(&mut self, base: &[[f64; L]; 6], deviations: &[[f64; L]]) {
        let mut chi = *base;
        for (chi, dev) in chi.iter_mut().zip(deviations) {
            (0..L).for_each(|l| chi[l] += dev[l]);
        }
        if self.base_turned.iter().zip(&chi[3..]).any(|(turned, angle)| turned.differ(angle)) {
            self.turn_base(&chi);
        }
        let [x, y, z, ..] = chi;
        self.rigid[0].o = Vectors { x, y, z };
    }

    #[cold]
    fn turn_base(&mut self, chi: &[[f64; L]; 6]) {
        for l in 0..L {
            self.rigid[0].put(l, &Frame::from_pose(&FramePose::from_array(chi.map(|x| x[l])).pose()));
        }
        self.base_turned.iter_mut().zip(&chi[3..]).for_each(|(turned, angle)| turned.turn(angle));
    }

    /// Finds the sines and cosines of all joints.
    #[inline(always)]
    fn find_sines<S: Simd>(&mut self, simd: S) {
        let mut far = false;
        if S::F64_LANES > 1 {
            // The registers hold a joint of several postures,
            for Lines { theta, .. } in &mut self.lines {
                far |= turns::any_far(&theta.angle);
                for first in (0..L).step_by(S::F64_LANES) {
                    let group = Group::new(simd, first);
                    let (sin, cos) = turns::sin_cos(group.of(&theta.angle));
                    group.put(&mut theta.sin, sin);
                    group.put(&mut theta.cos, cos);
                }
            }
        } else {
            // or several joints of a posture.
            for lines in self.lines.chunks_mut(turns::AT_ONCE / L) {
                let mut angles = [0.0; turns::AT_ONCE];
                for (k, Lines { theta, .. }) in lines.iter().enumerate() {
                    angles[k * L..][..L].copy_from_slice(&theta.angle);
                }
                let of = turns::sin_cos_of_all(&angles);
                far |= of.far;
                for (k, Lines { theta, .. }) in lines.iter_mut().enumerate() {
                    theta.sin.copy_from_slice(&of.sin[k * L..][..L]);
                    theta.cos.copy_from_slice(&of.cos[k * L..][..L]);
                }
            }
        }
        if far {
            self.turn_far_joints();
        }
    }

    #[cold]
    fn turn_far_joints(&mut self) {
        for Lines { theta, .. } in &mut self.lines {
            for l in (0..L).filter(|&l| turns::is_far(theta.angle[l])) {
                (theta.sin[l], theta.cos[l]) = theta.angle[l].sin_cos();
            }
        }
    }

    /// Displaces frame k.
    fn bend(&mut self, k: usize, deviations: &[[f64; L]]) {
        self.flexed[k] = self.rigid[k];
        let v = &deviations[self.sites.flex(k)..][..6];
        if flexes(v) {
            for l in 0..L {
                let v = [0, 1, 2, 3, 4, 5].map(|axis| v[axis][l]);
                if v != [0.0; 6] {
                    self.flexed[k].put(l, &self.rigid[k].at(l).displaced(&v));
                }
            }
        }
        self.flex_turned[k][0].turn(&v[3]);
        self.flex_turned[k][1].turn(&v[4]);
    }

    /// Frames after their flex displacements.
    #[inline(always)]
    fn frames(&self) -> &[Frames<L>] {
        if self.flexible { &self.flexed } else { &self.rigid }
    }

    /// Number of joints.
    #[inline(always)]
    pub fn joints(&self) -> usize {
        self.lines.len()
    }

    /// World positions of the TCP, m.
    #[inline]
    pub fn tcps(&self) -> &Vectors<L> {
        &self.tcp
    }

    /// `world_from_frame` k of one posture: 0 is the base, k the frame of link k (counted from 1).
    #[inline(always)]
    pub fn frame_at(&self, lane: usize, k: usize) -> Frame {
        self.frames()[k].at(lane)
    }

    /// Axis and origin of joint `i` (counted from 0) in the world, of one posture.
    #[inline(always)]
    pub fn joint_axis_at(&self, lane: usize, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let frame = self.rigid[i + 1].at(lane);
        (frame.z, frame.o)
    }

    /// Frames k of a group of postures.
    #[inline(always)]
    pub(super) fn frames_of<S: Simd>(&self, group: Group<S>, k: usize) -> Axes<S> {
        self.frames()[k].of(group)
    }

    /// Axis and origin of joint `k` (counted from 1), or of the base's z axis where `k` is 0, of a group of postures.
    #[inline(always)]
    pub(super) fn axes_of<S: Simd>(&self, group: Group<S>, k: usize) -> (Vector<S>, Vector<S>) {
        let frames = if k == 0 { self.frames() } else { &self.rigid };
        (frames[k].z.of(group), frames[k].o.of(group))
    }

    /// The [column](Posture::column) of every site at its place (see [`SiteIndex`]), but for those of flex displacements.
    ///
    /// All at once they are worked out side by side; one by one each would wait for the choice of its site.
    #[inline]
    pub fn columns(&self, columns: &mut [Vectors<L>]) {
        in_lanes::<L, _>(WriteColumns { postures: self, columns });
    }

    #[inline(always)]
    fn write_columns<S: Simd>(&self, simd: S, columns: &mut [Vectors<L>]) {
        for first in (0..L).step_by(S::F64_LANES) {
            let group = Group::new(simd, first);
            for axis in Axis6::ALL {
                self.write_column(group, Site::Base(axis), columns);
            }
            for i in 0..self.lines.len() {
                for entry in MdhEntry::ALL {
                    self.write_column(group, Site::mdh(i, entry), columns);
                }
            }
            for k in 0..3 {
                self.write_column(group, Site::tool(k), columns);
                self.write_column(group, Site::target(k), columns);
            }
        }
    }

    #[inline(always)]
    fn write_column<S: Simd>(&self, group: Group<S>, site: Site, columns: &mut [Vectors<L>]) {
        columns[self.sites.of(site)].put_all(group, self.column_of(group, site));
    }

    /// The [column](Posture::column) of a site in one posture.
    #[inline(always)]
    pub fn column_at(&self, lane: usize, site: Site) -> Vector3<f64> {
        self.column_of(Group::lane(lane), site).into()
    }

    /// The [column](Posture::column) of a site in a group of postures.
    // Always: handed back through memory, each of a Jacobian's columns would wait for the stores of its parts.
    #[inline(always)]
    fn column_of<S: Simd>(&self, group: Group<S>, site: Site) -> Vector<S> {
        let tcp = self.tcp.of(group);
        match site {
            Site::Base(axis) => {
                let [rz, ry, _] = &self.base_turned;
                let (x, y, z) = (group.vector(&Vector3::x()), group.vector(&Vector3::y()), group.vector(&Vector3::z()));
                let origin = Axes { x, y, z, o: self.rigid[0].o.of(group) };
                displacement_column(&origin, axis, [rz.of(group), ry.of(group)], tcp)
            }
            Site::Mdh(i, entry) => {
                let i = usize::from(i);
                let (previous, next) = (&self.frames()[i], &self.rigid[i + 1]);
                match entry {
                    MdhEntry::Alpha => previous.x.of(group).cross(tcp - previous.o.of(group)),
                    MdhEntry::A => previous.x.of(group),
                    MdhEntry::Beta => {
                        let Lines { alpha, a, .. } = &self.lines[i];
                        let alpha = alpha.of(group);
                        let y = previous.y.of(group) * alpha.cos + previous.z.of(group) * alpha.sin;
                        y.cross(tcp - previous.o.of(group) - previous.x.of(group) * group.of(a))
                    }
                    MdhEntry::Theta => next.z.of(group).cross(tcp - next.o.of(group)),
                    MdhEntry::D => next.z.of(group),
                }
            }
            Site::Flex(k, axis) => {
                let k = usize::from(k);
                let origin = Axes { o: self.frames()[k].o.of(group), ..self.rigid[k].of(group) };
                let still = Turn { sin: group.splat(0.0), cos: group.splat(1.0) };
                let [rz, ry] = &self.flex_turned[k];
                let turned = if self.flexible { [rz.of(group), ry.of(group)] } else { [still; 2] };
                displacement_column(&origin, axis, turned, tcp)
            }
            Site::Tool(k) => {
                let flange = &self.frames()[self.lines.len()];
                [flange.x, flange.y, flange.z][usize::from(k)].of(group)
            }
            Site::Target(k) => -group.vector(&Vector3::ith(k.into(), 1.0)),
        }
    }
}

impl Posture {
    /// Moves the arm to joints `q` (N, rad) on `base` with TCP `tool`, deviating by `deviations` (one SI number a site, see [`SiteIndex`]).
    #[inline]
    pub fn set(&mut self, robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64], deviations: &[f64]) {
        let (base, tool) = (base.to_array().map(|x| [x]), tool.xyz.map(|x| [x]));
        let (q, deviations) = (q.as_chunks().0, deviations.as_chunks().0);
        self.set_all(robot, &Stances { base: &base, tool: &tool, q, deviations });
    }

    /// Turns the joints to `q` (rad, N) where base, tool and links are as they were set last: of the deviations, only those of the
    /// joints' angles are other than they were then.
    #[inline]
    pub fn turn_to(&mut self, robot: &Robot, q: &[f64], deviations: &[f64]) {
        self.turn_all(robot, q.as_chunks().0, deviations.as_chunks().0);
    }

    /// World position of the TCP, m.
    #[inline]
    pub fn tcp(&self) -> Vector3<f64> {
        self.tcp.at(0)
    }

    /// `world_from_frame` k: 0 is the base, k the frame of link k (counted from 1).
    #[inline]
    pub fn frame(&self, k: usize) -> Frame {
        self.frame_at(0, k)
    }

    /// The last frame, that carries the flange and the tool.
    #[inline]
    pub fn flange(&self) -> Frame {
        self.frame_at(0, self.lines.len())
    }

    /// `world_from_tool`, the tool's axes turned in the flange as `tool` says.
    pub fn world_from_tool(&self, tool: &FramePose) -> Pose {
        self.world_from_turned(&FramePose { xyz: [0.0; 3], ..*tool }.pose())
    }

    /// `world_from_tool`, the tool's axes turned in the flange by `turned`.
    pub fn world_from_turned(&self, turned: &Pose) -> Pose {
        Frame { o: self.tcp(), ..self.flange() }.pose() * turned
    }

    /// Axis and origin of joint `i` (counted from 0) in the world.
    #[inline]
    pub fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        self.joint_axis_at(0, i)
    }

    /// d(TCP)/d(site), m per SI unit of the site; for a target site, d(target)/d(site) with the sign that makes it a column of the model's side.
    ///
    /// The residual is `target - tcp`, so a target site counts negatively here.
    #[inline(always)]
    pub fn column(&self, site: Site) -> Vector3<f64> {
        self.column_at(0, site)
    }
}

/// [`Postures::set_all`] for the vectors that the processor has. A closure would be compiled for those that all processors have.
struct Stand<'a, const L: usize> {
    postures: &'a mut Postures<L>,
    robot: &'a Robot,
    stances: &'a Stances<'a, L>,
}

impl<const L: usize> WithSimd for Stand<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Stances { base, tool, q, deviations } = *self.stances;
        self.postures.shape(self.robot, base, tool, deviations);
        self.postures.turn(simd, self.robot, q, deviations);
    }
}

/// [`Postures::turn_all`] likewise.
struct Turned<'a, const L: usize> {
    postures: &'a mut Postures<L>,
    robot: &'a Robot,
    q: &'a [[f64; L]],
    deviations: &'a [[f64; L]],
}

impl<const L: usize> WithSimd for Turned<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.postures.turn(simd, self.robot, self.q, self.deviations);
    }
}

/// [`Postures::columns`] likewise.
struct WriteColumns<'a, const L: usize> {
    postures: &'a Postures<L>,
    columns: &'a mut [Vectors<L>],
}

impl<const L: usize> WithSimd for WriteColumns<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.postures.write_columns(simd, self.columns);
    }
}

/// Adds a number to that of each posture.
#[inline(always)]
fn sum<const L: usize>(a: f64, b: &[f64; L]) -> [f64; L] {
    let mut sum = *b;
    (0..L).for_each(|l| sum[l] = a + b[l]);
    sum
}

/// Whether a displacement is any in any posture.
#[inline(always)]
fn flexes<const L: usize>(displacement: &[[f64; L]]) -> bool {
    // All bits but the sign's at once: a comparison each would be a branch each.
    displacement.iter().flatten().fold(0, |bits, x| bits | x.to_bits()) << 1 != 0
}

/// Column of one number of `Tr(x, y, z) Rz Ry Rx` applied after `frame` (axes of the frame, origin after the translation).
#[inline(always)]
fn displacement_column<S: Simd>(frame: &Axes<S>, axis: Axis6, [rz, ry]: [Turn<S>; 2], tcp: Vector<S>) -> Vector<S> {
    let arm = tcp - frame.o;
    match axis {
        Axis6::X => frame.x,
        Axis6::Y => frame.y,
        Axis6::Z => frame.z,
        Axis6::Rz => frame.z.cross(arm),
        Axis6::Ry => (frame.y * rz.cos - frame.x * rz.sin).cross(arm),
        Axis6::Rx => ((frame.x * rz.cos + frame.y * rz.sin) * ry.cos - frame.z * ry.sin).cross(arm),
    }
}

/// World position and orientation of the tool of a nominal arm.
pub fn world_from_tool(robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64]) -> Pose {
    robot.links.iter().zip(q).fold(base.pose(), |pose, (link, &q)| pose * link.mdh.transform(q)) * tool.pose()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::robot::{Link, MdhLink};

    /// Step of the central difference; its truncation (1e-10 relative) and rounding (1e-11) are both under the tolerance.
    const STEP: f64 = 1e-5;
    const TOLERANCE: f64 = 1e-8;

    fn arm(joints: usize, random: &mut ChaCha8Rng) -> Robot {
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let links = (0..joints)
            .map(|_| Link {
                mdh: MdhLink {
                    alpha: between(-3.0, 3.0),
                    a: between(-0.5, 0.5),
                    beta: between(-0.4, 0.4),
                    theta: between(-3.0, 3.0),
                    d: between(-0.5, 0.5),
                },
                limits: [-3.0, 3.0],
                mass: 1.0,
                com: Vector3::zeros(),
            })
            .collect();
        Robot { name: "random".into(), source: String::new(), links, gear_ratios: Vec::new(), solids: Vec::new() }
    }

    #[test]
    fn every_column_is_the_derivative_of_its_site() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for joints in [6, 7] {
            let robot = arm(joints, &mut random);
            let index = SiteIndex::new(joints);
            let mut posture = Posture::new(&robot);
            let mut number = |scale: f64| random.random_range(-scale..scale);
            let base = FramePose::from_array(std::array::from_fn(|_| number(1.0)));
            let tool = FramePose::from_array(std::array::from_fn(|_| number(0.2)));
            let q: Vec<f64> = (0..joints).map(|_| number(3.0)).collect();
            let mut deviations: Vec<f64> = (0..index.len()).map(|_| number(0.3)).collect();
            let mut sites: Vec<Site> = Axis6::ALL.into_iter().map(Site::Base).collect();
            for k in 0..=joints {
                sites.extend(Axis6::ALL.into_iter().map(|axis| Site::flex(k, axis)));
            }
            for i in 0..joints {
                sites.extend(MdhEntry::ALL.into_iter().map(|entry| Site::mdh(i, entry)));
            }
            sites.extend((0..3).map(Site::Tool));
            assert_eq!(sites.len() + 3, index.len(), "all sites but the target's");
            for &site in &sites {
                let place = index.of(site);
                let at = deviations[place];
                let mut tcp = |value: f64| {
                    deviations[place] = value;
                    posture.set(&robot, &base, &tool, &q, &deviations);
                    posture.tcp()
                };
                let difference = (tcp(at + STEP) - tcp(at - STEP)) / (2.0 * STEP);
                tcp(at);
                let column = posture.column(site);
                assert!((column - difference).norm() < TOLERANCE, "{site}: {column:?} against {difference:?}");
            }
            let mut together = vec![Vectors::ZERO; index.len()];
            posture.columns(&mut together);
            sites.extend((0..3).map(Site::Target));
            for site in sites.into_iter().filter(|site| !matches!(site, Site::Flex(..))) {
                assert_eq!(together[index.of(site)].at(0), posture.column(site), "{site}");
            }
        }
    }

    #[test]
    fn a_workspace_keeps_nothing_of_the_posture_before() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let robot = arm(6, &mut random);
        let index = SiteIndex::new(6);
        let (q, tool) = ([0.3, -0.8, 1.1, 0.4, -0.6, 2.0], FramePose { xyz: [0.1, 0.02, -0.2], rz_ry_rx: [0.0; 3] });
        let with = |site: Site, value: f64| {
            let mut deviations = vec![0.0; index.len()];
            deviations[index.of(site)] = value;
            deviations
        };
        let bases = [[0.1, 0.2, 0.3, 0.0, 0.0, 0.0], [0.1, 0.2, 0.4, 0.0, 0.0, 0.0], [0.1, 0.2, 0.4, 0.5, -0.2, 0.1]];
        let cases = [
            with(Site::flex(3, Axis6::Rz), 0.2),
            with(Site::tool(0), 0.0),
            with(Site::flex(5, Axis6::X), 0.01),
            with(Site::Base(Axis6::Ry), 0.1),
            with(Site::mdh(2, MdhEntry::Beta), 0.1),
        ];
        let mut kept = Posture::new(&robot);
        for base in bases.map(FramePose::from_array) {
            for deviations in &cases {
                let mut fresh = Posture::new(&robot);
                kept.set(&robot, &base, &tool, &[0.0; 6], deviations);
                kept.turn_to(&robot, &q, deviations);
                fresh.set(&robot, &base, &tool, &q, deviations);
                assert_eq!(kept.tcp(), fresh.tcp());
                for k in 0..=6 {
                    assert_eq!(kept.frame(k), fresh.frame(k));
                    for site in Axis6::ALL.map(|axis| Site::flex(k, axis)).into_iter().chain(Axis6::ALL.map(Site::Base)) {
                        assert_eq!(kept.column(site), fresh.column(site), "{site}");
                    }
                }
            }
        }
    }

    /// Bits and all: no lane knows of its neighbours.
    #[test]
    fn postures_side_by_side_are_those_that_each_has_alone() {
        const LANES: usize = 8;
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for joints in [1, 6, 7, 9] {
            let robot = arm(joints, &mut random);
            let index = SiteIndex::new(joints);
            let (mut together, mut alone) = (Postures::<LANES>::new(&robot), Posture::new(&robot));
            for round in 0..6 {
                let mut numbers = |count: usize, scale: f64| -> Vec<[f64; LANES]> {
                    (0..count).map(|_| std::array::from_fn(|_| random.random_range(-scale..scale))).collect()
                };
                let (base, tool): ([_; 6], [_; 3]) = (numbers(6, 1.0).try_into().unwrap(), numbers(3, 0.2).try_into().unwrap());
                let (mut q, mut deviations) = (numbers(joints, 3.0), numbers(index.len(), 0.3));
                // Where the polynomials of sine and cosine end, one posture must not decide for the others.
                q[0][3] = 2e6;
                for k in 0..=joints {
                    let stiff = |l: usize| round < 2 || (round + k + l).is_multiple_of(3);
                    for v in &mut deviations[index.flex(k)..][..6] {
                        (0..LANES).filter(|&l| stiff(l)).for_each(|l| v[l] = 0.0);
                    }
                }
                if round == 5 {
                    deviations[index.of(Site::mdh(0, MdhEntry::Beta))][2] = -robot.links[0].mdh.beta;
                }
                together.set_all(&robot, &Stances { base: &base, tool: &tool, q: &q, deviations: &deviations });
                let (mut columns, mut own) = (vec![Vectors::ZERO; index.len()], vec![Vectors::ZERO; index.len()]);
                together.columns(&mut columns);
                for lane in 0..LANES {
                    let of = |list: &[[f64; LANES]]| -> Vec<f64> { list.iter().map(|x| x[lane]).collect() };
                    let base = FramePose::from_array(base.map(|x| x[lane]));
                    let tool = FramePose { xyz: tool.map(|x| x[lane]), ..FramePose::default() };
                    alone.set(&robot, &base, &tool, &of(&q), &of(&deviations));
                    let bits = |v: Vector3<f64>| [v.x, v.y, v.z].map(f64::to_bits);
                    assert_eq!(bits(together.tcps().at(lane)), bits(alone.tcp()), "{joints} joints, round {round}");
                    for k in 0..=joints {
                        let (one, other) = (together.frame_at(lane, k), alone.frame(k));
                        assert_eq!([one.x, one.y, one.z, one.o].map(bits), [other.x, other.y, other.z, other.o].map(bits));
                        for site in Axis6::ALL.map(|axis| Site::flex(k, axis)) {
                            assert_eq!(bits(together.column_at(lane, site)), bits(alone.column(site)), "{site}");
                        }
                    }
                    alone.columns(&mut own);
                    for (column, own) in columns.iter().zip(&own) {
                        assert_eq!(bits(column.at(lane)), bits(own.at(0)));
                    }
                }
            }
        }
    }
}
