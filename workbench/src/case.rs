//! The input of a page: measurements of one robot, and the data that accompany them.

use calibench::identify::Model;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::worker::Worker;

use calibench_report::documents::Run;
use calibench_report::{CampaignRecord, CellPicture, PageSubject, Recommended};

/// A run, or datasets, as read from their folders.
pub struct Case {
    /// Heading.
    pub title: String,
    /// The question asked, if any.
    pub question: Option<String>,
    /// Datasets by name; their rows of set `fit` are examined.
    pub datasets: Vec<(String, Dataset)>,
    /// Datasets that do not fit their robot but are used nevertheless: name, and the sentence repeated in every result.
    pub misfits: Vec<(String, String)>,
    /// The dataset that judges the model, if other than the datasets themselves.
    pub judged: Option<(String, Dataset)>,
    /// The initial model.
    pub model: Model,
    /// The arguments of recommended commands.
    pub commands: Recommended,
    /// The directory from which to give them.
    pub commands_from: String,
    /// The campaign as carried out.
    pub campaign: Option<CampaignRecord>,
    /// Pictures of the cell.
    pub pictures: Vec<CellPicture>,
    /// The run, if it is one.
    pub run: Option<Run>,
    /// Computes a part of judgements where threads cannot be had.
    pub worker: Option<&'static dyn Worker>,
}

impl Case {
    /// Calls `tell` with the subject of a page on the datasets `chosen`, by index, with `model` and `commands` replacing the
    /// initial ones.
    pub fn subject<T>(
        &self,
        chosen: &[usize],
        model: &Model,
        commands: &Recommended,
        tell: impl FnOnce(&PageSubject<'_>) -> T,
    ) -> T {
        let datasets: Vec<NamedDataset<'_>> =
            chosen.iter().filter_map(|&k| self.datasets.get(k)).map(|(name, d)| NamedDataset::new(name.as_str(), d)).collect();
        let judged: Vec<NamedDataset<'_>> = match &self.judged {
            Some((name, d)) => vec![NamedDataset::new(name.as_str(), d)],
            None => datasets.clone(),
        };
        let misfit = self.misfits.iter().find(|(name, _)| datasets.iter().any(|d| d.name == name));
        tell(&PageSubject {
            // What is chosen of several datasets is named.
            title: match datasets.len() == self.datasets.len() {
                true => self.title.clone(),
                false => datasets.iter().map(|d| d.name).collect::<Vec<_>>().join(", "),
            },
            question: self.question.clone(),
            misfit: misfit.map(|(_, sentence)| sentence.clone()),
            datasets: &datasets,
            judged: &judged,
            model,
            commands: commands.clone(),
            commands_from: self.commands_from.clone(),
            whole_ladder: false,
            campaign: self.campaign.as_ref(),
            pictures: &self.pictures,
            run: self.run.as_ref(),
            judgement: None,
            worker: self.worker,
        })
    }
}
