//! The designer of artifacts: where the balls of an artifact should stand, so that the calibration is surest where it is least sure.
//!
//! Every place of a grid where a ball may stand is tried for postures once (`lesson`); what they teach adds up over the balls of a
//! layout to the information about the robot, and that gives the uncertainty of the TCP at poses of the workspace. Layouts are searched
//! on that (`search`); the best are planned in full, every posture clear of the whole artifact, and tried on the simulated cell.

mod artifact;
mod layouts;
mod lesson;
mod page;
mod search;
mod survey;
mod trials;

use calibench::files::FileError;
use rayon::prelude::*;
use serde::Serialize;

pub use artifact::{Artifact, Place, Workshop};
pub use lesson::{Lesson, Predicted, Sought, Workspace};
pub use page::design_page;
pub use search::{Found, Ground, Site};
pub use trials::{Held, Verified, verify};

use self::layouts::Layouts;
use self::survey::survey;
use crate::planning::Plan;
use crate::scenario::{Document, Scenario};

/// One artifact, planned in full and judged.
#[derive(Debug, Clone, Serialize)]
pub struct Judged {
    /// What it is called.
    pub name: String,
    /// Names and centres of its balls, world, mm.
    pub balls: Vec<(String, [f64; 3])>,
    /// Probings in all.
    pub probings: usize,
    /// One-sigma of the TCP's place at the worst pose of the workspace, um.
    pub worst_um: f64,
    /// Mean over the poses, um.
    pub mean_um: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Along x, along y, and height over the table, mm.
    pub size_mm: [f64; 3],
    /// Trials on the simulated cell.
    pub verified: Option<Verified>,
    #[serde(skip)]
    full: Option<Full>,
}

/// An artifact with all that its trials need.
#[derive(Clone)]
struct Full {
    document: Document,
    scenario: Scenario,
    plan: Plan,
    predicted: Predicted,
}

impl std::fmt::Debug for Full {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Full({})", self.scenario.name)
    }
}

impl Judged {
    /// The scenario that has this artifact.
    pub fn document(&self) -> Option<&Document> {
        self.full.as_ref().map(|f| &f.document)
    }
}

/// What the uncertainty would be with the one ball that is placed standing there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OnMap {
    /// Centre, world, mm.
    pub centre_mm: [f64; 3],
    /// One-sigma at the worst pose, um; `None` where it cannot be probed, or leaves something undetermined.
    pub worst_um: Option<f64>,
}

/// The best artifact of one size.
#[derive(Debug, Clone, Serialize)]
pub struct OnFront {
    /// Share of the box.
    pub scale: f64,
    /// The artifact; `None` where none determines the robot.
    pub judged: Option<Judged>,
}

/// All that a design came to.
#[derive(Debug, Clone, Serialize)]
pub struct Design {
    /// Name of the scenario.
    pub name: String,
    /// Its question.
    pub question: String,
    /// Seed.
    pub seed: u64,
    /// Places of the grid, and those of them that can be probed.
    pub places: [usize; 2],
    /// Poses of the workspace.
    pub workspace_poses: usize,
    /// The artifact recommended.
    pub best: Judged,
    /// Others: the scenario's own, and one of three balls.
    pub compared: Vec<Judged>,
    /// Where a single ball is placed: all places of the grid.
    pub map: Option<Vec<OnMap>>,
    /// Accuracy against size.
    pub front: Vec<OnFront>,
}

/// Who is told how far a design is.
pub trait Watcher: Sync {
    /// A stage begins, of so many steps where that is known.
    fn stage(&self, what: &'static str, steps: u64);
    /// One step is done.
    fn step(&self);
}

impl Watcher for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn step(&self) {}
}

