//! The survey of a cell: the places where a ball can be probed, and the information from each.

use calibench::files::FileError;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use rayon::prelude::*;

use super::artifact::{Artifact, Place};
use super::layouts::Layouts;
use super::place_information::{PlaceInformation, Sought, Workspace};
use super::search::{Ground, Site};
use super::watcher::Watcher;
use calibench_sim::planning::PlanError;

/// Number of postures from which the independent unknowns of all places together are found.
const SHOWING: usize = 1500;

/// Surveys every place where a ball may be.
///
/// # Errors
/// If a ball that stays cannot be probed, too few others can, or nothing determines the robot.
pub fn survey<'a>(layouts: &Layouts<'a>, watcher: &dyn Watcher) -> Result<Ground<'a>, FileError> {
    let workshop = layouts.workshop;
    let (scenario, model, kept) = (&workshop.scenario, &workshop.scenario.model, &workshop.kept);
    let places: Vec<Place> = workshop.grid().into_iter().filter(|p| workshop.is_free(p, kept)).collect();
    watcher.stage("probing every place", (places.len() + kept.len()) as u64);
    let pools = pools(layouts, &places, watcher)?;
    let kept_pools = kept_pools(layouts, watcher)?;
    let reachable = pools.iter().flatten().count();
    if reachable + kept.len() < workshop.design.balls {
        let problem = format!("of {} places {reachable} can be probed", places.len());
        return Err(workshop.document.wrong(
            "design.min_mm",
            problem,
            "move the box, take a finer step, or other riser heights",
        ));
    }
    let locate = |e: PlanError| scenario.locate_plan(&e);
    let sought = Sought::new(&together(kept_pools.iter().chain(pools.iter().flatten())), model).map_err(locate)?;
    let workspace = Workspace::new(&scenario.dataset(), model, &sought, layouts.workspace()?).map_err(locate)?;
    let information = |cell: &Dataset| PlaceInformation::new(cell, model, &sought).map_err(locate);
    let of_places: Vec<Option<PlaceInformation>> = pools
        .par_iter()
        .map(|cell| Ok::<_, FileError>(cell.as_ref().map(information).transpose()?.flatten()))
        .collect::<Result<_, _>>()?;
    let kept = kept.iter().zip(&kept_pools).map(|(&ball, cell)| Ok(information(cell)?.map(|information| (ball, information))));
    let kept = kept.collect::<Result<Vec<_>, FileError>>()?.into_iter().flatten().collect();
    let (mut grid, mut sites) = (Vec::with_capacity(places.len()), Vec::new());
    for (place, information) in places.into_iter().zip(of_places) {
        grid.push((place, information.is_some().then_some(sites.len())));
        sites.extend(information.map(|information| Site { place, information }));
    }
    Ok(Ground { workshop, kept, grid, sites, sought, workspace, seed: layouts.seed })
}

/// Least number of postures at a place or at a ball that stays.
fn enough(layouts: &Layouts<'_>) -> usize {
    let (asked, kept) = (&layouts.workshop.design, layouts.workshop.kept.len());
    asked.poses_per_ball(asked.balls.min(3).max(kept + 1).min(asked.balls))
}

/// For every place with enough postures: the cell with those postures and a single ball.
fn pools(layouts: &Layouts<'_>, places: &[Place], watcher: &dyn Watcher) -> Result<Vec<Option<Dataset>>, FileError> {
    let (kept, most) = (&layouts.workshop.kept, enough(layouts));
    let of_place = |place: &Place| {
        let found = layouts.postures(&Artifact { kept: kept.clone(), placed: vec![*place] }, kept.len());
        watcher.step();
        found.map(|found| found.filter(|cell| cell.samples.len() >= most))
    };
    places.par_iter().map(of_place).collect()
}

/// For every ball that stays: the cell with the postures found at that ball, and no other ball.
fn kept_pools(layouts: &Layouts<'_>, watcher: &dyn Watcher) -> Result<Vec<Dataset>, FileError> {
    let (workshop, most) = (layouts.workshop, enough(layouts));
    let of_ball = |(k, ball): (usize, &usize)| {
        let found = layouts.postures(&workshop.all_kept(), k)?.filter(|cell| cell.samples.len() >= most);
        watcher.step();
        found.ok_or_else(|| {
            let problem = format!("ball '{}' cannot be probed", workshop.scenario.ball_ids()[*ball]);
            workshop.document.wrong("design.fixed", problem, "move it")
        })
    };
    workshop.kept.iter().enumerate().map(of_ball).collect()
}

/// Combines the samples of several cells, one ball each, into one cell, limiting the number from each so that the total stays
/// small.
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
