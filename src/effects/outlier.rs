//! `outlier:ID`: one sample disagrees with all others, `target += (x, y, z)` at that sample, in the world.

use super::family::alone;
use super::shape::Shape;
use super::{Family, Origin, Owner, ParameterSpec, Scan};
use crate::robot::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "outlier",
    arguments: ":ID",
    what: "one sample disagrees with all others",
    equation: "target += (x, y, z) at sample ID",
    origin: Origin::SetUp,
    scan: Scan::Sample,
    members: alone,
    build: |id, _| {
        let sample = id.arguments.join(":");
        if sample.is_empty() {
            return Err(id.wrong("names a sample after the colon"));
        }
        Shape::new(id, ParameterSpec::xyz(id.whole, Unit::MM, 0.2 * MM), move |at, emit| {
            if at.sample == Some(sample.as_str()) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        // Samples have names of their own within a dataset.
        .owner(Owner::Artifact)
        .built()
    },
};
