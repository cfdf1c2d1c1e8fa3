//! The designer of artifacts: where the balls of an artifact should stand, so that the calibration is surest where it is least sure.
//!
//! Every place of a grid where a ball may stand is tried for postures once (`lesson`); what they teach adds up over the balls of a
//! layout to the information about the robot, and that gives the uncertainty of the TCP at poses of the workspace. Layouts are searched
//! on that (`search`); the best are planned in full, every posture clear of the whole artifact, and tried on the simulated cell.

mod artifact;
mod lesson;
mod page;
mod search;
mod trials;

use calibench::files::FileError;
use calibench::measure::{Dataset, FreePosesRequest, Measured, Sample, free_poses};
use rayon::prelude::*;
use serde::Serialize;

pub use artifact::{Artifact, Place, Workshop};
pub use lesson::{Lesson, Predicted, Sought, Workspace};
pub use page::design_page;
pub use search::{Found, Ground, Site};
pub use trials::{Held, Verified, verify};

use crate::planning::{Plan, PlanError, layout, plan, pool, wanted};
use crate::scenario::{Document, Scenario};

/// Postures by which all places together show which numbers can be told apart.
const SHOWING: usize = 1500;

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
    let scenario = document.scenario()?;
    let Some(asked) = scenario.design.clone() else {
        return Err(document.wrong(
            "design",
            "is missing",
            "say in [design] how many balls, where, and of what the artifact is made",
        ));
    };
    let workshop = Workshop { document: document.clone(), scenario, design: asked };
    let Workshop { scenario, design: asked, .. } = &workshop;
    let ids = scenario.ball_ids();
    let kept: Vec<usize> = asked.fixed.iter().filter_map(|id| ids.iter().position(|b| b == id)).collect();
    if !kept.is_empty() && !asked.scales.is_empty() {
        return Err(document.wrong(
            "design.scales",
            "an artifact with fixed balls has its size",
            "leave out `fixed`, or `scales`",
        ));
    }
    if let Some(name) = asked.without.iter().find(|name| !workshop.has_solid(name)) {
        return Err(document.wrong("design.without", format!("there is no solid '{name}'"), "name bodies of [[solid]]"));
    }
    let grid: Vec<Place> = workshop.grid().into_iter().filter(|p| workshop.is_free(p, &kept)).collect();
    let layouts = Layouts { workshop: &workshop, seed };

    watcher.stage("probing every place", (grid.len() + kept.len()) as u64);
    let most = asked.poses_per_ball(asked.balls.min(3).max(kept.len() + 1).min(asked.balls));
    let pools: Vec<Option<Dataset>> = grid
        .par_iter()
        .map(|place| {
            let found = layouts.postures(&Artifact { kept: kept.clone(), placed: vec![*place] }, kept.len());
            watcher.step();
            found.map(|f| f.filter(|cell| cell.samples.len() >= most))
        })
        .collect::<Result<_, _>>()?;
    let all_kept = Artifact { kept: kept.clone(), placed: Vec::new() };
    let kept_pools: Vec<Dataset> = (0..kept.len())
        .map(|k| {
            let found = layouts.postures(&all_kept, k)?.filter(|cell| cell.samples.len() >= most);
            watcher.step();
            found.ok_or_else(|| {
                document.wrong("design.fixed", format!("ball '{}' cannot be probed", ids[kept[k]]), "place it anew")
            })
        })
        .collect::<Result<_, _>>()?;
    let reachable = pools.iter().flatten().count();
    if reachable + kept.len() < asked.balls {
        let problem = format!("of {} places {reachable} can be probed", grid.len());
        return Err(document.wrong("design.min_mm", problem, "move the box, take a finer step, or other riser heights"));
    }
    let blame = |e: PlanError| scenario.blame_plan(&e);
    let model = &scenario.model;
    let sought = Sought::new(&together(kept_pools.iter().chain(pools.iter().flatten())), model).map_err(blame)?;
    let workspace = Workspace::new(&scenario.dataset(), model, &sought, layouts.workspace()?).map_err(blame)?;
    let lesson = |cell: &Dataset| Lesson::new(cell, model, &sought).map_err(blame);
    let sites: Vec<Option<Site>> = grid
        .par_iter()
        .zip(&pools)
        .map(|(place, cell)| {
            let lesson = cell.as_ref().map(lesson).transpose()?.flatten();
            Ok::<_, FileError>(lesson.map(|lesson| Site { place: *place, lesson }))
        })
        .collect::<Result<_, _>>()?;
    drop(pools);
    let kept_lessons = kept.iter().zip(&kept_pools).map(|(&b, cell)| Ok(lesson(cell)?.map(|l| (b, l))));
    let kept_lessons = kept_lessons.collect::<Result<Vec<_>, FileError>>()?.into_iter().flatten().collect();
    let at: Vec<Option<usize>> =
        sites.iter().scan(0, |next, site| Some(site.as_ref().map(|_| std::mem::replace(next, *next + 1)))).collect();
    let sites: Vec<Site> = sites.into_iter().flatten().collect();
    let all: Vec<usize> = (0..sites.len()).collect();
    let ground = Ground { workshop: &workshop, kept: kept_lessons, sites, sought: &sought, workspace: &workspace, seed };

    let placed = asked.balls - kept.len();
    let (map, found) = if placed == 1 {
        watcher.stage("the ball at every place", all.len() as u64);
        let worst: Vec<Option<f64>> = all
            .par_iter()
            .map(|&s| {
                let worst = ground.with_chosen_postures(&[s]).map(|p| p.worst().0);
                watcher.step();
                worst
            })
            .collect();
        let map = grid.iter().zip(&at).map(|(p, at)| OnMap { centre_mm: p.centre_mm, worst_um: at.and_then(|s| worst[s]) });
        let allowed = |s: &usize| ground.is_allowed(&[*s]);
        let mut found: Vec<Found> = all
            .iter()
            .filter(|s| allowed(s))
            .filter_map(|&s| worst[s].map(|worst_um| Found { sites: vec![s], worst_um }))
            .collect();
        found.sort_by(|a, b| a.worst_um.total_cmp(&b.worst_um).then_with(|| a.sites.cmp(&b.sites)));
        (Some(map.collect()), found)
    } else {
        watcher.stage("exchanging places", 1);
        (None, ground.search(placed, &all))
    };
    let judge = |artifact: &Artifact, name: &str| layouts.judged(artifact, name, &sought, &workspace);
    watcher.stage("planning the best", 1);
    let best_of = |found: &[Found], name: &str| {
        let finalists = found.iter().take(asked.finalists).map(|f| judge(&ground.artifact(&f.sites), name));
        finalists.flatten().min_by(|a, b| a.worst_um.total_cmp(&b.worst_um))
    };
    let Some(mut best) = best_of(&found, "recommended") else {
        let remedy = "widen the box, allow more mass, or more probings";
        return Err(document.wrong("design", "no layout can be built, probed and determines the robot", remedy));
    };
    let mut compared: Vec<Judged> = Vec::new();
    let own = Artifact { kept: (0..ids.len()).collect(), placed: Vec::new() };
    compared.extend(judge(&own, "the scenario's own"));
    if asked.balls > 3 {
        let three = match kept.len() {
            0..3 => best_of(&ground.search(3 - kept.len(), &all), "best of three balls"),
            3 => judge(&all_kept, "the three that are fixed"),
            _ => None,
        };
        compared.extend(three);
    }
    watcher.stage("smaller and smaller", asked.scales.len() as u64);
    let mut front = Vec::with_capacity(asked.scales.len());
    for &scale in &asked.scales {
        let among: Vec<usize> = all.iter().copied().filter(|&s| workshop.is_within(&ground.sites[s].place, scale)).collect();
        let judged = best_of(&ground.search(placed, &among), "best of its size");
        front.push(OnFront { scale, judged });
        watcher.step();
    }
    if trials > 0 {
        watcher.stage("trials", trials * (1 + compared.len() as u64));
        for judged in std::iter::once(&mut best).chain(&mut compared) {
            let Some(Full { scenario, plan, predicted, .. }) = &judged.full else { continue };
            judged.verified = verify(scenario, plan, (&workspace, predicted), (seed, trials), &|| watcher.step());
        }
    }
    Ok(Design {
        name: scenario.name.clone(),
        question: scenario.question.clone(),
        seed,
        places: [grid.len(), ground.sites.len()],
        workspace_poses: workspace.poses.len(),
        best,
        compared,
        map,
        front,
    })
}

