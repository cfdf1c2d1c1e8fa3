//! The choice of the picture: the view in which the curve of an effect shows most of it.

use calibench::effects::EffectId;
use calibench::effects::catalogue::set_aside_by;
use calibench::effects::facts::{Follows, Offered, Period};
use calibench::effects::family::{Family, Scan};
use calibench::effects::registry::family;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::math::rms;
use calibench::measure::dataset::Dataset;
use calibench::units::{UM, URAD};
use nalgebra::Vector3;

use super::plot::Plot;
use super::scene::Scene;
use super::variable::{Abscissa, Ordinate, millimetres};

/// Number of points drawn.
const MOST_POINTS: usize = 300;

/// Share of the squares of a view that the curve must take to be drawn in it.
const WORTH_A_CURVE: f64 = 0.5;

/// Share of the whole effect that a view must show.
const WORTH_A_VIEW: f64 = 0.1;

/// Largest number of bins of a curve.
const MOST_BINS: usize = 24;
/// Fewest samples in a bin.
const LEAST_IN_BIN: usize = 5;

/// Share of an effect in a view from which its means make a curve; below, every sample is drawn.
const A_FUNCTION: f64 = 0.8;

/// Share from which the samples show the tendency; below, the view is not worth drawing.
const A_TENDENCY: f64 = 0.3;

/// An effect as it is seen in data.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The picture.
    pub plot: Plot,
    /// False if no view shows the effect, and the residual is drawn against the effect itself.
    pub in_a_view: bool,
    /// Residual of the fit without and with the effect, rms, in words with its unit.
    pub rms: [String; 2],
}

/// Draws an effect of at most `times` its plausible size, which `model` lacks, in the residuals of set `fit`.
///
/// # Errors
/// If the data do not determine the model, without or with the effect.
pub fn see(datasets: &[(&str, &Dataset)], model: &Model, effect: &str, times: f64) -> Result<Seen, IdentifyError> {
    let scene = Scene::new(datasets, model, effect, times)?;
    let turned = family(effect).is_some_and(|f| f.offered == Offered::ToOrientations);
    let both: [Vec<Vector3<f64>>; 2] = if turned {
        [0, 1].map(|k| scene.rows.iter().filter_map(|r| r.turn.map(|t| t[0] - t[1] * k as f64)).collect())
    } else {
        [0.0, 1.0].map(|k| scene.rows.iter().map(|r| r.residual - r.taken * k).collect())
    };
    let words = |size: f64| if turned { format!("{:.0} µrad", size / URAD) } else { millimetres(size) };
    let plot = match set_aside_by(effect) {
        Some(sample) => Some(lengths(&scene, sample)),
        None => best(&scene, effect),
    };
    Ok(Seen {
        in_a_view: plot.is_some(),
        plot: plot.unwrap_or_else(|| agreement(&scene, turned)),
        rms: both.map(|r| words(rms(&r))),
    })
}

/// The best view: of those that the effect's family names, or else of all; `None` if no view shows it.
fn best(scene: &Scene<'_>, effect: &str) -> Option<Plot> {
    let id = EffectId::new(effect);
    let family = family(effect);
    let event = family.filter(|f| f.scan == Scan::Time).and_then(|_| id.last_argument()?.parse().ok()).map(|s: f64| s / 60.0);
    if let Some((joint, order)) = family.and_then(|f| Some((f.joint(&id)?.checked_sub(1)?, f.period.per_turn(&id)?))) {
        return view(scene, Ordinate::Joint(joint), Abscissa::Phase(joint, order), None).map(|seen| seen.plot);
    }
    let among = |views: Vec<(Ordinate, Abscissa)>, curve: bool| {
        let seen = views.into_iter().filter_map(|(y, x)| view(scene, y, x, event));
        let worth = seen.filter(|s| {
            s.plot.explained > WORTH_A_CURVE
                && s.shown > WORTH_A_VIEW
                && (s.plot.taken.is_empty() || (!curve && s.means > A_TENDENCY))
        });
        worth.max_by(|a, b| (a.shown * a.plot.explained).total_cmp(&(b.shown * b.plot.explained))).map(|s| s.plot)
    };
    let named = family.map_or_else(Vec::new, |f| natural(f, &id, scene.joints));
    among(named.clone(), true).or_else(|| among(named, false)).or_else(|| among(all(scene.joints), true))
}

