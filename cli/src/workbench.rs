//! The workbench, served on the loopback address; what it answers is `calibench_workbench`'s.

use std::io;
use std::sync::Arc;
use std::thread;

use calibench_loopback::{Answer, HEADER_PATIENCE, Refusal, Server, Site};
use calibench_report::{LivePage, Module, page_script};
use calibench_serve::interruption::interrupted;
use calibench_workbench::{ACTIONS, Bench, MARKUP, MODULES, STYLE, Unanswered, VIEWS};
use serde_json::json;

/// The script of the page.
const SCRIPT: Module = Module { name: "calibench-cli/server.js", text: include_str!("workbench/server.js") };

/// The workbench as a site.
struct Workbench(Arc<Bench>);

impl Site for Workbench {
    fn html(&self, policy: &str, nonce: &str) -> String {
        let script = page_script(SCRIPT, MODULES);
        LivePage { policy, nonce, style: STYLE, markup: MARKUP, script: &script }.html()
    }

    fn views(&self) -> &'static [&'static str] {
        &VIEWS
    }

    fn actions(&self) -> &'static [&'static str] {
        &ACTIONS
    }

    fn ask(&self, what: &str, body: &[u8]) -> Answer {
        match self.0.ask(what, body) {
            Err(Unanswered::Changed) => Ok(json!({"changed": true})),
            Err(Unanswered::Refused { field, message }) => Err(Refusal::Refused { field, message }),
            Err(because @ Unanswered::Malformed(_)) => Err(Refusal::Malformed(because.to_string())),
            Err(because @ Unanswered::Unknown) => Err(Refusal::Unknown(because.to_string())),
            Ok(answer) => Ok(answer),
        }
    }

    fn is_writing(&self, what: &str) -> bool {
        what.starts_with("save-")
    }
}

/// A workbench that listens.
pub struct Listening {
    server: Server<Workbench>,
    bench: Arc<Bench>,
}

impl Listening {
    /// Listens on the loopback address; port 0 takes a free one.
    ///
    /// # Errors
    /// If the port is in use.
    pub fn new(bench: Bench, port: u16) -> io::Result<Self> {
        let bench = Arc::new(bench);
        let server = Server::new(Workbench(Arc::clone(&bench)), port, HEADER_PATIENCE)?;
        Ok(Listening { server, bench })
    }

    /// Answers until interrupted; `announce` receives the page's address.
    ///
    /// # Errors
    /// If the system provides no threads or no signals; that of `announce`.
    pub fn run(self, announce: impl FnOnce(&str) -> io::Result<()>) -> io::Result<()> {
        let Listening { server, bench } = self;
        // It ends with the program.
        thread::Builder::new().name("bench".into()).spawn(move || bench.work())?;
        server.run(interrupted, announce)
    }
}
