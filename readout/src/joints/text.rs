//! Any controller whose program sends its joints as lines of text, asked or not.

use std::time::{Duration, Instant};

use super::JointReader;
use crate::ReadoutError;
use crate::line_form::LineForm;
use crate::line_link::{End, LineLink};

/// A controller that sends lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextSettings {
    /// Which side of the connection this program is.
    pub end: End,
    /// What to send for a line; none where it sends by itself.
    pub ask: Option<String>,
    /// The line, with fields `{q1}`, `{q2}` and so on.
    pub line: LineForm,
    /// Longest wait for a line.
    pub timeout: Duration,
}

/// Most joints of a line.
const MOST_JOINTS: usize = 12;

impl TextSettings {
    /// True for the name of a joint's field.
    pub fn is_field(name: &str) -> bool {
        (1..=MOST_JOINTS).any(|k| name == format!("q{k}"))
    }

    /// Number of joints in a line: those from `q1` on, without a gap.
    pub fn joints(&self) -> usize {
        (1..=MOST_JOINTS).take_while(|k| self.line.has(&format!("q{k}"))).count()
    }
}

/// A connection to such a controller.
pub(super) struct TextJoints {
    settings: TextSettings,
    link: LineLink,
}

impl TextJoints {
    pub fn open(settings: &TextSettings) -> Result<Self, ReadoutError> {
        let (End::Connect(address) | End::Listen(address)) = &settings.end;
        let link = LineLink::open(&format!("controller at {address}"), &settings.end)?;
        Ok(TextJoints { settings: settings.clone(), link })
    }

    /// The joints of a line, in the order of their numbers; `None` if it is another line.
    fn of_line(&self, line: &str) -> Option<Vec<f64>> {
        let fields = self.settings.line.read(line)?;
        let joint = |k: usize| {
            fields.iter().find(|(name, _)| *name == format!("q{k}")).and_then(|(_, text)| self.settings.line.number(text))
        };
        (1..=self.settings.joints()).map(joint).collect()
    }
}

impl JointReader for TextJoints {
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError> {
        let asked = Instant::now();
        if let Some(ask) = &self.settings.ask {
            self.link.send(ask)?;
        }
        let until = Instant::now() + self.settings.timeout;
        let mut other = None;
        while let Some(line) = self.link.line_after(asked, until) {
            match self.of_line(&line.text) {
                Some(joints) => return Ok(joints),
                None => other = Some(line.text),
            }
        }
        let error = match other {
            Some(line) => self.link.other_line(&line),
            None => self.link.silent(self.settings.timeout, "see whether its program runs and sends"),
        };
        // An answer that is late is not the next one.
        self.settings.ask.iter().for_each(|_| self.link.hang_up());
        Err(error)
    }
}