/// The views that a family's facts name.
fn natural(family: &Family, id: &EffectId<'_>, joints: usize) -> Vec<(Ordinate, Abscissa)> {
    let own: Vec<usize> = family.joint(id).and_then(|j| j.checked_sub(1)).map_or_else(|| (0..joints).collect(), |j| vec![j]);
    let any: Vec<usize> = (0..joints).collect();
    let second: Vec<usize> = id.number(1).and_then(|j| j.checked_sub(1)).map_or_else(|| any.clone(), |j| vec![j]);
    let follows = |f: Follows| family.follows.contains(&f);
    let in_time = [Abscissa::Time];
    let mut views: Vec<(Ordinate, Abscissa)> = Vec::new();
    let room = |x: Abscissa| (0..3).map(move |a| (Ordinate::Room(a), x));
    let tool = |x: Abscissa| (0..3).map(move |a| (Ordinate::Tool(a), x));
    let of_joints = |x: &dyn Fn(usize) -> Abscissa| own.iter().map(|&j| (Ordinate::Joint(j), x(j))).collect::<Vec<_>>();
    if follows(Follows::Time) {
        let (of_room, of_tool) = (follows(Follows::World) || follows(Follows::Ball), follows(Follows::Tool));
        views.extend(in_time.iter().flat_map(|x| room(*x).filter(|_| of_room).chain(tool(*x).filter(|_| of_tool))));
        if !of_room && !of_tool {
            views.extend(of_joints(&|_| Abscissa::Time));
            views.extend(in_time.iter().flat_map(|x| tool(*x).chain(room(*x))));
        }
        return views;
    }
    let follows_first = |f: &Follows| family.follows.first() == Some(f);
    for follows in family.follows {
        match follows {
            Follows::JointAngle | Follows::JointAngleInProportion => views.extend(of_joints(&Abscissa::Angle)),
            Follows::OtherAngles => {
                views.extend(any.iter().flat_map(|&j| any.iter().map(move |&k| (Ordinate::Joint(j), Abscissa::Angle(k)))))
            }
            Follows::JointTorque => views.extend(of_joints(&Abscissa::Torque)),
            Follows::OtherTorque => {
                views.extend(own.iter().flat_map(|&j| second.iter().map(move |&k| (Ordinate::Joint(j), Abscissa::Torque(k)))))
            }
            Follows::Load => views.extend(any.iter().map(|&j| (Ordinate::Joint(j), Abscissa::Torque(j)))),
            Follows::Payload => views.extend(room(Abscissa::Payload)),
            Follows::Approach => views.extend(of_joints(&Abscissa::Approach)),
            Follows::Commanded => views.extend(of_joints(&Abscissa::Lag)),
            Follows::LastMove => views.extend(of_joints(&Abscissa::Move)),
            Follows::Temperature => views.extend(any.iter().map(|&j| (Ordinate::Joint(j), Abscissa::Temperature))),
            Follows::World | Follows::Point if follows_first(follows) => views.extend(room(Abscissa::Order)),
            Follows::Tool => views.extend(tool(Abscissa::Order).chain((0..3).map(|a| (Ordinate::Turn(a), Abscissa::Order)))),
            Follows::Reading => views
                .extend((0..3).flat_map(|i| {
                    [(Ordinate::Tool(i), Abscissa::Reading(i)), (Ordinate::Tool(i), Abscissa::OtherReadings(i))]
                })),
            Follows::Plunger => views.extend((0..3).map(|i| (Ordinate::Tool(i), Abscissa::Plunger(i)))),
            Follows::Ball | Follows::PlaceInArtifact => views.extend(room(Abscissa::Ball)),
            Follows::World | Follows::Point | Follows::Time | Follows::Sample => {}
        }
    }
    if family.period == Period::None { views } else { Vec::new() }
}

