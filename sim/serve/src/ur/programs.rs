//! The interfaces that take programs: primary, secondary and real-time. The first two send the robot's state ten times a second.

use std::io;
use std::rc::Rc;
use std::time::Duration;

use calibench::cell::ur::numbers_of;
use calibench_wire::ur::CartesianInfo;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::spawn_local;
use tokio::time::{MissedTickBehavior, interval};

use super::Controller;
use super::functions::Functions;
use crate::script::{MAX_TEXT, parse, run};

/// Time between two messages with the robot's state.
const STATE_EVERY: Duration = Duration::from_millis(100);

/// Words that open a block of a program.
const OPENING: [&str; 6] = ["def", "sec", "thread", "if", "while", "for"];

/// Accepts clients until the socket is closed.
///
/// # Errors
/// When the socket fails.
pub async fn listen(listener: TcpListener, controller: Rc<Controller>, sends_state: bool) -> io::Result<()> {
    loop {
        let (stream, _) = listener.accept().await?;
        let controller = Rc::clone(&controller);
        spawn_local(async move {
            // An error ends this connection only.
            drop(serve(stream, &controller, sends_state).await);
        });
    }
}

async fn serve(mut stream: TcpStream, controller: &Rc<Controller>, sends_state: bool) -> io::Result<()> {
    let mut text = Vec::new();
    let mut buffer = [0; 16_384];
    let mut clock = interval(STATE_EVERY);
    clock.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        let length = tokio::select! {
            read = stream.read(&mut buffer) => read?,
            _ = clock.tick(), if sends_state => {
                let state = CartesianInfo {
                    base_from_tool: numbers_of(&controller.tool_at(&controller.arm.measured())),
                    flange_from_tool: controller.tool(),
                };
                stream.write_all(&state.encode()).await?;
                continue;
            }
        };
        if length == 0 {
            return Ok(());
        }
        text.extend_from_slice(&buffer[..length]);
        if let Some(end) = end_of_program(&text) {
            let program: Vec<u8> = text.drain(..end).collect();
            start(controller, &String::from_utf8_lossy(&program));
        }
        if text.len() > MAX_TEXT {
            return Ok(());
        }
    }
}

/// Starts a program in place of the one that runs; a secondary one beside it. A controller that takes no programs drops it.
fn start(controller: &Rc<Controller>, text: &str) {
    if !controller.takes_programs() {
        return;
    }
    let program = match parse(text) {
        Ok(program) => Rc::new(program),
        Err(error) => return controller.say(format!("syntax error: {error}")),
    };
    let is_secondary = program.is_secondary();
    let functions = Rc::new(Functions { controller: Rc::clone(controller), moves: !is_secondary });
    let (theirs, name) = (Rc::clone(controller), program.name().to_owned());
    let task = spawn_local(async move {
        if let Err(trouble) = run(program, functions).await {
            theirs.say(trouble.to_string());
        }
        if !is_secondary {
            theirs.note_end();
        }
    });
    if !is_secondary {
        controller.play(&name, task);
    }
}

/// Number of bytes of the program at the front of `text`, if it is complete: a line outside of any block, or a block to its
/// `end`.
fn end_of_program(text: &[u8]) -> Option<usize> {
    let (mut depth, mut at) = (0_usize, 0);
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        at += line.len();
        let code = String::from_utf8_lossy(line);
        let code = code.split('#').next().unwrap_or_default().trim();
        let word = code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().unwrap_or_default();
        if OPENING.contains(&word) {
            depth += 1;
        } else if word == "end" {
            depth = depth.saturating_sub(1);
        }
        if depth == 0 && !code.is_empty() && line.ends_with(b"\n") {
            return Some(at);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_ends_with_the_end_of_its_first_block() {
        let program = "# a comment\ndef a():\n  if True: # if\n    end_it = 1\n  end\n  while (x):\n  end\nend\n";
        assert_eq!(end_of_program(program.as_bytes()), Some(program.len()));
        assert_eq!(end_of_program(&program.as_bytes()[..program.len() - 1]), None);
        assert_eq!(end_of_program(format!("{program}def b():\n").as_bytes()), Some(program.len()));
        assert_eq!(end_of_program(b"set_digital_out(1, True)\n"), Some(25));
        assert_eq!(end_of_program(b"\n\n"), None);
    }
}
