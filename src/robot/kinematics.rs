//! Forward kinematics of a deviating arm, and the exact columns of its position Jacobian.
//!
//! `T_world_tool = T(base) * prod_i [ flex_{i-1} Rx(alpha) Tx(a) Ry(beta) Rz(q + theta) Tz(d) ] * flex_n * tool` (paper Eq. 1, 2, 5, 6).
//! Every site of deviation is a screw, so its column is either an axis, or `axis x (tcp - point)`: exact, with no differences taken.

use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

use super::{Axis6, FramePose, MdhEntry, Pose, Robot, Site, SiteIndex, turns};

/// A frame as its three axes and its origin, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Unit vector of the x axis.
    pub x: Vector3<f64>,
    /// Unit vector of the y axis.
    pub y: Vector3<f64>,
    /// Unit vector of the z axis.
    pub z: Vector3<f64>,
    /// Origin, m.
    pub o: Vector3<f64>,
}

impl Frame {
    /// The world frame.
    pub fn identity() -> Self {
        Frame { x: Vector3::x(), y: Vector3::y(), z: Vector3::z(), o: Vector3::zeros() }
    }

    /// Axes and origin of a transform.
    pub fn from_pose(pose: &Pose) -> Self {
        let r = pose.rotation.matrix();
        Frame {
            x: r.column(0).into_owned(),
            y: r.column(1).into_owned(),
            z: r.column(2).into_owned(),
            o: pose.translation.vector,
        }
    }

    /// The transform from this frame to the world.
    pub fn pose(&self) -> Pose {
        let r = Matrix3::from_columns(&[self.x, self.y, self.z]);
        Pose::from_parts(Translation3::from(self.o), Rotation3::from_matrix_unchecked(r))
    }

    /// World coordinates of a point given in this frame.
    #[inline]
    pub fn point(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.o + self.direction(p)
    }