/// All views.
fn all(joints: usize) -> Vec<(Ordinate, Abscissa)> {
    let mut views = Vec::new();
    for j in 0..joints {
        let of_joint = |k: usize| [Abscissa::Angle(k), Abscissa::Torque(k)];
        views.extend((0..joints).flat_map(of_joint).map(|x| (Ordinate::Joint(j), x)));
        views.extend(
            [Abscissa::Approach(j), Abscissa::Lag(j), Abscissa::Move(j), Abscissa::Time].map(|x| (Ordinate::Joint(j), x)),
        );
    }
    for axis in 0..3 {
        for y in [Ordinate::Room(axis), Ordinate::Tool(axis)] {
            views.extend([Abscissa::Time, Abscissa::Ball, Abscissa::Payload].map(|x| (y, x)));
            views.extend((0..joints).map(|j| (y, Abscissa::Angle(j))));
        }
    }
    views
}

/// One view.
struct View {
    plot: Plot,
    /// Share of the effect that its means show, and of the effect in this view.
    shown: f64,
    means: f64,
}

/// One view; an event ends a piece of its curve. `None` if the samples do not hold the variables.
fn view(scene: &Scene<'_>, y: Ordinate, x: Abscissa, event: Option<f64>) -> Option<View> {
    let mut seen: Vec<Drawn> = (0..scene.rows.len())
        .filter_map(|k| {
            let ([left, taken], row) = (y.pair(&scene.rows[k])?, &scene.rows[k]);
            Some(Drawn { x: x.of(scene, k)?, left, taken, weight: y.weight(row) })
        })
        .collect();
    // A joint whose lever is short in most samples, or a column that few of them have, makes no picture.
    if seen.len() < 3 * LEAST_IN_BIN || 2 * seen.len() < scene.rows.len() {
        return None;
    }
    seen.sort_by(|a, b| a.x.total_cmp(&b.x));
    let names = x.names(scene);
    let event = event.filter(|_| x == Abscissa::Time);
    let bins = binned(&seen, names.is_some(), event);
    let curve_at = |k: usize| bins.iter().find(|b| b.range.contains(&k)).map_or(0.0, |b| b.mean);
    let whole: f64 = match y {
        Ordinate::Turn(_) => scene.rows.iter().filter_map(|r| r.turn).map(|t| (t[1] / URAD).norm_squared()).sum(),
        _ => scene.rows.iter().map(|r| (r.taken / UM).norm_squared()).sum(),
    };
    let shown: f64 = seen.iter().enumerate().map(|(k, s)| s.weight * curve_at(k) * curve_at(k)).sum();
    let here: f64 = seen.iter().map(|s| s.taken * s.taken).sum();
    let by_curve: f64 = (0..seen.len()).map(|k| curve_at(k) * curve_at(k)).sum();
    let means = if here > 0.0 { by_curve / here } else { 0.0 };
    let is_function = means >= A_FUNCTION;
    let points: Vec<[f64; 2]> = seen.iter().map(|s| [s.x, s.left]).collect();
    let explained = Plot::share(&points, seen.iter().enumerate().map(|(k, s)| if is_function { curve_at(k) } else { s.taken }));
    let first = names.as_ref().map_or(0.0, |(first, _)| *first);
    // Samples of one name stand beside each other, not on top of each other.
    let beside = |k: usize| if names.is_some() { ((k as f64 * 0.618).fract() - 0.5) * 0.5 } else { 0.0 };
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    let drawn = points.iter().enumerate().step_by(stride).map(|(k, p)| [p[0] - first + beside(k), p[1]]).collect();
    let curve = match (is_function, names.is_some()) {
        (false, _) => Vec::new(),
        (true, true) => bins.iter().map(|b| vec![[b.x - first - 0.35, b.mean], [b.x - first + 0.35, b.mean]]).collect(),
        (true, false) => {
            let split = bins.partition_point(|b| event.is_none_or(|event| b.x <= event));
            let piece = |bins: &[Bin]| bins.iter().map(|b| [b.x, b.mean]).collect::<Vec<_>>();
            [piece(&bins[..split]), piece(&bins[split..])].into_iter().filter(|piece| !piece.is_empty()).collect()
        }
    };
    let plot = Plot {
        title: format!("{} against {}", y.name(), x.against()),
        x: x.label(),
        degrees: x.is_angle(),
        y: y.label(),
        points: drawn,
        marked: Vec::new(),
        curve,
        taken: if is_function { Vec::new() } else { seen.iter().step_by(stride).map(|s| s.taken).collect() },
        names: names.map_or_else(Vec::new, |(_, names)| names),
        explained,
    };
    Some(View { plot, means, shown: if whole > 0.0 { shown / whole } else { 0.0 } })
}

