//! The dashboard: commands and answers in lines of text.

use std::io;
use std::rc::Rc;

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::spawn_local;

use super::Controller;

/// Longest line, bytes.
const LONGEST_LINE: usize = 1000;

/// Accepts clients until the socket is closed.
///
/// # Errors
/// When the socket fails.
pub async fn listen(listener: TcpListener, controller: Rc<Controller>) -> io::Result<()> {
    loop {
        let (stream, _) = listener.accept().await?;
        let controller = Rc::clone(&controller);
        spawn_local(async move {
            // An error ends this connection only.
            drop(serve(stream, &controller).await);
        });
    }
}

async fn serve(stream: TcpStream, controller: &Controller) -> io::Result<()> {
    let mut stream = BufReader::new(stream);
    stream.write_all(b"Connected: Universal Robots Dashboard Server\n").await?;
    loop {
        let mut line = Vec::new();
        loop {
            let piece = stream.fill_buf().await?;
            let end = piece.iter().position(|byte| *byte == b'\n');
            let taken = end.map_or(piece.len(), |end| end + 1);
            line.extend_from_slice(&piece[..taken]);
            stream.consume(taken);
            if end.is_some() {
                break;
            }
            if taken == 0 || line.len() > LONGEST_LINE {
                return Ok(());
            }
        }
        let line = String::from_utf8_lossy(&line);
        let command = line.trim();
        let answer = answer(command, controller);
        stream.write_all(format!("{answer}\n").as_bytes()).await?;
        if command == "quit" {
            return Ok(());
        }
    }
}

fn answer(command: &str, controller: &Controller) -> String {
    let [mode, safety, program] = controller.words();
    match command {
        "robotmode" => format!("Robotmode: {mode}"),
        "safetystatus" => format!("Safetystatus: {safety}"),
        "safetymode" => format!("Safetymode: {safety}"),
        "programState" => program,
        "running" => format!("Program running: {}", controller.is_playing()),
        "is in remote control" => controller.is_remote.to_string(),
        "PolyscopeVersion" => "URSoftware 5.12.2.1101534 (Jul 06 2022)".into(),
        "version" => "5.12.2.1101534".into(),
        "get serial number" => "20225000000".into(),
        "get robot model" => controller.arm.robot.name.to_uppercase(),
        "stop" => {
            controller.stop_program();
            "Stopped".into()
        }
        "unlock protective stop" | "brake release" | "power on" => {
            controller.restart();
            match command {
                "power on" => "Powering on".into(),
                "brake release" => "Brake releasing".into(),
                _ => "Protective stop releasing".into(),
            }
        }
        "close popup" => "closing popup".into(),
        "close safety popup" => "closing safety popup".into(),
        "quit" | "disconnect" => "Disconnected".into(),
        _ => format!("could not understand: '{command}'"),
    }
}
