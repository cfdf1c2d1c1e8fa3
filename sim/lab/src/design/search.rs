//! Search for ball places: exchanged one by one until no ball improves elsewhere.

use calibench::measure::poses::selection::{Candidates, Quota, Request, select};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::artifact::{Artifact, Place, Workshop};
use super::place_information::{PlaceInformation, Predicted, Sought, Workspace};

/// Limit of rounds over all balls; a search that still changes after these is cycling because of rounding errors.
const MOST_ROUNDS: usize = 50;
/// Relative improvement required of an exchange.
const GAIN: f64 = 1e-9;
/// Longest excursion in the choice of postures: a few thousandths of O1 worse than the longest ones, at a tenth of their cost.
const EXCURSION: usize = 2;

/// A place that can be probed, and the information from it.
pub struct Site {
    /// The place.
    pub place: Place,
    /// The information from its postures.
    pub information: PlaceInformation,
}

/// Input of a search.
pub struct Ground<'a> {
    /// The components of the artifacts.
    pub workshop: &'a Workshop,
    /// Balls that stay.
    pub kept: Vec<(usize, PlaceInformation)>,
    /// Every place where a ball may be, with the index of its site; `None` if it cannot be probed.
    pub grid: Vec<(Place, Option<usize>)>,
    /// Places that can be probed.
    pub sites: Vec<Site>,
    /// The unknowns.
    pub sought: Sought,
    /// The workspace on which layouts are judged.
    pub workspace: Workspace,
    /// Seed.
    pub seed: u64,
}

/// Sites of the added balls, ascending, and the expected worst uncertainty, um.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Indices of the sites.
    pub sites: Vec<usize>,
    /// One-sigma at the worst pose, um.
    pub worst_um: f64,
}

/// The information of average postures.
struct AverageInformation {
    /// Prior information, and that from the balls that stay.
    base: DMatrix<f64>,
    /// Information from a ball at each place.
    of_places: Vec<DMatrix<f64>>,
}

impl AverageInformation {
    /// The information with balls at the places `at`, except ball number `but`.
    fn of(&self, at: &[usize], but: usize) -> DMatrix<f64> {
        let others = at.iter().enumerate().filter(|(b, _)| *b != but);
        others.fold(self.base.clone(), |sum, (_, &place)| sum + &self.of_places[place])
    }
}

impl Ground<'_> {
    /// All sites, by index.
    pub fn all(&self) -> Vec<usize> {
        (0..self.sites.len()).collect()
    }

    /// The artifact with balls at these sites.
    pub fn artifact(&self, sites: &[usize]) -> Artifact {
        Artifact {
            kept: self.kept.iter().map(|(b, _)| *b).collect(),
            placed: sites.iter().map(|&s| self.sites[s].place).collect(),
        }
    }

    /// True if the artifact can be built and carried.
    pub fn is_allowed(&self, sites: &[usize]) -> bool {
        let places: Vec<&Place> = sites.iter().map(|&s| &self.sites[s].place).collect();
        let apart = (1..places.len()).all(|k| places[..k].iter().all(|p| self.workshop.go_together(p, places[k])));
        apart && self.workshop.design.most_kg.is_none_or(|most| self.workshop.mass_kg(&self.artifact(sites)) <= most)
    }

    /// The best layouts of `count` further balls among `among`, one for each start with a distinct result, best first.
    ///
    /// During the exchange a ball contributes the information of average postures; for the final layouts postures are chosen as
    /// in a plan.
    pub fn search(&self, count: usize, among: &[usize]) -> Vec<Found> {
        let poses = self.workshop.design.poses_per_ball(self.kept.len() + count);
        let of_places = among.par_iter().map(|&s| self.sites[s].information.on_average(poses)).collect();
        let mut base = self.sought.beforehand();
        self.kept.iter().for_each(|(_, information)| base += information.on_average(poses));
        let average = AverageInformation { base, of_places };
        let worst = |information: &DMatrix<f64>| self.workspace.predicted(information).map_or(f64::INFINITY, |p| p.worst().0);
        let mut ends: Vec<Vec<usize>> = (0..self.workshop.design.starts)
            .into_par_iter()
            .filter_map(|start| self.exchange(start, count, among, &average, &worst))
            .collect();
        ends.sort();
        ends.dedup();
        let chosen = |sites: Vec<usize>| {
            let worst_um = self.with_chosen_postures(&sites)?.worst().0;
            Some(Found { sites, worst_um })
        };
        let mut found: Vec<Found> = ends.into_par_iter().filter_map(chosen).collect();
        found.sort_by(|a, b| a.worst_um.total_cmp(&b.worst_um).then_with(|| a.sites.cmp(&b.sites)));
        found
    }

    /// One start: balls at random, then each in turn moved to its best place.
    fn exchange(
        &self,
        start: usize,
        count: usize,
        among: &[usize],
        average: &AverageInformation,
        worst: &(dyn Fn(&DMatrix<f64>) -> f64 + Sync),
    ) -> Option<Vec<usize>> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(start as u64);
        let sites = |places: &[usize]| places.iter().map(|&p| among[p]).collect::<Vec<usize>>();
        let mut order: Vec<usize> = (0..among.len()).collect();
        order.shuffle(&mut random);
        let mut at: Vec<usize> = Vec::with_capacity(count);
        for place in order {
            at.push(place);
            if at.len() > count || !self.is_allowed(&sites(&at)) {
                at.pop();
            }
        }
        if at.len() < count {
            return None;
        }
        let mut best = worst(&average.of(&at, count));
        for _ in 0..MOST_ROUNDS {
            let before = best;
            for ball in 0..count {
                let others = average.of(&at, ball);
                let moved = |place: usize| {
                    let mut there = at.clone();
                    there[ball] = place;
                    self.is_allowed(&sites(&there)).then(|| (worst(&(&others + &average.of_places[place])), place))
                };
                let tried: Vec<(f64, usize)> = (0..among.len()).into_par_iter().filter_map(moved).collect();
                // The first of equal values, whatever the number of threads.
                let least = tried.into_iter().fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
                if least.0 < best * (1.0 - GAIN) {
                    (best, at[ball]) = least;
                }
            }
            if best >= before {
                break;
            }
        }
        let mut found = sites(&at);
        found.sort_unstable();
        best.is_finite().then_some(found)
    }

    /// Uncertainty of an artifact whose postures are chosen by observability; `None` if it leaves something undetermined.
    pub fn with_chosen_postures(&self, sites: &[usize]) -> Option<Predicted> {
        let places: Vec<&PlaceInformation> =
            self.kept.iter().map(|(_, l)| l).chain(sites.iter().map(|&s| &self.sites[s].information)).collect();
        let poses = self.workshop.design.poses_per_ball(places.len());
        let rows: Vec<f64> = places.iter().flat_map(|l| l.plain()).copied().collect();
        let groups: Vec<usize> = places.iter().enumerate().flat_map(|(g, l)| vec![g; l.postures()]).collect();
        let candidates = Candidates::new(&rows, self.sought.flat(), groups).ok()?;
        let quota = Quota::PerGroup(vec![poses; places.len()]);
        let request = Request { starts: 1, seed: self.seed, excursion: EXCURSION, ..Request::new(quota) };
        let selection = select(&candidates, &request).ok()?;
        let mut information = self.sought.beforehand();
        let mut first = 0;
        for place in places {
            let own = first..first + place.postures();
            information += place.of(selection.poses.iter().filter(|p| own.contains(p)).map(|p| p - own.start));
            first = own.end;
        }
        self.workspace.predicted(&information)
    }
}
