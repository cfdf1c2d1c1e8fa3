//! Progress bars on standard error; silent when it is not a terminal.

use calibench::measure::{Iteration, PlannedPose, Probing, Progress, Sample, Witness};
use indicatif::{ProgressBar, ProgressStyle};

/// A bar over the stages of a computation.
pub struct Stages(ProgressBar);

impl Stages {
    /// A bar over that many stages.
    pub fn new(stages: u64) -> Self {
        let bar = ProgressBar::new(stages);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(100));
        Stages(bar)
    }

    /// The next stage begins.
    pub fn begin(&self, stage: &'static str) {
        self.0.set_message(stage);
        self.0.inc(1);
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// A bar for a campaign, with the time that the cell still needs.
pub struct CampaignBar(ProgressBar);

impl CampaignBar {
    /// A bar over that many probings.
    pub fn new(probings: usize) -> Self {
        let bar = ProgressBar::new(probings as u64);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} probings  {msg}") {
            bar.set_style(style);
        }
        CampaignBar(bar)
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

impl Witness for CampaignBar {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        let again = if attempt > 1 { format!(", try {attempt}") } else { String::new() };
        self.0.set_message(format!("{}{again}  {:.0} min of cell time to go", pose.id, progress.remaining_s / 60.0));
    }

    fn iteration(&mut self, _: &PlannedPose, _: &Iteration) {}

    fn probing_finished(&mut self, _: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        if sample.is_some() {
            self.0.inc(1);
        } else if let Err(failure) = &probing.outcome {
            self.0.println(format!("probing failed: {failure}"));
        }
    }
}
