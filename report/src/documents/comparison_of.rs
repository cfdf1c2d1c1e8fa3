//! The document of a comparison.

use calibench::prediction::Extrapolation;
use calibench::residuals;
use calibench::residuals::comparison::Subject;
use calibench::residuals::views::{BallView, JointBin, SetupView, ToolView, WorldView};
use calibench::units::{DEG, MM, UM, URAD};
use nalgebra::Vector3;

use super::comparison::{
    BallResiduals, Comparison, ComparisonFormat, CurveBin, JointCurve, JointOffset, Place, SetupResiduals, Standout, ToolShift,
    ViewTest, WorldShift, WorstSample,
};
use super::{OutsideRange, Workspace, finite};
use crate::workspace::Forecast;

fn um(v: &Vector3<f64>) -> [f64; 3] {
    [v.x / UM, v.y / UM, v.z / UM]
}

fn urad(v: &Vector3<f64>) -> [f64; 3] {
    [v.x / URAD, v.y / URAD, v.z / URAD]
}

impl From<&residuals::views::ViewTest> for ViewTest {
    fn from(t: &residuals::views::ViewTest) -> Self {
        ViewTest { chi2: t.chi2, dof: t.dof, p_family: t.p_family, explains: t.explains }
    }
}

impl From<&ToolView> for ToolShift {
    fn from(view: &ToolView) -> Self {
        ToolShift { mean_um: um(&view.mean), sigma_um: um(&view.sigma), test: (&view.test).into() }
    }
}

impl From<&WorldView> for WorldShift {
    fn from(view: &WorldView) -> Self {
        WorldShift {
            mean_um: um(&view.mean),
            sigma_um: um(&view.sigma),
            translation_um: um(&view.translation),
            translation_sigma_um: um(&view.translation_sigma),
            rotation_urad: urad(&view.rotation),
            rotation_sigma_urad: urad(&view.rotation_sigma),
            rms_after_mm: view.rms_after / MM,
            test: (&view.test).into(),
        }
    }
}

impl From<&SetupView> for SetupResiduals {
    fn from(s: &SetupView) -> Self {
        SetupResiduals {
            dataset: s.dataset.clone(),
            session: s.session.clone(),
            samples: s.samples,
            rms_mm: s.rms / MM,
            tool: (&s.tool).into(),
            world: (&s.world).into(),
        }
    }
}

impl From<&BallView> for BallResiduals {
    fn from(b: &BallView) -> Self {
        BallResiduals {
            dataset: b.dataset.clone(),
            ball: b.ball.clone(),
            samples: b.samples,
            rms_um: b.rms / UM,
            mean_um: um(&b.mean),
            sigma_um: um(&b.sigma),
            displacement_um: b.displacement.map(|[d, _]| um(&d)),
            displacement_sigma_um: b.displacement.map(|[_, s]| um(&s)),
            test: (&b.test).into(),
        }
    }
}

impl From<&residuals::views::JointCurve> for JointCurve {
    fn from(j: &residuals::views::JointCurve) -> Self {
        let bin = |b: &JointBin| CurveBin {
            x: b.x,
            from: b.from,
            to: b.to,
            mean_urad: b.mean / URAD,
            sigma_urad: b.sigma / URAD,
            n: b.samples,
        };
        JointCurve {
            joint: j.joint,
            against: j.against.name(),
            unit: j.against.unit().0.into(),
            swing_urad: finite(j.swing() / URAD),
            bins: j.bins.iter().map(bin).collect(),
            test: (&j.test).into(),
        }
    }
}

impl From<&residuals::views::JointOffset> for JointOffset {
    fn from(o: &residuals::views::JointOffset) -> Self {
        JointOffset { joint: o.joint, mean_urad: o.mean / URAD, sigma_urad: o.sigma / URAD, test: (&o.test).into() }
    }
}