    /// World components of a vector given in this frame.
    #[inline]
    pub fn direction(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Components in this frame of a vector given in the world.
    #[inline]
    pub fn components(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// This frame displaced by `Tr(x, y, z) Rz Ry Rx` along its own axes.
    fn displaced(&self, v: &[f64]) -> Frame {
        let d = FramePose { xyz: [v[0], v[1], v[2]], rz_ry_rx: [v[3], v[4], v[5]] }.pose();
        Frame::from_pose(&(self.pose() * d))
    }
}

/// Sine and cosine of an angle, kept from the last evaluation: twists hardly ever change between samples.
#[derive(Debug, Clone, Copy)]
struct Trig {
    angle: f64,
    sin: f64,
    cos: f64,
}

impl Trig {
    const ZERO: Trig = Trig { angle: 0.0, sin: 0.0, cos: 1.0 };

    #[inline]
    fn at(&mut self, angle: f64) -> (f64, f64) {
        if angle != self.angle {
            let (sin, cos) = angle.sin_cos();
            *self = Trig { angle, sin, cos };
        }
        (self.sin, self.cos)
    }
}

/// An MDH line with its deviations and its joint's angle.
#[derive(Debug, Clone, Copy)]
struct Line {
    alpha: Trig,
    a: f64,
    beta: Trig,
    theta: Trig,
    d: f64,
}

impl Line {
    /// The frame at the end of this line, of the one where it begins.
    #[inline(always)]
    fn next(&self, frame: &Frame) -> Frame {
        let Line { alpha, a, beta, theta, d } = *self;
        let y = frame.y * alpha.cos + frame.z * alpha.sin;
        let mut z = frame.z * alpha.cos - frame.y * alpha.sin;
        let mut x = frame.x;
        // Skewed are few lines, and each product here would wait for the one before.
        if beta.angle != 0.0 {
            (x, z) = (x * beta.cos - z * beta.sin, x * beta.sin + z * beta.cos);
        }
        Frame { x: x * theta.cos + y * theta.sin, y: y * theta.cos - x * theta.sin, z, o: frame.o + frame.x * a + z * d }
    }
}

/// The arm in one posture: all its frames, the TCP, and the column of any site. Reused from sample to sample without allocation.
#[derive(Debug, Clone)]
pub struct Posture {
    sites: SiteIndex,
    base: Frame,
    /// Rz, Ry, Rx of the base, of which `base` keeps the axes: a base seldom turns between samples.
    base_turned: [Trig; 3],
    /// Frame k before its flex displacement; 0 is the base.
    rigid: Vec<Frame>,
    /// Frame k after it; only kept up when something flexes.
    flexed: Vec<Frame>,
    flexible: bool,
    /// Rz and Ry of each flex displacement.
    flex_turned: Vec<[Trig; 2]>,
    lines: Vec<Line>,
    tcp: Vector3<f64>,
}

impl Posture {
    /// A workspace for this arm.
    pub fn new(robot: &Robot) -> Self {
        let n = robot.joints();
        Posture {
            sites: SiteIndex::new(n),
            base: Frame::identity(),
            base_turned: [Trig::ZERO; 3],
            rigid: vec![Frame::identity(); n + 1],
            flexed: vec![Frame::identity(); n + 1],
            flexible: false,
            flex_turned: vec![[Trig::ZERO; 2]; n + 1],
            lines: vec![Line { alpha: Trig::ZERO, a: 0.0, beta: Trig::ZERO, theta: Trig::ZERO, d: 0.0 }; n],
            tcp: Vector3::zeros(),
        }
    }

    /// Moves the arm to joints `q` (N, rad) on `base` with TCP `tool`, deviating by `deviations` (one SI number a site, see [`SiteIndex`]).
    pub fn set(&mut self, robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64], deviations: &[f64]) {
        let n = robot.joints();
        debug_assert_eq!(deviations.len(), self.sites.len());
        debug_assert_eq!(q.len(), n);
        let mut chi = base.to_array();
        for (c, d) in chi.iter_mut().zip(deviations) {
            *c += d;
        }
        if self.base_turned.iter().zip(&chi[3..]).any(|(turned, angle)| turned.angle != *angle) {
            self.base = Frame::from_pose(&FramePose::from_array(chi).pose());
            self.base_turned.iter_mut().zip(&chi[3..]).for_each(|(turned, angle)| _ = turned.at(*angle));
        }
        self.base.o = Vector3::new(chi[0], chi[1], chi[2]);
        self.flexible = false;
        // All sines first: between their calls the frames below would leave the registers.
        for (group, lines) in self.lines.chunks_mut(turns::LANES).enumerate() {
            let mut angles = [0.0; turns::LANES];
            let first = group * turns::LANES;
            for (k, (line, angle)) in lines.iter_mut().zip(&mut angles).enumerate() {
                let i = first + k;
                let dev = &deviations[self.sites.link(i)..][..5];
                let mdh = &robot.links[i].mdh;
                line.alpha.at(mdh.alpha + dev[0]);
                line.a = mdh.a + dev[1];
                line.beta.at(mdh.beta + dev[2]);
                *angle = q[i] + mdh.theta + dev[3];
                line.d = mdh.d + dev[4];
            }
            let (sin, cos) = turns::sin_cos(&angles);
            for (k, line) in lines.iter_mut().enumerate() {
                line.theta = Trig { angle: angles[k], sin: sin[k], cos: cos[k] };
            }
        }
        let mut frame = self.base;
        if (0..=n).any(|k| self.flexes(k, deviations)) {
            self.bend(0, &mut frame, deviations);
            for i in 0..n {
                frame = self.lines[i].next(&frame);
                self.bend(i + 1, &mut frame, deviations);
            }
        } else {
            self.rigid[0] = frame;
            for (line, rigid) in self.lines.iter().zip(&mut self.rigid[1..]) {
                frame = line.next(&frame);
                *rigid = frame;
            }
        }
        let t = &deviations[self.sites.tool()..][..3];
        let offset = Vector3::new(tool.xyz[0] + t[0], tool.xyz[1] + t[1], tool.xyz[2] + t[2]);
        self.tcp = frame.point(&offset);
    }

    /// Whether frame k is displaced.
    #[inline]
    fn flexes(&self, k: usize, deviations: &[f64]) -> bool {
        // All bits but the sign's at once: six comparisons would be six branches.
        deviations[self.sites.flex(k)..][..6].iter().fold(0, |bits, x| bits | x.to_bits()) << 1 != 0
    }

    fn bend(&mut self, k: usize, frame: &mut Frame, deviations: &[f64]) {
        self.rigid[k] = *frame;
        let v = &deviations[self.sites.flex(k)..][..6];
        let flexes = self.flexes(k, deviations);
        if flexes && !self.flexible {
            self.flexible = true;
            self.flexed[..k].copy_from_slice(&self.rigid[..k]);
            self.flex_turned[..k].fill([Trig::ZERO; 2]);
        }
        if self.flexible {
            if flexes {
                *frame = frame.displaced(v);
            }
            self.flex_turned[k][0].at(v[3]);
            self.flex_turned[k][1].at(v[4]);
            self.flexed[k] = *frame;
        }
    }

    /// Frames after their flex displacements.
    #[inline]
    fn frames(&self) -> &[Frame] {
        if self.flexible { &self.flexed } else { &self.rigid }
    }

    /// World position of the TCP, m.
    #[inline]
    pub fn tcp(&self) -> Vector3<f64> {
        self.tcp
    }

    /// `world_from_frame` k: 0 is the base, k the frame of link k (counted from 1).
    #[inline]
    pub fn frame(&self, k: usize) -> &Frame {
        &self.frames()[k]
    }

    /// The last frame, that carries the flange and the tool.
    #[inline]
    pub fn flange(&self) -> &Frame {
        &self.frames()[self.rigid.len() - 1]
    }

    /// `world_from_tool`, the tool's axes turned in the flange as `tool` says.
    pub fn world_from_tool(&self, tool: &FramePose) -> Pose {
        let turned = FramePose { xyz: [0.0; 3], ..*tool }.pose();
        Frame { o: self.tcp, ..*self.flange() }.pose() * turned
    }

    /// Axis and origin of joint `i` (counted from 0) in the world.
    #[inline]
    pub fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let f = &self.rigid[i + 1];
        (f.z, f.o)
    }

