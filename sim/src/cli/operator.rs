//! The person at a real cell: asked before anything moves, handed the master ball, and listened to for a stop.

use std::io::{BufRead, IsTerminal, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use calibench::cell::StopRequest;
use calibench::measure::{Attendant, CalledOff};

use super::Failure;

/// Time to take the master ball away when nobody is asked.
const TAKEN_AWAY: Duration = Duration::from_secs(5);

/// How often a question looks whether a stop was asked for.
const LOOK: Duration = Duration::from_millis(100);

/// Whoever stands at the cell; `q` and Enter, or Ctrl-C, is the stop key from now on.
pub struct Operator {
    lines: Receiver<String>,
    stop: StopRequest,
    is_asked: bool,
}

impl Operator {
    /// Someone at the terminal; with `yes` nobody is asked.
    ///
    /// # Errors
    /// When there is nobody to ask.
    pub fn new(yes: bool) -> Result<Self, Failure> {
        if !yes && !std::io::stdin().is_terminal() {
            return Err("the robot will move, and nobody can be asked here; run it in a terminal, or say --yes".into());
        }
        let stop = StopRequest::default();
        let lines = listen(&stop);
        stop_on_signals(&stop);
        Ok(Operator { lines, stop, is_asked: !yes })
    }

    /// The stop key.
    pub fn stop(&self) -> StopRequest {
        self.stop.clone()
    }

    /// Whether whoever started the program answered all questions beforehand.
    pub fn asks_nobody(&self) -> bool {
        !self.is_asked
    }

    /// Says something and waits for Enter.
    ///
    /// # Errors
    /// When it was called off.
    pub fn ask(&self, question: &str) -> Result<(), CalledOff> {
        if !self.is_asked {
            return if self.stop.is_made() { Err(CalledOff) } else { Ok(()) };
        }
        drop(write!(std::io::stderr(), "{question}\n[Enter to go on, q and Enter to stop] "));
        loop {
            if self.stop.is_made() {
                return Err(CalledOff);
            }
            match self.lines.recv_timeout(LOOK) {
                Ok(_) => return if self.stop.is_made() { Err(CalledOff) } else { Ok(()) },
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
}

/// Lines typed; `q` is a stop whenever it comes.
fn listen(stop: &StopRequest) -> Receiver<String> {
    let (sender, lines) = channel();
    let stop = stop.clone();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if line.trim().eq_ignore_ascii_case("q") {
                stop.make();
            }
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

/// Ctrl-C and the like stop the robot before the program; the second time they end the program.
fn stop_on_signals(stop: &StopRequest) {
    let stop = stop.clone();
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() else { return };
        runtime.block_on(async {
            interrupted().await;
            drop(writeln!(std::io::stderr(), "\nstopping the robot; once more to end the program at once"));
            stop.make();
            interrupted().await;
            // As a shell reports a program that was interrupted.
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
