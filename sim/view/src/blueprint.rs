//! Initial layout of the viewer: the story on one screen.
//!
//! Written with the archetypes of the blueprint itself: the builder of the SDK cannot set a camera or the range of an axis,
//! and gives its views random names.

use nalgebra::Vector3;
use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis, TimePanelBlueprint,
    ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
use rerun::external::re_sdk_types::blueprint::components::{
    self as words, BackgroundKind, ContainerKind, IncludedContent, PanelState, PlayState, QueryExpression, RootContainer,
};
use rerun::external::re_sdk_types::components::Range1D;
use rerun::external::re_sdk_types::datatypes::{Range2D, Uuid};
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder};

use crate::ViewError;
use crate::arm::Arms;
use crate::centring;
use crate::gauge::NUMBERS;
use crate::paint::{self, solid};
use crate::residuals::Shown;
use crate::scene::single;
use crate::subject::Subject;

/// A part of the screen.
enum Part {
    /// Parts beside or above each other, with their shares.
    Container(ContainerKind, Vec<(Part, f32)>),
    /// A view.
    View(View),
}

/// One view.
struct View {
    class: &'static str,
    title: String,
    origin: String,
    contents: Vec<String>,
    /// Properties by their names in the blueprint.
    properties: Vec<(&'static str, Box<dyn AsComponents>)>,
}

/// Layout of the screen.
pub struct Layout(Part);

impl Layout {
    /// The layout for a subject with these arms and residuals.
    pub fn of(subject: &Subject, arms: &Arms, residuals: &[Shown]) -> Self {
        let cell = Part::View(cell(subject, arms));
        let words = Part::View(View::new("TextDocument", "The story", "/story"));
        let steps = arrows(subject, residuals);
        if !subject.is_campaign {
            let side = column([(words, 0.4), (steps, 0.6)]);
            return Layout(row([(cell, 0.55), (side, 0.45)]));
        }
        let left = column([(cell, 0.62), (row([(words, 0.62), (over_the_session(subject), 0.38)]), 0.38)]);
        let [gauge, falling, path, balls] = [
            View::new("3D", "The gauge on the ball", "/world/tool")
                .with_contents(["/world/tool/**", "/world/balls/**"])
                .with("EyeControls3D", eye(&Vector3::new(0.045, -0.095, 0.05), &Vector3::new(0.012, 0.008, 0.012)))
                .with("Background", ground())
                .with("LineGrid3D", no_grid()),
            chart("Indicator readings (log scale, one decade a line)", "/centring/readings", centring::READINGS),
            chart("Path in the gauge", "/centring/path", centring::PATH),
            chart(
                "Every ball: the largest reading of each try, and the band of 3 µm",
                "/centring/balls",
                centring::balls(subject.dataset.balls.len()),
            ),
        ]
        .map(Part::View);
        let right = column([(row([(gauge, 0.3), (falling, 0.4), (path, 0.3)]), 0.36), (balls, 0.24), (steps, 0.4)]);
        Layout(row([(left, 0.46), (right, 0.54)]))
    }
}

impl View {
    fn new(class: &'static str, title: &str, origin: &str) -> Self {
        let contents = vec!["$origin/**".into()];
        View { class, title: title.into(), origin: origin.into(), contents, properties: Vec::new() }
    }

    fn with_contents(self, contents: impl IntoIterator<Item = impl Into<String>>) -> Self {
        View { contents: contents.into_iter().map(Into::into).collect(), ..self }
    }