    /// The [column](Posture::column) of every site at its place (see [`SiteIndex`]), but for those of flex displacements.
    ///
    /// All at once they are worked out side by side; one by one each would wait for the choice of its site.
    pub fn columns(&self, columns: &mut [Vector3<f64>]) {
        for axis in Axis6::ALL {
            columns[axis as usize] = self.column(Site::Base(axis));
        }
        for i in 0..self.lines.len() {
            let [alpha, a, beta, theta, d] = MdhEntry::ALL.map(|entry| Site::Mdh(i, entry));
            let of_link = [self.column(alpha), self.column(a), self.column(beta), self.column(theta), self.column(d)];
            columns[self.sites.link(i)..][..5].copy_from_slice(&of_link);
        }
        let flange = self.flange();
        columns[self.sites.tool()..][..3].copy_from_slice(&[flange.x, flange.y, flange.z]);
        columns[self.sites.target()..][..3].copy_from_slice(&[-Vector3::x(), -Vector3::y(), -Vector3::z()]);
    }

    /// d(TCP)/d(site), m per SI unit of the site; for a target site, d(target)/d(site) with the sign that makes it a column of the model's side.
    ///
    /// The residual is `target - tcp`, so a target site counts negatively here.
    // Always: handed back through memory, each of a Jacobian's columns would wait for the stores of its parts.
    #[inline(always)]
    pub fn column(&self, site: Site) -> Vector3<f64> {
        match site {
            Site::Base(axis) => {
                let [rz, ry, _] = self.base_turned;
                displacement_column(&Frame { o: self.base.o, ..Frame::identity() }, axis, [rz, ry], &self.tcp)
            }
            Site::Mdh(i, entry) => {
                let previous = &self.frames()[i];
                let next = &self.rigid[i + 1];
                match entry {
                    MdhEntry::Alpha => previous.x.cross(&(self.tcp - previous.o)),
                    MdhEntry::A => previous.x,
                    MdhEntry::Beta => {
                        let Line { alpha, a, .. } = self.lines[i];
                        let y = previous.y * alpha.cos + previous.z * alpha.sin;
                        y.cross(&(self.tcp - previous.o - previous.x * a))
                    }
                    MdhEntry::Theta => next.z.cross(&(self.tcp - next.o)),
                    MdhEntry::D => next.z,
                }
            }
            Site::Flex(k, axis) => {
                let origin = Frame { o: self.frames()[k].o, ..self.rigid[k] };
                let turned = if self.flexible { self.flex_turned[k] } else { [Trig::ZERO; 2] };
                displacement_column(&origin, axis, turned, &self.tcp)
            }
            Site::Tool(k) => {
                let f = self.flange();
                [f.x, f.y, f.z][k]
            }
            Site::Target(k) => -Vector3::ith(k, 1.0),
        }
    }
}

