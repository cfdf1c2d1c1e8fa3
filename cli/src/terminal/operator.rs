//! The operator of a real cell: confirms motions, places the master ball, and can request a stop.

use std::io::{BufRead, IsTerminal, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use calibench::cell::StopRequest;
use calibench::measure::campaign::mastering::{Attendant, CalledOff};

use super::failure::Failure;

/// Time allowed for taking the master ball away when no questions are asked.
const TAKEN_AWAY: Duration = Duration::from_secs(5);

/// Interval at which a question checks for a stop request.
const LOOK: Duration = Duration::from_millis(100);

/// Options of every verb that moves a real robot.
#[derive(clap::Args)]
pub struct OperatedArguments {
    /// Do not ask: the robot may move, the master ball lies in the socket, and is taken away within 5 s of being used
    #[arg(long, requires = "cell")]
    pub yes: bool,
    /// Use the gauge's readings as they are: it is mastered, and nothing touches it
    #[arg(long, requires = "cell")]
    pub mastered: bool,
    /// Speed override that replaces the cell's, %
    #[arg(long, requires = "cell", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub speed: Option<u8>,
}

/// The operator of the cell; from its creation on, `q` and Enter, or Ctrl-C, request a stop.
pub struct Operator {
    lines: Receiver<String>,
    stop: StopRequest,
    is_asked: bool,
}

impl Operator {
    /// An operator at the terminal; with `yes`, no questions are asked.
    ///
    /// # Errors
    /// If there is no terminal to ask at.
    pub fn new(yes: bool) -> Result<Self, Failure> {
        if !yes && !std::io::stdin().is_terminal() {
            return Err(
                "the robot will move, and there is no terminal in which to confirm it; run it in a terminal, or give --yes"
                    .into(),
            );
        }
        let stop = StopRequest::default();
        let lines = listen(Some((&stop, !yes)));
        stop_on_signals(&stop, "stopping the robot");
        Ok(Operator { lines, stop, is_asked: !yes })
    }

    /// Somebody who moves the robot, and types what the program is to do; from its creation on, Ctrl-C requests a stop.
    pub fn who_jogs() -> Self {
        let stop = StopRequest::default();
        let lines = listen(None);
        stop_on_signals(&stop, "ending the measurement");
        Operator { lines, stop, is_asked: true }
    }

    /// The next typed line, waited for at most this long.
    ///
    /// # Errors
    /// If none came, or none will come.
    pub fn line(&self, wait: Duration) -> Result<String, RecvTimeoutError> {
        self.lines.recv_timeout(wait)
    }

    /// The stop request.
    pub fn stop(&self) -> StopRequest {
        self.stop.clone()
    }

    /// Shows a question and waits for Enter.
    ///
    /// # Errors
    /// If the operator called it off.
    pub fn ask(&self, question: &str) -> Result<(), CalledOff> {
        if !self.is_asked {
            return if self.stop.is_made() { Err(CalledOff) } else { Ok(()) };
        }
        drop(write!(std::io::stderr(), "{question}\n[Enter to go on, q and Enter to stop] "));
        // Whoever types anything but Enter or a yes has not said that it may go on.
        let is_yes = |line: &str| matches!(line.trim().to_ascii_lowercase().as_str(), "" | "y" | "yes");
        let is_no = |line: &str| matches!(line.trim().to_ascii_lowercase().as_str(), "n" | "no");
        loop {
            if self.stop.is_made() {
                return Err(CalledOff);
            }
            match self.lines.recv_timeout(LOOK) {
                Ok(line) if self.stop.is_made() || is_no(&line) => return Err(CalledOff),
                Ok(line) if is_yes(&line) => return Ok(()),
                Ok(_) => drop(write!(std::io::stderr(), "[Enter to go on, q and Enter to stop] ")),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(CalledOff),
            }
        }
    }
}

impl Attendant for Operator {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        self.ask("Put the master ball into the socket of the gauge, which points upwards, and let go of it.")
    }

    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        if !self.is_asked {
            std::thread::sleep(TAKEN_AWAY);
        }
        self.ask("The indicators are set. Take the master ball away; nothing may touch the plungers.")
    }

    fn asks_nobody(&self) -> bool {
        !self.is_asked
    }
}

/// Receives typed lines; `q` requests the stop, if there is one, at any time, and so does the end of the input of an operator who
/// is asked: no `q` would be read any more.
fn listen(stop: Option<(&StopRequest, bool)>) -> Receiver<String> {
    let (sender, lines) = channel();
    let (stop, is_asked) = stop.map_or((None, false), |(stop, is_asked)| (Some(stop.clone()), is_asked));
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if let Some(stop) = stop.as_ref().filter(|_| line.trim().eq_ignore_ascii_case("q")) {
                stop.make();
            }
            if sender.send(line).is_err() {
                return;
            }
        }
        stop.iter().filter(|_| is_asked).for_each(StopRequest::make);
    });
    lines
}

/// The first Ctrl-C or similar signal requests the stop, in these words; the second one ends the program.
fn stop_on_signals(stop: &StopRequest, doing: &'static str) {
    let stop = stop.clone();
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() else { return };
        runtime.block_on(async {
            interrupted().await;
            drop(writeln!(std::io::stderr(), "\n{doing}; once more to end the program at once"));
            stop.make();
            interrupted().await;
            // The exit code by which a shell reports an interrupted program.
            std::process::exit(130);
        });
    });
}

#[cfg(unix)]
async fn interrupted() {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut terminate) = signal(SignalKind::terminate()) else {
        drop(tokio::signal::ctrl_c().await);
        return;
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        _ = terminate.recv() => {}
    }
}

#[cfg(not(unix))]
async fn interrupted() {
    drop(tokio::signal::ctrl_c().await);
}
