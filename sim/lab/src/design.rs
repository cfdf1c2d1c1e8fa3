//! The artifact designer: places the balls of an artifact so that the worst-case uncertainty of the calibration is smallest.
//!
//! Every place of a grid where a ball may stand is examined for postures once (`lesson`). The information about the robot from
//! these postures adds up over the balls of a layout and yields the uncertainty of the TCP at poses of the workspace. Layouts
//! are searched on this criterion (`search`); the best are planned in full, every posture clear of the whole artifact, and
//! tried on the simulated cell.

mod artifact;
mod judged;
mod layouts;
mod page;
mod place_information;
mod search;
mod survey;
mod text;
mod trials;
mod watcher;

use calibench::files::FileError;
use rayon::prelude::*;
use serde::Serialize;

pub use artifact::{Artifact, Place, Workshop};
pub use judged::Judged;
pub use page::design_page;
pub use place_information::{PlaceInformation, Predicted, Sought, Workspace};
pub use search::{Found, Ground, Site};
pub use text::design_text;
pub use trials::{Held, Trials, Verified, verify};
pub use watcher::Watcher;

use self::judged::Full;

use self::layouts::Layouts;
use self::survey::survey;
use calibench_sim::scenario::Document;

/// The uncertainty with the one placed ball at a given place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OnMap {
    /// Centre, world, mm.
    pub centre_mm: [f64; 3],
    /// One-sigma at the worst pose, um; `None` if the ball cannot be probed there, or something remains undetermined.
    pub worst_um: Option<f64>,
}

/// The best artifact of one size.
#[derive(Debug, Clone, Serialize)]
pub struct OnFront {
    /// Size as a fraction of the box.
    pub scale: f64,
    /// The artifact; `None` if none determines the robot.
    pub judged: Option<Judged>,
}

/// Result of a design.
#[derive(Debug, Clone, Serialize)]
pub struct Design {
    /// Name of the scenario.
    pub name: String,
    /// Its question.
    pub question: String,
    /// Seed.
    pub seed: u64,
    /// Number of places of the grid, and of those that can be probed.
    pub places: [usize; 2],
    /// Poses of the workspace.
    pub workspace_poses: usize,
    /// The recommended artifact.
    pub best: Judged,
    /// Others: the scenario's own, and one of three balls.
    pub compared: Vec<Judged>,
    /// The map of a single placed ball: all places of the grid.
    pub map: Option<Vec<OnMap>>,
    /// Accuracy against size.
    pub front: Vec<OnFront>,
}

/// Designs the artifact requested by the scenario's `[design]`, and tries it `trials` times.
///
/// # Errors
/// If the scenario is invalid, has no `[design]`, or no layout determines the robot.
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
            judged.verified =
                verify(scenario, plan, &ground.workspace, predicted, Trials { seed, count: trials }, &|| watcher.step());
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

/// State of a design once the places are known.
struct Designer<'a> {
    layouts: Layouts<'a>,
    ground: &'a Ground<'a>,
    /// Number of balls to be placed.
    placed: usize,
    watcher: &'a dyn Watcher,
}

impl Designer<'_> {
    /// Tries the one ball at every place: the map, and the layouts that can be built, best first.
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

    /// The best finalist, planned in full.
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

    /// The best artifact of each size.
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