/// Column of one number of `Tr(x, y, z) Rz Ry Rx` applied after `frame` (axes of the frame, origin after the translation).
#[inline(always)]
fn displacement_column(frame: &Frame, axis: Axis6, [rz, ry]: [Trig; 2], tcp: &Vector3<f64>) -> Vector3<f64> {
    let arm = tcp - frame.o;
    match axis {
        Axis6::X => frame.x,
        Axis6::Y => frame.y,
        Axis6::Z => frame.z,
        Axis6::Rz => frame.z.cross(&arm),
        Axis6::Ry => (frame.y * rz.cos - frame.x * rz.sin).cross(&arm),
        Axis6::Rx => ((frame.x * rz.cos + frame.y * rz.sin) * ry.cos - frame.z * ry.sin).cross(&arm),
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
                sites.extend(Axis6::ALL.into_iter().map(|axis| Site::Flex(k, axis)));
            }
            for i in 0..joints {
                sites.extend(MdhEntry::ALL.into_iter().map(|entry| Site::Mdh(i, entry)));
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
            let mut together = vec![Vector3::zeros(); index.len()];
            posture.columns(&mut together);
            sites.extend((0..3).map(Site::Target));
            for site in sites.into_iter().filter(|site| !matches!(site, Site::Flex(..))) {
                assert_eq!(together[index.of(site)], posture.column(site), "{site}");
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
            with(Site::Flex(3, Axis6::Rz), 0.2),
            with(Site::Tool(0), 0.0),
            with(Site::Flex(5, Axis6::X), 0.01),
            with(Site::Base(Axis6::Ry), 0.1),
            with(Site::Mdh(2, MdhEntry::Beta), 0.1),
        ];
        let mut kept = Posture::new(&robot);
        for base in bases.map(FramePose::from_array) {
            for deviations in &cases {
                let mut fresh = Posture::new(&robot);
                kept.set(&robot, &base, &tool, &q, deviations);
                fresh.set(&robot, &base, &tool, &q, deviations);
                assert_eq!(kept.tcp(), fresh.tcp());
                for k in 0..=6 {
                    assert_eq!(kept.frame(k), fresh.frame(k));
                    for site in Axis6::ALL.map(|axis| Site::Flex(k, axis)).into_iter().chain(Axis6::ALL.map(Site::Base)) {
                        assert_eq!(kept.column(site), fresh.column(site), "{site}");
                    }
                }
            }
        }
    }
}
