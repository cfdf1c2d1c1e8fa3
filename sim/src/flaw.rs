//! Something truly wrong with the cell: it moves sites of the arm, the gauge or the artifact in each situation.

use std::sync::Arc;

use calibench::effects::{Effect, Situation};
use calibench::robot::Site;

/// A flaw of the simulated cell at its true size. Models have [`Effect`]s with sizes to be found; a flaw need not be one of them.
pub trait Flaw: Send + Sync {
    /// Calls `moved(site, by)` for every site that it moves in that situation, SI; what is given for one site adds up.
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64));

    /// What it moves, where that is the same in every situation.
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
    /// What moves its sites.
    pub all: Vec<Arc<dyn Flaw>>,
    /// Lost motion of each joint by the side from which it came, rad; the joints change sides gradually, so they keep it.
    pub hysteresis: Vec<f64>,
    /// Where each plunger hangs up by the side from which it came, m; kept by the plungers likewise.
    pub stiction: [f64; 3],
    /// Compliance that each joint truly has, rad/(N·m): what loads that are not as entered act through.
    pub compliance: Vec<f64>,
}

impl Flaws {
    /// None, of an arm with so many joints.
    pub fn none(joints: usize) -> Self {
        Flaws { all: Vec::new(), hysteresis: vec![0.0; joints], stiction: [0.0; 3], compliance: vec![0.0; joints] }
    }
}
