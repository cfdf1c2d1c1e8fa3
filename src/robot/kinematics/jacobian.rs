//! The columns of the position Jacobian: every site is a screw, so its column is an axis, or `axis x (tcp - point)`.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::super::{Axis6, MdhEntry, Site, Vectors};
use super::Postures;
use super::mdh_rows::{MdhRows, Turn};
use crate::math::simd::{Axes, Group, Vector, in_lanes};

impl<const L: usize> Postures<L> {
    /// The [column](super::Posture::column) of every site at its index (see [`SiteIndex`](crate::robot::SiteIndex)), except
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
        self.column_at(lane, Site::mdh(i, if self.slides(i) { MdhEntry::D } else { MdhEntry::Theta }))
    }

    /// The [column](super::Posture::column) of a site in a group of postures.
    // Always inlined: returned through memory, each of a Jacobian's columns would wait for the stores of its parts.
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
                        let MdhRows { alpha, a, .. } = &self.lines[i];
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
