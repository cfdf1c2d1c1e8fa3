//! A workbench that runs, and plain HTTP to speak to it.
// Not every test needs all of it.
#![allow(clippy::unwrap_used, dead_code)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

/// Longer than any action takes, even unoptimised on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The program, running.
pub struct Workbench {
    process: Child,
    /// As printed.
    pub url: String,
    pub port: u16,
    pub token: String,
}

/// What came back.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Workbench {
    /// Starts it in a folder, and waits for its line.
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_calibench"))
            .current_dir(folder)
            .arg("workbench")
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim_end().to_owned();
        let (address, token) = url.strip_prefix("http://127.0.0.1:").unwrap().split_once("/?token=").unwrap();
        Workbench { port: address.parse().unwrap(), token: token.to_owned(), url, process }
    }

    /// Sends bytes as they are, and reads until the other side has said all.
    pub fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // Whoever is turned away early need not read to the end.
        stream.write_all(request).ok();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).ok();
        let text = String::from_utf8(bytes).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
        Answer { status, head: head.to_owned(), body: body.to_owned() }
    }

    /// A request as the page makes it, but for what `headers` replace or, empty, leave out.
    pub fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Answer {
        let host = format!("127.0.0.1:{}", self.port);
        let length = body.len().to_string();
        let usual = [
            ("Host", host.as_str()),
            ("X-Calibench-Token", &self.token),
            ("Content-Type", "application/json"),
            ("Content-Length", &length),
            ("Connection", "close"),
        ];
        let mut request = format!("{method} {path} HTTP/1.1\r\n");
        let replaced = |name: &str| headers.iter().any(|(n, _)| *n == name);
        let all = usual.iter().filter(|(name, _)| !replaced(name)).chain(headers.iter().filter(|(_, value)| !value.is_empty()));
        all.for_each(|(name, value)| request.push_str(&format!("{name}: {value}\r\n")));
        self.raw(format!("{request}\r\n{body}").as_bytes())
    }

    /// The answer to an action, which must be done.
    pub fn act(&self, action: &str, body: &Value) -> Value {
        let answer = self.ask("POST", &format!("/api/{action}"), &[], &body.to_string());
        assert_eq!(answer.status, 200, "{action}: {}", answer.body);
        serde_json::from_str(&answer.body).unwrap()
    }

    /// What is to be had without doing anything.
    pub fn get(&self, what: &str) -> Value {
        let answer = self.ask("GET", &format!("/api/{what}"), &[], "");
        assert_eq!(answer.status, 200, "{what}: {}", answer.body);
        serde_json::from_str(&answer.body).unwrap()
    }

    /// Interrupts it as the keyboard would, and waits: its exit code.
    #[cfg(unix)]
    pub fn interrupt(mut self) -> Option<i32> {
        let told = Command::new("kill").args(["-INT", &self.process.id().to_string()]).status().unwrap();
        assert!(told.success());
        self.process.wait().unwrap().code()
    }
}

impl Drop for Workbench {
    fn drop(&mut self) {
        self.process.kill().ok();
        self.process.wait().ok();
    }
}
