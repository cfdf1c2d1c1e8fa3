//! The report: one JSON document of all that the library can say of a campaign, and one HTML file that shows it.
//!
//! Every number is computed here, by the library; the page only lays it out. So the same page can show a document that comes over a wire.

mod campaign;
mod candidate;
mod html;
mod pictures;
mod residuals;
mod standing;
mod steps;
mod telling;
mod views;

use serde_json::{Value, json};

use super::Recommended;
use crate::identify::{IdentifyError, Model};
use crate::measure::Dataset;

pub use self::campaign::{CampaignRecord, CentringRecord};
pub use self::html::{LivePage, chart_page_html, page_html};
pub use self::pictures::CellPicture;
pub use self::standing::Standing;
pub use self::views::Views;

/// Format tag.
const FORMAT: &str = "calibench-report/1";

/// What a report is about.
#[derive(Clone)]
pub struct PageSubject<'a> {
    /// Heading: of the run, or of the datasets.
    pub title: String,
    /// The question asked, where there was one.
    pub question: Option<String>,
    /// Why the data do not fit their robot, where they are examined all the same.
    pub misfit: Option<String>,
    /// Named datasets of one robot, whose rows of set `fit` are examined.
    pub datasets: &'a [(&'a str, &'a Dataset)],
    /// Datasets whose rows of set `validation` are judged on: the same, or others of the same set-up.
    pub judged: &'a [(&'a str, &'a Dataset)],
    /// The model to examine.
    pub model: &'a Model,
    /// How the commands that are recommended go on.
    pub commands: Recommended,
    /// From where they are to be given; empty for where the report was asked for.
    pub commands_from: String,
    /// Climb the whole ladder, which takes seconds; else the next step alone.
    pub climb: bool,
    /// The campaign as it was carried out, where it is known.
    pub campaign: Option<&'a CampaignRecord>,
    /// What the cell looks like, where it was drawn.
    pub pictures: &'a [CellPicture],
    /// What else is known of the run, as it stands in `result.json`; null for measurements alone.
    pub run: &'a Value,
}

/// A report as one document.
pub struct Page {
    /// `calibench-report/1`.
    pub document: Value,
}

impl Page {
    /// Examines the data and writes all down.
    ///
    /// # Errors
    /// When data and model do not go together, or do not determine the unknowns.
    pub fn new(subject: &PageSubject<'_>) -> Result<Self, IdentifyError> {
        let standing = Standing::new(subject)?;
        let mut views = Views::new(subject, &standing)?;
        views.look_at_the_best(subject, &standing);
        let ladder = steps::ladder(subject, &standing.rung, standing.ground())?;
        Page::of(subject, &standing, ladder, &views)
    }

    /// Writes down what has been examined: `ladder` is the error falling, as a document.
    ///
    /// # Errors
    /// When the rows to judge on cannot be predicted.
    pub fn of(subject: &PageSubject<'_>, standing: &Standing, ladder: Value, views: &Views) -> Result<Self, IdentifyError> {
        let mut document = standing.json(subject, ladder)?;
        if let (Some(whole), Value::Object(part)) = (document.as_object_mut(), views.json(standing)) {
            whole.extend(part);
        }
        Ok(Page { document })
    }
}

/// A number for drawing: six digits say more than a picture can show.
fn short(x: f64) -> Value {
    format!("{x:.5e}").parse::<f64>().map_or(Value::Null, |x| json!(x))
}

fn shorts(values: impl IntoIterator<Item = f64>) -> Value {
    values.into_iter().map(short).collect()
}
