//! What a page is about: measurements of one robot, and what is known of them.

use calibench::identify::Model;
use calibench::measure::Dataset;
use calibench::report::{CampaignRecord, CellPicture, PageSubject, Recommended};
use serde_json::Value;

/// A run, or datasets, as read from their folders.
pub struct Opened {
    /// Heading.
    pub title: String,
    /// The question asked, where there was one.
    pub question: Option<String>,
    /// Datasets by name, whose rows of set `fit` are examined.
    pub datasets: Vec<(String, Dataset)>,
    /// Datasets that do not fit their robot and are used all the same, by name, and the sentence that every result keeps.
    pub misfits: Vec<(String, String)>,
    /// What is judged on, where it is not the datasets themselves.
    pub judged: Option<(String, Dataset)>,
    /// The model to begin with.
    pub model: Model,
    /// How recommended commands go on.
    pub commands: Recommended,
    /// From where they are to be given.
    pub commands_from: String,
    /// How the campaign went.
    pub campaign: Option<CampaignRecord>,
    /// What the cell looks like.
    pub pictures: Vec<CellPicture>,
    /// `result.json` of a run.
    pub run: Value,
}

impl Opened {
    /// What a page is told of the datasets `chosen`, by place, with `model` and `commands` in place of those to begin with.
    pub fn subject<T>(
        &self,
        chosen: &[usize],
        model: &Model,
        commands: &Recommended,
        tell: impl FnOnce(&PageSubject<'_>) -> T,
    ) -> T {
        let datasets: Vec<(&str, &Dataset)> =
            chosen.iter().filter_map(|&k| self.datasets.get(k)).map(|(name, d)| (name.as_str(), d)).collect();
        let judged: Vec<(&str, &Dataset)> = match &self.judged {
            Some((name, d)) => vec![(name.as_str(), d)],
            None => datasets.clone(),
        };
        let misfit = self.misfits.iter().find(|(name, _)| datasets.iter().any(|(n, _)| n == name));
        tell(&PageSubject {
            title: self.title.clone(),
            question: self.question.clone(),
            misfit: misfit.map(|(_, sentence)| sentence.clone()),
            datasets: &datasets,
            judged: &judged,
            model,
            commands: commands.clone(),
            commands_from: self.commands_from.clone(),
            climb: false,
            campaign: self.campaign.as_ref(),
            pictures: &self.pictures,
            run: &self.run,
        })
    }
}
