//! Progress bars on standard error; silent when it is not a terminal.

use std::sync::Mutex;
use std::time::Instant;

use calibench::measure::campaign::{CampaignObserver, Progress};
use calibench::measure::centring::{Iteration, Probing};
use calibench::measure::dataset::Sample;
use calibench::measure::poses::PlannedPose;
use indicatif::{ProgressBar, ProgressStyle};

use super::output::{is_told, note, print_detail, warn};

use calibench_lab::design::Watcher;

/// A bar that is cleared when dropped, however the work ends. With `-v` it says how long each stage took.
struct Bar {
    bar: ProgressBar,
    stage: Mutex<Option<(String, Instant)>>,
}

impl Bar {
    fn new(length: Option<u64>, template: &str) -> Self {
        // With -q nothing moves.
        let bar = match length {
            _ if !is_told() => ProgressBar::hidden(),
            Some(length) => ProgressBar::new(length),
            None => ProgressBar::new_spinner(),
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(100));
        Bar { bar, stage: Mutex::new(None) }
    }

    /// Begins a stage, and ends the one before.
    fn begin(&self, stage: &str) {
        self.bar.set_message(stage.to_owned());
        self.end(Some((stage.to_owned(), Instant::now())));
    }

    /// Ends the present stage, and puts the next in its place.
    fn end(&self, next: Option<(String, Instant)>) {
        let before = self.stage.lock().ok().and_then(|mut stage| std::mem::replace(&mut *stage, next));
        if let Some((stage, begun)) = before {
            self.bar.suspend(|| print_detail(format!("{stage}: {:.2} s", begun.elapsed().as_secs_f64())));
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.end(None);
        self.bar.finish_and_clear();
    }
}

/// A spinner for work of unknown duration, with its description.
pub struct Waiting(Bar);

impl Waiting {
    /// A spinner for the described work.
    pub fn new(what: impl Into<String>) -> Self {
        let bar = Bar::new(None, "{spinner} {elapsed} {msg}");
        bar.begin(&what.into());
        Waiting(bar)
    }

    /// Changes the description.
    pub fn now(&self, what: impl Into<String>) {
        self.0.bar.set_message(what.into());
    }

    /// Begins the next stage of the work.
    pub fn begin(&self, what: &str) {
        self.0.begin(what);
    }

    /// Prints a warning on standard error; not with `-qq`.
    pub fn warn(&self, warning: &str) {
        self.0.bar.suspend(|| warn(warning));
    }

    /// Prints a permanent line on standard error; not with `-q`.
    pub fn say(&self, line: &str) {
        self.0.bar.suspend(|| note(line));
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
        self.0.begin(stage);
        self.0.bar.inc(1);
    }
}

/// A bar over trials, with the remaining time.
pub struct Trials(Bar);

impl Trials {
    /// A bar over that many trials.
    pub fn new(trials: usize) -> Self {
        let bar = Bar::new(Some(trials as u64), "{bar:30} {pos}/{len} trials  {eta} left");
        bar.begin("trials");
        Trials(bar)
    }

    /// Starts at the number of trials already done.
    pub fn begin_at(&self, done: u64) {
        self.0.bar.set_position(done);
        self.0.bar.reset_eta();
    }

    /// Counts one more trial as done.
    pub fn done(&self) {
        self.0.bar.inc(1);
    }
}

/// A bar for a campaign, with the remaining real time and cell time.
pub struct CampaignBar(Bar);

impl CampaignBar {
    /// A bar over that many probings.
    pub fn new(probings: usize) -> Self {
        let bar = Bar::new(Some(probings as u64), "{bar:30} {pos}/{len} probings  {eta} left  {msg}");
        bar.begin("campaign");
        CampaignBar(bar)
    }
}

impl CampaignObserver for CampaignBar {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        let again = if attempt > 1 { format!(", try {attempt}") } else { String::new() };
        self.0.bar.set_message(format!("{}{again}  {:.0} min of cell time to go", pose.id, progress.remaining_s / 60.0));
    }

    fn iteration(&mut self, _: &PlannedPose, _: &Iteration) {}

    fn probing_finished(&mut self, _: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        if sample.is_some() {
            self.0.bar.inc(1);
        } else if let Err(failure) = &probing.outcome {
            self.0.bar.println(format!("probing failed: {failure}"));
        }
    }

    fn recalled(&mut self, _: &PlannedPose, _: &Probing, sample: Option<&Sample>) {
        self.0.bar.inc(u64::from(sample.is_some()));
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
        self.0.bar.set_length(steps);
        self.0.bar.set_position(0);
        self.0.begin(what);
    }

    fn step(&self) {
        self.0.bar.inc(1);
    }
}