/// A sample in a view.
struct Drawn {
    x: f64,
    /// Residual of the fit, and the part of it that the effect explains.
    left: f64,
    taken: f64,
    /// Square of the length in space of one unit of the ordinate.
    weight: f64,
}

/// A part of the samples, in the order of the abscissa.
struct Bin {
    range: std::ops::Range<usize>,
    /// Means of the abscissa and of what the effect takes.
    x: f64,
    mean: f64,
}

fn binned(seen: &[Drawn], by_value: bool, event: Option<f64>) -> Vec<Bin> {
    let count = (seen.len() / LEAST_IN_BIN).clamp(1, MOST_BINS);
    let mut ends: Vec<usize> = if by_value {
        (1..seen.len()).filter(|&k| seen[k].x > seen[k - 1].x).collect()
    } else {
        (1..count).map(|b| b * seen.len() / count).collect()
    };
    ends.extend(event.map(|event| seen.partition_point(|s| s.x <= event)));
    ends.push(seen.len());
    ends.sort_unstable();
    ends.dedup();
    let mut start = 0;
    let mut bins = Vec::with_capacity(ends.len());
    for end in ends.into_iter().filter(|end| *end > 0) {
        let part = &seen[start..end];
        let mean = |of: &dyn Fn(&Drawn) -> f64| part.iter().map(of).sum::<f64>() / part.len() as f64;
        bins.push(Bin { range: start..end, x: mean(&|s| s.x), mean: mean(&|s| s.taken) });
        start = end;
    }
    bins
}

/// The residual of every sample, thrice, against the part of it that the effect explains.
fn agreement(scene: &Scene<'_>, turned: bool) -> Plot {
    let (axes, unit) = if turned { ("the tool", "µrad") } else { ("the room", "µm") };
    let pair = |k: usize, a: usize| match &scene.rows[k].turn {
        Some(turn) if turned => [turn[1][a] / URAD, turn[0][a] / URAD],
        _ => [scene.rows[k].taken[a] / UM, scene.rows[k].residual[a] / UM],
    };
    let points: Vec<[f64; 2]> =
        (0..scene.rows.len()).flat_map(|k| (0..3).map(move |a| (k, a))).map(|(k, a)| pair(k, a)).collect();
    let most = points.iter().map(|p| p[0].abs()).fold(0.0, f64::max);
    let explained = Plot::share(&points, points.iter().map(|p| p[0]));
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    Plot {
        title: "Residual against the part that the effect explains".into(),
        x: format!("part explained by the effect (x, y and z of {axes}), {unit}"),
        degrees: false,
        y: format!("residual, {unit}"),
        points: points.into_iter().step_by(stride).collect(),
        marked: Vec::new(),
        curve: vec![vec![[-most, -most], [most, most]]],
        taken: Vec::new(),
        names: Vec::new(),
        explained,
    }
}

/// The length of every residual, in order, one sample marked.
fn lengths(scene: &Scene<'_>, sample: &str) -> Plot {
    let mut order: Vec<usize> = (0..scene.rows.len()).collect();
    order.sort_by(|&a, &b| {
        let time = |k: usize| scene.rows[k].sample.time_s.unwrap_or(k as f64);
        time(a).total_cmp(&time(b))
    });
    let length = |k: &usize| scene.rows[*k].residual.norm() / UM;
    let points: Vec<[f64; 2]> = order.iter().enumerate().map(|(n, k)| [n as f64 + 1.0, length(k)]).collect();
    let marked: Vec<usize> = (0..order.len()).filter(|&n| scene.rows[order[n]].sample.id == sample).collect();
    let squares = |k: usize| points[k][1] * points[k][1];
    let explained = marked.iter().map(|&k| squares(k)).sum::<f64>() / (0..points.len()).map(squares).sum::<f64>();
    Plot {
        title: "The length of every residual, in the order of measurement".into(),
        x: Abscissa::Order.label(),
        degrees: false,
        y: "length of the residual, µm".into(),
        points,
        marked,
        curve: Vec::new(),
        taken: Vec::new(),
        names: Vec::new(),
        explained,
    }
}