impl WorstSample {
    fn of(w: &residuals::views::WorstSample, c: &residuals::comparison::Comparison) -> Self {
        let at = &c.setups[w.setup];
        WorstSample {
            id: w.id.clone(),
            dataset: at.dataset.clone(),
            session: at.session.clone(),
            residual_um: um(&w.residual),
            norm_um: w.residual.norm() / UM,
            normalised: w.normalised,
            p_family: w.test.p_family,
            special: w.remarks.clone(),
        }
    }
}

impl Place {
    fn of(subject: Subject, c: &residuals::comparison::Comparison) -> Self {
        match subject {
            Subject::Ball(k) => Place::Ball { dataset: c.balls[k].dataset.clone(), ball: c.balls[k].ball.clone() },
            Subject::Tool(k) => Place::Tool { dataset: c.setups[k].dataset.clone(), session: c.setups[k].session.clone() },
            Subject::World(k) => Place::World { dataset: c.setups[k].dataset.clone(), session: c.setups[k].session.clone() },
            Subject::Curve(k) => Place::Joint { joint: c.joints[k].joint, against: c.joints[k].against.name() },
            Subject::Offset(k) => Place::Offset { joint: c.offsets[k].joint },
            Subject::Sample(k) => Place::Sample { id: c.worst[k].id.clone() },
        }
    }
}

impl Comparison {
    /// The document of a comparison; `forecast` is the error expected over the workspace.
    #[must_use]
    pub fn of(c: &residuals::comparison::Comparison, forecast: Option<&Forecast>, extrapolation: &Extrapolation) -> Self {
        let level = c.noise.level;
        let mm = |x: Option<f64>| x.map(|x| x / MM);
        let interval = |x: Option<[f64; 2]>| x.map(|x| x.map(|x| x / MM));
        let standout = |f: &residuals::comparison::Standout| Standout {
            place: Place::of(f.subject, c),
            test: (&f.test).into(),
            effects: f.effects.clone(),
        };
        Comparison {
            format: ComparisonFormat::Current,
            robot: c.robot.clone(),
            samples: c.samples,
            fitted: c.fit_relation.fitted,
            refitted: c.fit_relation.refitted.clone(),
            from_fit_rows: c.fit_relation.from_fit_rows.clone(),
            residual_mm: c.rms / MM,
            residual_orientation_deg: c.rms_orientation.map(|r| r / DEG),
            noise_mm: mm(level.map(|l| l.rms)),
            noise_um_per_axis: level.map(|l| l.per_axis / UM),
            noise_interval_mm: interval(level.and_then(|l| l.interval)),
            noise_dof: level.and_then(|l| l.dof),
            noise_source: c.noise.source.name().into(),
            noise_stated_um_per_axis: c.noise.stated_per_axis.map(|x| x / UM),
            noise_agreement_p: c.noise.agreement_p,
            noise_left_mm: mm(c.lack_of_fit.noise_left),
            unexplained_mm: mm(c.lack_of_fit.unexplained),
            unexplained_interval_mm: interval(c.lack_of_fit.interval),
            dof: c.lack_of_fit.dof,
            chi2_per_dof: c.lack_of_fit.chi2_per_dof.and_then(finite),
            lack_of_fit_p: c.lack_of_fit.p.and_then(finite),
            noise_overstated: c.lack_of_fit.noise_overstated,
            balls: c.balls.iter().map(Into::into).collect(),
            tool: (&c.tool).into(),
            world: (&c.world).into(),
            setups: c.setups.iter().map(Into::into).collect(),
            joints: c.joints.iter().map(Into::into).collect(),
            offsets: c.offsets.iter().map(Into::into).collect(),
            worst: c.worst.iter().map(|w| WorstSample::of(w, c)).collect(),
            findings: c.findings.iter().map(standout).collect(),
            workspace: forecast.map(Workspace::of_forecast),
            outside_range: OutsideRange::of(extrapolation),
            sentences: c.sentences(),
        }
    }
}