    fn with(mut self, name: &'static str, property: impl AsComponents + 'static) -> Self {
        self.properties.push((name, Box::new(property)));
        self
    }
}

fn row(parts: impl IntoIterator<Item = (Part, f32)>) -> Part {
    Part::Container(ContainerKind::Horizontal, parts.into_iter().collect())
}

fn column(parts: impl IntoIterator<Item = (Part, f32)>) -> Part {
    Part::Container(ContainerKind::Vertical, parts.into_iter().collect())
}

fn ground() -> Background {
    Background::new(BackgroundKind::SolidColor).with_color(solid(paint::GROUND))
}

fn no_grid() -> LineGrid3D {
    LineGrid3D::new().with_visible(false)
}

fn eye(position: &Vector3<f64>, target: &Vector3<f64>) -> EyeControls3D {
    EyeControls3D::new().with_position(single(position)).with_look_target(single(target)).with_eye_up([0.0, 0.0, 1.0])
}

/// A viewpoint.
struct Forecast {
    /// Centre of the objects viewed, and their extent from there, m.
    middle: Vector3<f64>,
    extent: f64,
    /// Horizontal direction from the robot to the measured targets, and the direction to the right of it.
    out: Vector3<f64>,
    side: Vector3<f64>,
}

impl Forecast {
    /// The viewpoint for these points (m) of the cell.
    fn on(points: &[Vector3<f64>], subject: &Subject) -> Self {
        let (base, targets) = (Vector3::from(subject.dataset.base.xyz), subject.targets());
        let out = targets.iter().map(|target| target - base).sum::<Vector3<f64>>();
        let out = Vector3::new(out.x, out.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let corner = |pick: fn(f64, f64) -> f64| points.iter().copied().reduce(|a, b| a.zip_map(&b, pick)).unwrap_or(base);
        let middle = (corner(f64::min) + corner(f64::max)) / 2.0;
        let extent = points.iter().map(|point| (point - middle).norm()).fold(0.15, f64::max);
        Forecast { middle, extent, side: out.cross(&Vector3::z()), out }
    }
}

/// Extent of bodies beyond the frames that carry them, m.
const BODIES: f64 = 0.15;

/// The cell, seen from beyond the balls and from their right, with the arm behind them.
fn cell(subject: &Subject, arms: &Arms) -> View {
    let opening = subject.journal.settled(0).and_then(|k| arms.stands.get(k));
    let arm = opening.iter().flat_map(|stand| &stand.best().frames).map(|frame| frame.translation.vector);
    let points: Vec<Vector3<f64>> = arm.chain(subject.targets()).collect();
    let Forecast { middle, extent, out, side } = Forecast::on(&points, subject);
    let position = middle + (out * 0.56 + side * 0.64 + Vector3::z() * 0.52) * (2.0 * (extent + BODIES));
    View::new("3D", "The cell", "/world")
        .with_contents(["/world/**".into(), "- /world/residuals/**".into(), format!("- /{NUMBERS}")])
        .with("EyeControls3D", eye(&position, &middle))
        .with("Background", ground())
        .with("LineGrid3D", no_grid())
}

/// The arrows of every step; if there are more than two, the first beside tabs with the others.
fn arrows(subject: &Subject, steps: &[Shown]) -> Part {
    let Forecast { middle, extent, out, side } = Forecast::on(&subject.targets(), subject);
    let position = middle + (out - side * 0.2 + Vector3::z() * 0.4) * (1.6 * extent);
    let view = |step: &Shown| {
        let contents = [format!("{}/**", step.path), "/world/residuals/targets".into(), "/world/residuals/names".into()];
        let view = View::new("3D", &step.title, "/world").with_contents(contents).with("Background", ground());
        Part::View(view.with("LineGrid3D", no_grid()).with("EyeControls3D", eye(&position, &middle)))
    };
    match steps {
        [first, others @ ..] if !others.is_empty() => {
            let tabs = others.iter().map(|step| (view(step), 1.0)).collect();
            row([(view(first), 0.5), (Part::Container(ContainerKind::Tabs, tabs), 0.5)])
        }
        [only] => view(only),
        _ => Part::View(View::new("3D", "Residuals", "/world").with_contents(["/world/residuals/**"])),
    }
}

/// Quantities over the session: the readings, and the clearance of the paths if it is known.
fn over_the_session(subject: &Subject) -> Part {
    let readings = Part::View(readings());
    if subject.journal.tries.iter().all(|t| t.clearance_mm.is_none()) {
        return readings;
    }
    let clearance = View::new("TimeSeries", "Least clearance of every way, mm", "/clearance");
    let clearance = Part::View(clearance.with("PlotLegend", PlotLegend::new().with_visible(false)));
    Part::Container(ContainerKind::Tabs, vec![(readings, 1.0), (clearance, 1.0)])
}

/// The readings over the whole campaign, in the range about zero.
fn readings() -> View {
    View::new("TimeSeries", "Readings over the session, µm", "/readings")
        .with("ScalarAxis", ScalarAxis::new().with_range(Range1D::from([-12.0, 12.0])))
        .with("PlotLegend", PlotLegend::new().with_visible(false))
}

fn chart(title: &str, origin: &str, [x, y]: [[f64; 2]; 2]) -> View {
    let bounds = Range2D { x_range: x.into(), y_range: y.into() };
    View::new("2D", title, origin).with("VisualBounds2D", VisualBounds2D::new(bounds)).with("Background", ground())
}

/// Sends the layout as the blueprint that the recording opens with: paused on the first probing, the ball centred.
pub fn send(rec: &RecordingStream, layout: &Layout) -> Result<(), ViewError> {
    let (blueprint, storage) =
        RecordingStreamBuilder::new("calibench").recording_id("calibench-story").enabled(true).blueprint().memory()?;
    blueprint.set_log_time_enabled(false);
    blueprint.set_log_tick_enabled(false);
    blueprint.set_time_sequence("blueprint", 0);
    let mut counted = 0;
    let root = place(&blueprint, &layout.0, &mut counted)?;
    let viewport = ViewportBlueprint::new().with_auto_layout(false).with_auto_views(false);
    blueprint.log("viewport", &viewport.with_root_container(RootContainer(id(root))))?;
    for panel in ["blueprint_panel", "selection_panel"] {
        blueprint.log(panel, &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    }
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline("probing")
        .with_fps(2.0)
        .with_play_state(PlayState::Paused);
    blueprint.log("time_panel", &time)?;
    let messages: Vec<LogMsg> = storage.take();
    if let Some(LogMsg::SetStoreInfo(info)) = messages.first() {
        let blueprint_id = info.info.store_id.clone();
        let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        rec.send_blueprint(messages, activation);
    }
    Ok(())
}

fn id(count: u128) -> Uuid {
    Uuid::from(rerun::external::uuid::Uuid::from_u128(count))
}

/// Writes a part and its contents; returns its number.
fn place(rec: &RecordingStream, part: &Part, counted: &mut u128) -> Result<u128, ViewError> {
    *counted += 1;
    let mine = *counted;
    match part {
        Part::Container(kind, parts) => {
            let mut inside = Vec::with_capacity(parts.len());
            for (child, _) in parts {
                let number = place(rec, child, counted)?;
                inside.push(IncludedContent(path(child, number).into()));
            }
            let shares = || parts.iter().map(|(_, share)| *share);
            let container = ContainerBlueprint::new(*kind).with_contents(inside);
            let container = match kind {
                ContainerKind::Horizontal => container.with_col_shares(shares()),
                ContainerKind::Vertical => container.with_row_shares(shares()),
                ContainerKind::Grid | ContainerKind::Tabs => container,
            };
            rec.log(path(part, mine), &container)?;
        }
        Part::View(view) => {
            let base = path(part, mine);
            let queries = view.contents.iter().map(|q| QueryExpression(q.as_str().into()));
            rec.log(format!("{base}/ViewContents"), &ViewContents::new(queries))?;
            let blueprint = ViewBlueprint::new(words::ViewClass(view.class.into()));
            let blueprint = blueprint.with_display_name(view.title.as_str()).with_space_origin(view.origin.as_str());
            rec.log(base.clone(), &blueprint)?;
            for (name, property) in &view.properties {
                rec.log(format!("{base}/{name}"), property.as_ref())?;
            }
        }
    }
    Ok(mine)
}

fn path(part: &Part, number: u128) -> String {
    let kind = match part {
        Part::Container(..) => "container",
        Part::View(_) => "view",
    };
    format!("{kind}/{}", rerun::external::uuid::Uuid::from_u128(number))
}