/// Artifacts in the cell.
struct Layouts<'a> {
    workshop: &'a Workshop,
    seed: u64,
}

impl Layouts<'_> {
    /// The cell with the postures found at one ball of an artifact as samples, and no other ball; `None` where there is none.
    fn postures(&self, artifact: &Artifact, ball: usize) -> Result<Option<Dataset>, FileError> {
        let scenario = self.workshop.document(artifact, 1)?.scenario()?;
        let Ok(found) = pool(&scenario, &[ball], self.workshop.design.pool_per_place, self.seed) else { return Ok(None) };
        let mut cell = scenario.dataset();
        cell.balls = vec![cell.balls[ball].clone()];
        cell.samples = found
            .into_iter()
            .enumerate()
            .map(|(k, c)| Sample::new(k.to_string(), c.q, Measured::Ball { ball: 0, reading: None }))
            .collect();
        Ok(Some(cell))
    }

    /// Postures all over the workspace, clear of what stays when the artifact is away, rad.
    fn workspace(&self) -> Result<Vec<Vec<f64>>, FileError> {
        let scenario = &self.workshop.scenario;
        let (cell, layout) = (scenario.dataset(), layout(scenario));
        free_poses(&FreePosesRequest {
            robot: &cell.robot,
            base: &cell.base,
            tool: &cell.tool,
            surroundings: &layout.without_artifact,
            margins: layout.margins,
            facing: None,
            count: self.workshop.design.workspace_poses,
            seed: self.seed,
        })
        .map_err(|e| scenario.blame_plan(&e.into()))
    }

    /// An artifact planned in full, every posture clear of all of it; `None` where it cannot be planned or leaves something undetermined.
    fn judged(&self, artifact: &Artifact, name: &str, sought: &Sought, workspace: &Workspace) -> Option<Judged> {
        let balls = artifact.kept.len() + artifact.placed.len();
        let document = self.workshop.document(artifact, self.workshop.design.poses_per_ball(balls)).ok()?;
        let scenario = document.scenario().ok()?;
        let plan = plan(&scenario, self.seed).ok()?;
        let probed = plan.probings.iter().filter(|p| !p.reserve).map(|p| {
            let measured = Measured::Ball { ball: p.ball, reading: None };
            Sample { payload: p.payload, ..Sample::new(&*p.id, p.contact.clone(), measured) }
        });
        let cell = Dataset { samples: probed.collect(), ..scenario.dataset() };
        let predicted = workspace.predicted(&sought.information(&cell, &scenario.model).ok()??)?;
        Some(Judged {
            name: name.into(),
            balls: self.workshop.balls(artifact),
            probings: wanted(&plan.probings),
            worst_um: predicted.worst().0,
            mean_um: predicted.mean(),
            mass_kg: self.workshop.mass_kg(artifact),
            size_mm: self.workshop.size_mm(artifact),
            verified: None,
            full: Some(Full { document, scenario, plan, predicted }),
        })
    }
}

/// Samples of several cells with a ball each, as one cell: so many of each that all together are a few.
fn together<'a>(cells: impl Iterator<Item = &'a Dataset> + Clone) -> Dataset {
    let of_each = (SHOWING / cells.clone().count().max(1)).max(3);
    let mut all = Dataset::default();
    for (k, cell) in cells.enumerate() {
        if k == 0 {
            all = Dataset { balls: Vec::new(), samples: Vec::new(), ..cell.clone() };
        }
        let mut ball = cell.balls[0].clone();
        ball.id = format!("place {k}");
        all.balls.push(ball);
        let stride = (cell.samples.len() / of_each).max(1);
        all.samples.extend(cell.samples.iter().step_by(stride).take(of_each).enumerate().map(|(n, s)| Sample {
            id: format!("{k} {n}"),
            measured: Measured::Ball { ball: k, reading: None },
            ..s.clone()
        }));
    }
    all
}
