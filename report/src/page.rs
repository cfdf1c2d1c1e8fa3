//! The report: one JSON document of everything the library can say about a campaign, and one HTML file that displays it.
//!
//! Every number is computed here, by the library; the page only lays it out, so it can also show a document received over a
//! network.

mod against;
mod campaign;
mod candidate;
mod html;
mod page_model;
mod pictures;
mod residuals;
mod script;
mod space;
mod steps;
mod telling;
mod views;

use serde_json::{Value, json};

use self::against::Rival;
use super::Recommended;
use super::documents::Run;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::measure::dataset::NamedDataset;
use calibench::prediction::worker::Worker;

pub use self::campaign::{CampaignRecord, CentringRecord};
pub use self::html::{LivePage, chart_page_html, page_html, page_script, script_sources};
pub use self::page_model::PageModel;
pub use self::pictures::CellPicture;
pub use self::script::{LinkError, Module, linked, linked_or_told};
pub use self::views::{FittedCandidate, Views};

/// Format tag.
const FORMAT: &str = "calibench-report/2";

/// The subject of a report.
#[derive(Clone)]
pub struct PageSubject<'a> {
    /// Heading: the run or the datasets.
    pub title: String,
    /// The question asked, if any.
    pub question: Option<String>,
    /// Explains why the data do not fit their robot, if they are examined nevertheless.
    pub misfit: Option<String>,
    /// Named datasets of one robot; their rows of set `fit` are examined.
    pub datasets: &'a [NamedDataset<'a>],
    /// Datasets whose rows of set `validation` judge the model: the same, or others of the same set-up.
    pub judged: &'a [NamedDataset<'a>],
    /// The model to examine.
    pub model: &'a Model,
    /// The arguments of the recommended commands.
    pub commands: Recommended,
    /// The directory from which to give them; empty for the one in which the report was requested.
    pub commands_from: String,
    /// Run the whole ladder, which takes seconds, instead of computing the next step only.
    pub whole_ladder: bool,
    /// The campaign as carried out, if known.
    pub campaign: Option<&'a CampaignRecord>,
    /// Pictures of the cell, if drawn.
    pub pictures: &'a [CellPicture],
    /// The run; `None` for measurements alone.
    pub run: Option<&'a Run>,
    /// The judgement of the ladder that recommends the model, if the page is that of a calibration: its errors stand first.
    pub judgement: Option<&'a crate::documents::Judged>,
    /// Computes a part of the judgement where threads cannot be had.
    pub worker: Option<&'static dyn Worker>,
}

/// A report as one document.
pub struct Page {
    /// `calibench-report/2`.
    pub document: Value,
}

impl Page {
    /// Examines the data and writes the document.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns.
    pub fn new(subject: &PageSubject<'_>) -> Result<Self, IdentifyError> {
        Page::examined(subject).map(|(page, ..)| page)
    }

    fn examined(subject: &PageSubject<'_>) -> Result<(Self, PageModel, Views), IdentifyError> {
        let page_model = PageModel::new(subject)?;
        let mut views = Views::new(subject, &page_model)?;
        views.look_at_the_best(subject, &page_model);
        let ladder = steps::ladder(subject, &page_model.ladder_step, page_model.ground())?;
        let page = Page::of(subject, &page_model, ladder, &views)?;
        Ok((page, page_model, views))
    }

    /// The same, with a second model of the same data beside it; `names` are those of the subject's model and of `other`.
    ///
    /// # Errors
    /// Those of [`Page::new`], as [`AgainstError::First`] or, if they are of the second model, [`AgainstError::Second`].
    pub fn against(subject: &PageSubject<'_>, other: &Model, names: [&str; 2]) -> Result<Self, AgainstError> {
        let (mut page, page_model, views) = Page::examined(subject).map_err(AgainstError::First)?;
        let second = PageSubject { model: other, ..subject.clone() };
        let rival = Rival::new(&second, &views).map_err(AgainstError::Second)?;
        page.document["against"] = rival.json(names, subject, &page_model).map_err(AgainstError::Second)?;
        Ok(page)
    }

    /// Writes the document of a completed examination; `ladder` is the ladder as a document.
    ///
    /// # Errors
    /// If the validation rows cannot be predicted.
    pub fn of(subject: &PageSubject<'_>, page_model: &PageModel, ladder: Value, views: &Views) -> Result<Self, IdentifyError> {
        let mut document = page_model.json(subject, ladder)?;
        let seen = views.json(page_model);
        candidate::add_spoken_of(&seen, &page_model.ladder_step.model.registry, &mut document["meanings"]);
        if let (Some(whole), Value::Object(part)) = (document.as_object_mut(), seen) {
            whole.extend(part);
        }
        Ok(Page { document })
    }
}

/// Names which of two models does not fit its data.
#[derive(Debug)]
#[non_exhaustive]
pub enum AgainstError {
    /// The model of the page.
    First(IdentifyError),
    /// The model that it is compared with.
    Second(IdentifyError),
}

/// Rounds a number for drawing: a picture shows no more than six digits.
fn short(x: f64) -> Value {
    format!("{x:.5e}").parse::<f64>().map_or(Value::Null, |x| json!(x))
}

fn shorts(values: impl IntoIterator<Item = f64>) -> Value {
    values.into_iter().map(short).collect()
}
