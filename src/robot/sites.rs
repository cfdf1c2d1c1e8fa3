//! The sites at which an arm can deviate from nominal. Each is a screw: it rotates the TCP about a line or shifts it along
//! one.

use std::fmt;

/// A rigid-body axis of a frame: three translations, then three rotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Axis6 {
    X,
    Y,
    Z,
    Rz,
    Ry,
    Rx,
}

impl Axis6 {
    /// In the order x, y, z, rz, ry, rx.
    pub const ALL: [Axis6; 6] = [Axis6::X, Axis6::Y, Axis6::Z, Axis6::Rz, Axis6::Ry, Axis6::Rx];

    /// As written in names: `x` ... `rx`.
    pub fn name(self) -> &'static str {
        ["x", "y", "z", "rz", "ry", "rx"][self as usize]
    }
}

/// One of the five entries of a modified DH line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum MdhEntry {
    Alpha,
    A,
    Beta,
    Theta,
    D,
}

impl MdhEntry {
    /// In the order of the transform.
    pub const ALL: [MdhEntry; 5] = [MdhEntry::Alpha, MdhEntry::A, MdhEntry::Beta, MdhEntry::Theta, MdhEntry::D];
}

/// A site of deviation. Joints and links are counted from 0 here, from 1 in names.
///
/// It is passed for every term of every effect at every sample: kept small enough for a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Site {
    /// Robot base in the world, `T(chi) = Tr Rz Ry Rx`; added to the nominal six components.
    Base(Axis6),
    /// An MDH entry of a link; added to the nominal entry. `Theta` is the joint's angle.
    Mdh(u16, MdhEntry),
    /// A small rigid displacement after frame k (0 is the base frame, k the frame of link k), in that frame's axes.
    Flex(u16, Axis6),
    /// TCP in the last frame (0 x, 1 y, 2 z).
    Tool(u16),
    /// The ball, or the measured point, in the world (0 x, 1 y, 2 z).
    Target(u16),
    /// The axes of the instrument that measures orientations, relative to the tool: components of a rotation vector in those
    /// axes (0 x, 1 y, 2 z).
    Probe(u16),
}

/// The largest number of joints of an arm; no real arm has as many.
pub(crate) const MOST_JOINTS: usize = 1000;

impl Site {
    /// An MDH entry of link `i`.
    #[inline]
    pub const fn mdh(i: usize, entry: MdhEntry) -> Self {
        Site::Mdh(i as u16, entry)
    }

    /// A displacement after frame `k`.
    #[inline]
    pub const fn flex(k: usize, axis: Axis6) -> Self {
        Site::Flex(k as u16, axis)
    }

    /// The TCP along axis `k` (0, 1, 2).
    #[inline]
    pub const fn tool(k: usize) -> Self {
        Site::Tool(k as u16)
    }

    /// The ball along axis `k` (0, 1, 2).
    #[inline]
    pub const fn target(k: usize) -> Self {
        Site::Target(k as u16)
    }

    /// The axes of the instrument that measures orientations, about axis `k` (0, 1, 2).
    #[inline]
    pub const fn probe(k: usize) -> Self {
        Site::Probe(k as u16)
    }

    /// Parses a site as printed, for an arm with `joints` joints.
    ///
    /// ```
    /// use calibench::robot::sites::{Axis6, MdhEntry, Site};
    ///
    /// assert_eq!(Site::parse("theta:3", 6), Some(Site::mdh(2, MdhEntry::Theta)));
    /// assert_eq!(Site::parse("flex:6:rz", 6), Some(Site::flex(6, Axis6::Rz)));
    /// assert_eq!(Site::parse("theta:7", 6), None);
    /// ```
    pub fn parse(text: &str, joints: usize) -> Option<Site> {
        let axis = |name: &str| Axis6::ALL.into_iter().find(|a| a.name() == name);
        let xyz = |name: &str| ["x", "y", "z"].iter().position(|n| *n == name);
        let about = |name: &str| name.strip_prefix('r').and_then(xyz);
        let number = |digits: &str| digits.parse::<usize>().ok().filter(|i| *i <= MOST_JOINTS);
        let parts: Vec<&str> = text.split(':').collect();
        let site = match parts[..] {
            ["base", a] => Site::Base(axis(a)?),
            ["alpha", i] => Site::mdh(number(i)?, MdhEntry::Alpha),
            ["a", i] => Site::mdh(number(i)?, MdhEntry::A),
            ["beta", i] => Site::mdh(number(i)?, MdhEntry::Beta),
            ["theta", i] => Site::mdh(number(i)?.checked_sub(1)?, MdhEntry::Theta),
            ["d", i] => Site::mdh(number(i)?.checked_sub(1)?, MdhEntry::D),
            ["flex", k, a] => Site::flex(number(k)?, axis(a)?),
            ["tool", a] => Site::tool(xyz(a)?),
            ["probe", a] => Site::probe(about(a)?),
            ["ball", a] => Site::target(xyz(a)?),
            _ => return None,
        };
        let exists = match site {
            Site::Mdh(i, _) => usize::from(i) < joints,
            Site::Flex(k, _) => usize::from(k) <= joints,
            _ => true,
        };
        exists.then_some(site)
    }
}

