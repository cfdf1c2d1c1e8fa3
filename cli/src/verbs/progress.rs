//! Progress bars on standard error; silent when it is not a terminal.

use calibench::measure::{CampaignObserver, Iteration, PlannedPose, Probing, Progress, Sample};
use indicatif::{ProgressBar, ProgressStyle};

use calibench_lab::design::Watcher;

/// A bar that is cleared when dropped, however the work ends.
struct Bar(ProgressBar);

impl Bar {
    fn new(length: Option<u64>, template: &str) -> Self {
        let bar = length.map_or_else(ProgressBar::new_spinner, ProgressBar::new);
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(100));
        Bar(bar)
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// A spinner for work of unknown duration, with its description.
pub struct Waiting(Bar);

impl Waiting {
    /// A spinner for the described work.
    pub fn new(what: impl Into<String>) -> Self {
        let bar = Bar::new(None, "{spinner} {elapsed} {msg}");
        bar.0.set_message(what.into());
        Waiting(bar)
    }

    /// Changes the description.
    pub fn now(&self, what: impl Into<String>) {
        self.0.0.set_message(what.into());
    }

    /// Prints a permanent line on standard error.
    pub fn say(&self, line: &str) {
        self.0.0.suspend(|| eprintln!("{line}"));
    }
}

/// A bar over the stages of a computation.
pub struct Stages(Bar);

impl Stages {
    /// A bar over that many stages.
    pub fn new(stages: u64) -> Self {
        Stages(Bar::new(Some(stages), "{bar:30} {elapsed} {msg}"))
    }

    /// Begins the next stage.
    pub fn begin(&self, stage: &'static str) {
        self.0.0.set_message(stage);
        self.0.0.inc(1);
    }
}

/// A bar over trials, with the remaining time.
pub struct Trials(Bar);

impl Trials {
    /// A bar over that many trials.
    pub fn new(trials: usize) -> Self {
        Trials(Bar::new(Some(trials as u64), "{bar:30} {pos}/{len} trials  {eta} left"))
    }

    /// Starts at the number of trials already done.
    pub fn begin_at(&self, done: u64) {
        self.0.0.set_position(done);
        self.0.0.reset_eta();
    }

    /// Counts one more trial as done.
    pub fn done(&self) {
        self.0.0.inc(1);
    }
}

/// A bar for a campaign, with the remaining real time and cell time.
pub struct CampaignBar(Bar);

impl CampaignBar {
    /// A bar over that many probings.
    pub fn new(probings: usize) -> Self {
        CampaignBar(Bar::new(Some(probings as u64), "{bar:30} {pos}/{len} probings  {eta} left  {msg}"))
    }
}

impl CampaignObserver for CampaignBar {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        let again = if attempt > 1 { format!(", try {attempt}") } else { String::new() };
        self.0.0.set_message(format!("{}{again}  {:.0} min of cell time to go", pose.id, progress.remaining_s / 60.0));
    }

    fn iteration(&mut self, _: &PlannedPose, _: &Iteration) {}

    fn probing_finished(&mut self, _: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        if sample.is_some() {
            self.0.0.inc(1);
        } else if let Err(failure) = &probing.outcome {
            self.0.0.println(format!("probing failed: {failure}"));
        }
    }

    fn recalled(&mut self, _: &PlannedPose, _: &Probing, sample: Option<&Sample>) {
        self.0.0.inc(u64::from(sample.is_some()));
    }
}

/// A bar over the steps of each stage of a design.
pub struct Steps(Bar);

impl Steps {
    /// A bar before its first stage.
    pub fn new() -> Self {
        Steps(Bar::new(Some(0), "{bar:30} {pos}/{len}  {elapsed} {msg}"))
    }
}

impl Watcher for Steps {
    fn stage(&self, what: &'static str, steps: u64) {
        self.0.0.set_length(steps);
        self.0.0.set_position(0);
        self.0.0.set_message(what);
    }

    fn step(&self) {
        self.0.0.inc(1);
    }
}
