//! The columns of the position Jacobian: every site is a screw, so its column is an axis, or `axis x (tcp - point)`.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::super::Vectors;
use super::Postures;
use super::mdh_rows::Turn;
use crate::math::simd::{Axes, Group, Vector, in_lanes};
use crate::robot::sites::{Axis6, MdhEntry, Site};

impl<const L: usize> Postures<L> {
    /// The [column](super::Posture::column) of every site at its index (see [`SiteIndex`](crate::robot::sites::SiteIndex)), except
    /// those of flex displacements.
    ///
    /// The columns are computed as a batch; one by one, each would wait for a branch on its site.
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

    /// The [column](super::Posture::column) of a site in one posture.
    #[inline(always)]
    pub fn column_at(&self, lane: usize, site: Site) -> Vector3<f64> {
        self.column_of(Group::lane(lane), site).into()
    }

    /// True if joint `i` (counted from 0) is prismatic.
    #[inline(always)]
    pub fn slides(&self, i: usize) -> bool {
        self.lines[i].slides
    }

    /// d(TCP)/d(q) of joint `i` (counted from 0) in one posture, m per rad, or per m of a prismatic joint.
    #[inline(always)]
    pub fn motion_at(&self, lane: usize, i: usize) -> Vector3<f64> {
        self.column_at(lane, self.joint_site(i))
    }

    /// The site at which the variable of joint `i` (counted from 0) acts.
    #[inline(always)]
    pub fn joint_site(&self, i: usize) -> Site {
        Site::mdh(i, if self.slides(i) { MdhEntry::D } else { MdhEntry::Theta })
    }

    /// The [column](super::Posture::column) of a site in a group of postures.
    // Always inlined: returned through memory, each of a Jacobian's columns would wait for the stores of its parts.
    #[inline(always)]
    fn column_of<S: Simd>(&self, group: Group<S>, site: Site) -> Vector<S> {
        let tcp = self.tcp.of(group);
        match site {
            Site::Base(axis) => {
                let (frame, turned) = self.base_axes(group);
                displacement_column(&frame, axis, turned, tcp)
            }
            Site::Mdh(i, entry) => {
                let i = usize::from(i);
                let (previous, next) = (&self.frames()[i], &self.rigid[i + 1]);
                match entry {
                    MdhEntry::Alpha => previous.x.of(group).cross(tcp - previous.o.of(group)),
                    MdhEntry::A => previous.x.of(group),
                    MdhEntry::Beta => {
                        let arm = tcp - previous.o.of(group) - previous.x.of(group) * group.of(&self.lines[i].a);
                        self.beta_axis(group, i).cross(arm)
                    }
                    MdhEntry::Theta => next.z.of(group).cross(tcp - next.o.of(group)),
                    MdhEntry::D => next.z.of(group),
                }
            }
            Site::Flex(k, axis) => {
                let (frame, turned) = self.flex_axes(group, k.into());
                displacement_column(&frame, axis, turned, tcp)
            }
            Site::Tool(k) => {
                let flange = &self.frames()[self.lines.len()];
                [flange.x, flange.y, flange.z][usize::from(k)].of(group)
            }
            Site::Target(k) => -group.vector(&Vector3::ith(k.into(), 1.0)),
            Site::Probe(_) => group.vector(&Vector3::zeros()),
        }
    }

    /// Axis in the world about which a site turns the flange in one posture, rad per SI unit of the site; zero if it only shifts
    /// it.
    pub fn turning_at(&self, lane: usize, site: Site) -> Vector3<f64> {
        let group = Group::lane(lane);
        match site {
            Site::Mdh(_, MdhEntry::A | MdhEntry::D) | Site::Tool(_) | Site::Target(_) | Site::Probe(_) => Vector3::zeros(),
            Site::Mdh(i, MdhEntry::Alpha) => self.frames()[usize::from(i)].x.of(group).into(),
            Site::Mdh(i, MdhEntry::Beta) => self.beta_axis(group, i.into()).into(),
            Site::Mdh(i, MdhEntry::Theta) => self.rigid[usize::from(i) + 1].z.of(group).into(),
            Site::Base(Axis6::X | Axis6::Y | Axis6::Z) | Site::Flex(_, Axis6::X | Axis6::Y | Axis6::Z) => Vector3::zeros(),
            Site::Base(axis) => {
                let (frame, turned) = self.base_axes(group);
                displacement_axis(&frame, axis, turned).into()
            }
            Site::Flex(k, axis) => {
                let (frame, turned) = self.flex_axes(group, k.into());
                displacement_axis(&frame, axis, turned).into()
            }
        }
    }

    /// Axes in which the base is displaced, and how far it is already turned.
    #[inline(always)]
    fn base_axes<S: Simd>(&self, group: Group<S>) -> (Axes<S>, [Turn<S>; 2]) {
        let [rz, ry, _] = &self.base_turned;
        let (x, y, z) = (group.vector(&Vector3::x()), group.vector(&Vector3::y()), group.vector(&Vector3::z()));
        (Axes { x, y, z, o: self.rigid[0].o.of(group) }, [rz.of(group), ry.of(group)])
    }

    /// The same for the displacement after frame `k`.
    #[inline(always)]
    fn flex_axes<S: Simd>(&self, group: Group<S>, k: usize) -> (Axes<S>, [Turn<S>; 2]) {
        let origin = Axes { o: self.frames()[k].o.of(group), ..self.rigid[k].of(group) };
        let still = Turn { sin: group.splat(0.0), cos: group.splat(1.0) };
        let [rz, ry] = &self.flex_turned[k];
        (origin, if self.flexible { [rz.of(group), ry.of(group)] } else { [still; 2] })
    }

    /// The axis of beta of line `i`.
    #[inline(always)]
    fn beta_axis<S: Simd>(&self, group: Group<S>, i: usize) -> Vector<S> {
        let (previous, alpha) = (&self.frames()[i], self.lines[i].alpha.of(group));
        previous.y.of(group) * alpha.cos + previous.z.of(group) * alpha.sin
    }
}

/// [`Postures::columns`] with the processor's vectors.
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

/// Column of one component of `Tr(x, y, z) Rz Ry Rx` applied after `frame` (axes of the frame, origin after the
/// translation).
#[inline(always)]
fn displacement_column<S: Simd>(frame: &Axes<S>, axis: Axis6, turned: [Turn<S>; 2], tcp: Vector<S>) -> Vector<S> {
    match axis {
        Axis6::X | Axis6::Y | Axis6::Z => displacement_axis(frame, axis, turned),
        Axis6::Rz | Axis6::Ry | Axis6::Rx => displacement_axis(frame, axis, turned).cross(tcp - frame.o),
    }
}

/// The axis along or about which one component of `Tr(x, y, z) Rz Ry Rx` moves, applied after `frame`.
#[inline(always)]
fn displacement_axis<S: Simd>(frame: &Axes<S>, axis: Axis6, [rz, ry]: [Turn<S>; 2]) -> Vector<S> {
    match axis {
        Axis6::X => frame.x,
        Axis6::Y => frame.y,
        Axis6::Z | Axis6::Rz => frame.z,
        Axis6::Ry => frame.y * rz.cos - frame.x * rz.sin,
        Axis6::Rx => (frame.x * rz.cos + frame.y * rz.sin) * ry.cos - frame.z * ry.sin,
    }
}