/// Numbers the sites of an arm with `joints` joints, so that deviations form one flat vector.
///
/// ```
/// use calibench::robot::sites::SiteIndex;
///
/// // Base 6, flex of the base 6, eleven a link, and three each of tool, target and probe.
/// assert_eq!(SiteIndex::new(6).len(), 6 + 6 + 11 * 6 + 3 * 3);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SiteIndex {
    joints: usize,
}

/// Number of sites of a link: five MDH entries, six flex axes.
const PER_LINK: usize = 11;

impl SiteIndex {
    /// Creates the index for an arm with `joints` joints.
    pub fn new(joints: usize) -> Self {
        SiteIndex { joints }
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        21 + PER_LINK * self.joints
    }

    /// Never empty: base and tool always exist.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// First site of link `i`.
    pub(crate) fn link(&self, i: usize) -> usize {
        12 + PER_LINK * i
    }

    /// First flex site of frame `k`.
    pub(crate) fn flex(&self, k: usize) -> usize {
        if k == 0 { 6 } else { self.link(k - 1) + 5 }
    }

    /// First tool site.
    pub(crate) fn tool(&self) -> usize {
        12 + PER_LINK * self.joints
    }

    /// First target site.
    pub(crate) fn target(&self) -> usize {
        self.tool() + 3
    }

    /// First site of the axes of measured orientations.
    pub(crate) fn probe(&self) -> usize {
        self.target() + 3
    }

    /// Index of a site in the flat vector.
    #[inline]
    pub fn of(&self, site: Site) -> usize {
        match site {
            Site::Base(axis) => axis as usize,
            Site::Mdh(i, entry) => self.link(i.into()) + entry as usize,
            Site::Flex(k, axis) => self.flex(k.into()) + axis as usize,
            Site::Tool(k) => self.tool() + usize::from(k),
            Site::Target(k) => self.target() + usize::from(k),
            Site::Probe(k) => self.probe() + usize::from(k),
        }
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let xyz = |k: &u16| ["x", "y", "z"][usize::from(*k)];
        match self {
            Site::Base(axis) => write!(f, "base:{}", axis.name()),
            Site::Mdh(i, MdhEntry::Alpha) => write!(f, "alpha:{i}"),
            Site::Mdh(i, MdhEntry::A) => write!(f, "a:{i}"),
            Site::Mdh(i, MdhEntry::Beta) => write!(f, "beta:{i}"),
            Site::Mdh(i, MdhEntry::Theta) => write!(f, "theta:{}", i + 1),
            Site::Mdh(i, MdhEntry::D) => write!(f, "d:{}", i + 1),
            Site::Flex(k, axis) => write!(f, "flex:{k}:{}", axis.name()),
            Site::Tool(k) => write!(f, "tool:{}", xyz(k)),
            Site::Target(k) => write!(f, "ball:{}", xyz(k)),
            Site::Probe(k) => write!(f, "probe:r{}", xyz(k)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_site_is_read_as_it_is_printed() {
        let joints = 6;
        let mut sites: Vec<Site> = Axis6::ALL.into_iter().map(Site::Base).collect();
        sites.extend((0..joints).flat_map(|i| MdhEntry::ALL.map(|entry| Site::mdh(i, entry))));
        sites.extend((0..=joints).flat_map(|k| Axis6::ALL.map(|axis| Site::flex(k, axis))));
        sites.extend((0..3).flat_map(|k| [Site::tool(k), Site::target(k), Site::probe(k)]));
        assert_eq!(sites.len(), SiteIndex::new(joints).len());
        for site in sites {
            assert_eq!(Site::parse(&site.to_string(), joints), Some(site));
        }
        for text in [
            "", "theta:0", "theta:7", "d:0", "a:6", "flex:7:x", "flex:1", "flex:1:q", "tool:rx", "probe:x", "probe:rq",
            "ball:1:x", "theta:-1", "theta",
        ] {
            assert_eq!(Site::parse(text, joints), None, "{text}");
        }
    }
}
