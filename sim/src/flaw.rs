//! Flaws of the cell: true errors that move sites of the arm, the gauge or the artifact in each situation.

use std::sync::Arc;

use calibench::effects::Effect;
use calibench::effects::situation::Situation;
use calibench::robot::sites::Site;

/// A flaw of the simulated cell at its true size. Models have [`Effect`]s with sizes to be estimated; a flaw need not
/// be one of them.
pub trait Flaw: Send + Sync {
    /// Calls `moved(site, by)` for every site that it moves in this situation, SI; contributions to the same site add up.
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64));

    /// Its contributions, if they are the same in every situation.
    fn constant(&self) -> Option<Vec<(Site, f64)>> {
        None
    }
}

/// An effect of the catalogue with its true size.
#[derive(Clone)]
pub struct TrueEffect {
    /// Its shape.
    pub effect: Arc<dyn Effect>,
    /// Its parameters, SI.
    pub sizes: Vec<f64>,
}

impl Flaw for TrueEffect {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        self.effect.terms(at, &mut |k, site, weight| moved(site, weight * self.sizes[k]));
    }

    fn constant(&self) -> Option<Vec<(Site, f64)>> {
        Some(self.effect.constant()?.iter().map(|&(k, site, weight)| (site, weight * self.sizes[k])).collect())
    }
}

/// All flaws of a cell.
#[derive(Clone)]
pub struct Flaws {
    /// The flaws that move sites.
    pub all: Vec<Arc<dyn Flaw>>,
    /// Hysteresis of each joint, rad; kept by the joints, because their Dahl friction states change gradually.
    pub hysteresis: Vec<f64>,
    /// Stiction of each plunger, m; kept by the plungers likewise.
    pub stiction: [f64; 3],
    /// True compliance of each joint, rad/(N·m), through which loads that differ from those entered act.
    pub compliance: Vec<f64>,
}

impl Flaws {
    /// No flaws, for an arm with this many joints.
    pub fn none(joints: usize) -> Self {
        Flaws { all: Vec::new(), hysteresis: vec![0.0; joints], stiction: [0.0; 3], compliance: vec![0.0; joints] }
    }
}
