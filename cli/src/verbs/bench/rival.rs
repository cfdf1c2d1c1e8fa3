//! A method that is a command: it gets the folder of a division, and writes `predicted.csv` there.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use calibench::files::disk::full_path;
use calibench_lab::bench::{Fault, PREDICTED, Prediction, read_predicted};

use crate::terminal::failure::Failure;

/// Time between two looks at a running command; small beside the start of an interpreter.
const LOOK: Duration = Duration::from_millis(10);

/// A method from outside.
#[derive(Debug, Clone)]
pub struct Rival {
    /// Its name on the leaderboard.
    pub name: String,
    /// The program and its first arguments.
    words: Vec<String>,
}

/// The attempt of a rival on one division.
pub struct Attempt {
    /// What it predicted for each judged row.
    pub predictions: Result<Vec<Prediction>, Fault>,
    /// Time that it took, s.
    pub seconds: f64,
}

/// Reads `NAME=CMD`, or `CMD`, which is named after its last word that is a path or a program.
pub fn rival(text: &str) -> Result<Rival, String> {
    let is_name = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_');
    let (name, command) = match text.split_once('=') {
        Some((name, command)) if is_name(name) => (Some(name.to_owned()), command),
        _ => (None, text),
    };
    let words: Vec<String> = command.split_whitespace().map(str::to_owned).collect();
    let stem = |word: &String| Path::new(word).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let name = name.or_else(|| words.last().and_then(stem)).filter(|name| is_name(name));
    match (name, words.is_empty()) {
        (_, true) => Err("there is no command; give one as in `python3 bench/mine.py`".into()),
        (None, _) => Err("the last word makes no name of letters, digits, - and _; give one as in `mine=CMD`".into()),
        (Some(name), false) => Ok(Rival { name, words }),
    }
}

impl Rival {
    /// Calls the command with a folder and reads what it predicted for `wanted` rows; kept as `predicted-NAME.csv`, what the
    /// command printed as `NAME.log`.
    ///
    /// # Errors
    /// If the program does not exist, which every other division would repeat; or of the disk.
    pub fn on(&self, folder: &Path, wanted: usize, limit: u64) -> Result<Attempt, Failure> {
        let written = folder.join(PREDICTED);
        let (kept, time) = (self.kept(folder), self.time(folder));
        for stale in [&written, &kept, &time] {
            if stale.exists() {
                fs::remove_file(stale)?;
            }
        }
        let log = folder.join(format!("{}.log", self.name));
        let words = File::create(&log)?;
        let began = Instant::now();
        let mut command = Command::new(&self.words[0]);
        command.args(&self.words[1..]).arg(full_path(folder)).stdin(Stdio::null());
        command.stdout(words.try_clone()?).stderr(words);
        let child = command.spawn().map_err(|e| self.not_started(&e))?;
        let ended = until(child, Duration::from_secs(limit))?;
        let seconds = began.elapsed().as_secs_f64();
        let predictions = match ended {
            None => Err(Fault::TooLong(limit)),
            Some(status) if !status.success() => Err(Fault::Failed(status.to_string(), log)),
            Some(_) => read_predicted(&written, wanted),
        };
        if written.exists() {
            fs::rename(&written, &kept)?;
            fs::write(&time, format!("{seconds:.3}\n"))?;
        }
        Ok(Attempt { predictions, seconds })
    }

    /// What it predicted in an earlier run for the same rows; `None` if there is nothing of it, or nothing that can be used.
    pub fn earlier(&self, folder: &Path, wanted: usize) -> Option<Attempt> {
        let seconds = fs::read_to_string(self.time(folder)).ok()?.trim().parse().ok()?;
        let predictions = read_predicted(&self.kept(folder), wanted).ok()?;
        Some(Attempt { predictions: Ok(predictions), seconds })
    }

    fn kept(&self, folder: &Path) -> PathBuf {
        folder.join(format!("predicted-{}.csv", self.name))
    }

    /// The file with the seconds that it took.
    fn time(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.seconds", self.name))
    }

    fn not_started(&self, error: &std::io::Error) -> Failure {
        let program = &self.words[0];
        let remedy = match error.kind() {
            ErrorKind::NotFound => "give its path, or the interpreter before the script",
            _ => "see whether it can be executed",
        };
        format!("--rival {}: '{program}' cannot be started: {error}; {remedy}", self.name).into()
    }
}

/// Waits for a command; `None` if it was stopped after that time.
fn until(mut child: Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
    let began = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if began.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        sleep(LOOK);
    }
}