/// Designs the artifact that the scenario's `[design]` asks for, and tries it `trials` times.
///
/// # Errors
/// When the scenario is not as it must be, has no `[design]`, or no layout determines the robot.
pub fn design(document: &Document, seed: u64, trials: u64, watcher: &dyn Watcher) -> Result<Design, FileError> {
    let workshop = Workshop::open(document)?;
    let layouts = Layouts { workshop: &workshop, seed };
    let ground = survey(&layouts, watcher)?;
    let designer = Designer { layouts, ground: &ground, placed: workshop.design.balls - workshop.kept.len(), watcher };

    let (map, found) = match designer.placed {
        1 => designer.place_one(),
        placed => {
            watcher.stage("exchanging places", 1);
            (None, ground.search(placed, &ground.all()))
        }
    };
    watcher.stage("planning the best", 1);
    let Some(mut best) = designer.best_of(&found, "recommended") else {
        let remedy = "widen the box, allow more mass, or more probings";
        return Err(document.wrong("design", "no layout can be built, probed and determines the robot", remedy));
    };
    let mut compared = designer.compared();
    let front = designer.front();
    if trials > 0 {
        watcher.stage("trials", trials * (1 + compared.len() as u64));
        for judged in std::iter::once(&mut best).chain(&mut compared) {
            let Some(Full { scenario, plan, predicted, .. }) = &judged.full else { continue };
            judged.verified = verify(scenario, plan, (&ground.workspace, predicted), (seed, trials), &|| watcher.step());
        }
    }
    Ok(Design {
        name: workshop.scenario.name.clone(),
        question: workshop.scenario.question.clone(),
        seed,
        places: [ground.grid.len(), ground.sites.len()],
        workspace_poses: ground.workspace.poses.len(),
        best,
        compared,
        map,
        front,
    })
}

/// A design once the places are known.
struct Designer<'a> {
    layouts: Layouts<'a>,
    ground: &'a Ground<'a>,
    /// Balls to be placed.
    placed: usize,
    watcher: &'a dyn Watcher,
}

impl Designer<'_> {
    /// The one ball tried at every place: the map, and what can be built, best first.
    fn place_one(&self) -> (Option<Vec<OnMap>>, Vec<Found>) {
        let Designer { ground, watcher, .. } = self;
        let all = ground.all();
        watcher.stage("the ball at every place", all.len() as u64);
        let of_one = |&s: &usize| {
            let worst = ground.with_chosen_postures(&[s]).map(|p| p.worst().0);
            watcher.step();
            worst
        };
        let worst: Vec<Option<f64>> = all.par_iter().map(of_one).collect();
        let on_map =
            |place: &Place, site: &Option<usize>| OnMap { centre_mm: place.centre_mm, worst_um: site.and_then(|s| worst[s]) };
        let map = ground.grid.iter().map(|(place, site)| on_map(place, site)).collect();
        let of = |s: usize| worst[s].map(|worst_um| Found { sites: vec![s], worst_um });
        let mut found: Vec<Found> = all.into_iter().filter(|&s| ground.is_allowed(&[s])).filter_map(of).collect();
        found.sort_by(|a, b| a.worst_um.total_cmp(&b.worst_um).then_with(|| a.sites.cmp(&b.sites)));
        (Some(map), found)
    }

    fn judged(&self, artifact: &Artifact, name: &str) -> Option<Judged> {
        self.layouts.judged(artifact, name, &self.ground.sought, &self.ground.workspace)
    }

    /// The best of the finalists, planned in full.
    fn best_of(&self, found: &[Found], name: &str) -> Option<Judged> {
        let finalists = found.iter().take(self.layouts.workshop.design.finalists);
        let judged = finalists.filter_map(|f| self.judged(&self.ground.artifact(&f.sites), name));
        judged.min_by(|a, b| a.worst_um.total_cmp(&b.worst_um))
    }

    /// The scenario's own artifact, and one of three balls.
    fn compared(&self) -> Vec<Judged> {
        let workshop = self.layouts.workshop;
        let own = Artifact { kept: (0..workshop.scenario.ball_ids().len()).collect(), placed: Vec::new() };
        let three = match workshop.kept.len() {
            _ if workshop.design.balls <= 3 => None,
            kept @ 0..3 => self.best_of(&self.ground.search(3 - kept, &self.ground.all()), "best of three balls"),
            3 => self.judged(&workshop.all_kept(), "the three that are fixed"),
            _ => None,
        };
        self.judged(&own, "the scenario's own").into_iter().chain(three).collect()
    }

    /// The best of every size.
    fn front(&self) -> Vec<OnFront> {
        let Designer { layouts: Layouts { workshop, .. }, ground, watcher, .. } = self;
        watcher.stage("smaller and smaller", workshop.design.scales.len() as u64);
        let of_scale = |&scale: &f64| {
            let within = |s: &usize| workshop.is_within(&ground.sites[*s].place, scale);
            let among: Vec<usize> = ground.all().into_iter().filter(within).collect();
            let judged = self.best_of(&ground.search(self.placed, &among), "best of its size");
            watcher.step();
            OnFront { scale, judged }
        };
        workshop.design.scales.iter().map(of_scale).collect()
    }
}
