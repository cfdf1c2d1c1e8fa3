//! A running workbench, and plain HTTP to communicate with it.
// Not every test needs all of this module.
#![allow(dead_code)] // each test uses its own part

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

/// Longer than any action takes, even in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The running program.
pub struct Workbench {
    process: Child,
    /// The address as printed.
    pub url: String,
    pub port: u16,
    pub token: String,
}

/// The answer to a request.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
}

impl Workbench {
    /// Starts the program in a folder, and waits for its first line.
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

    /// Sends bytes unchanged, and reads until the other side closes.
    pub fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // A request rejected early need not be read to its end.
        stream.write_all(request).ok();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).ok();
        let text = String::from_utf8(bytes).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
        Answer { status, head: head.to_owned(), body: body.to_owned() }
    }

    /// Sends a request as the page does, except for headers that `headers` replaces or, if empty, omits.
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

    /// The answer to an action, which must succeed.
    pub fn act(&self, action: &str, body: &Value) -> Value {
        let answer = self.ask("POST", &format!("/api/{action}"), &[], &body.to_string());
        assert_eq!(answer.status, 200, "{action}: {}", answer.body);
        serde_json::from_str(&answer.body).unwrap()
    }

    /// The answer to a request without side effects.
    pub fn get(&self, what: &str) -> Value {
        let answer = self.ask("GET", &format!("/api/{what}"), &[], "");
        assert_eq!(answer.status, 200, "{what}: {}", answer.body);
        serde_json::from_str(&answer.body).unwrap()
    }

    /// Interrupts the program as the keyboard would, waits, and returns its exit code.
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
