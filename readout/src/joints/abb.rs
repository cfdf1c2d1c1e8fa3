//! ABB: Robot Web Services, version 1 of RobotWare 6, whose log-in is a digest, and version 2 of RobotWare 7.
//!
//! `GET /rw/motionsystem/mechunits/ROB_1/jointtarget` answers with the joints in degrees, as elements of classes `rax_1` to
//! `rax_6`; `GET /rw/rapid/tasks/T_ROB1/motion?resource=jointtarget` with `j1` to `j6`. Either is read. Source: ABB's manual of
//! Robot Web Services, 3HAC050973.

use super::JointReader;
use super::web::{LogIn, Web};
use crate::ReadoutError;

/// What both versions send; the second refuses what does not name it.
const ACCEPT: &str = "application/xhtml+xml;v=2.0, application/xhtml+xml, text/html;q=0.9, */*;q=0.8";
/// Most joints of an arm.
const MOST_JOINTS: usize = 7;

/// An ABB controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AbbSettings {
    /// `HOST` or `HOST:PORT` of its web server.
    pub address: String,
    /// Mechanical unit, usually `ROB_1`; a name that starts with `T_` is a task.
    pub unit: String,
    /// Who logs in.
    pub log_in: Option<LogIn>,
}

impl AbbSettings {
    /// Mechanical unit of a controller with one robot.
    pub const UNIT: &str = "ROB_1";
    /// User and password as delivered.
    pub const USER: [&str; 2] = ["Default User", "robotics"];
}

/// The web services of a controller.
pub(super) struct AbbService {
    web: Web,
    path: String,
}

impl AbbService {
    pub fn new(settings: &AbbSettings) -> Self {
        let AbbSettings { address, unit, log_in } = settings;
        let path = if unit.starts_with("T_") {
            format!("/rw/rapid/tasks/{unit}/motion?resource=jointtarget")
        } else {
            format!("/rw/motionsystem/mechunits/{unit}/jointtarget")
        };
        AbbService { web: Web::new(&format!("ABB at {address}"), address, log_in.clone()), path }
    }
}

impl JointReader for AbbService {
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError> {
        let answer = self.web.get(&self.path, ACCEPT)?;
        joints_of_answer(&answer.text).ok_or_else(|| {
            let problem = format!("{} has no joints (status {})", self.path, answer.status);
            let remedy = if answer.status.is_redirection() || answer.status.as_u16() == 400 {
                "it may want TLS: see the page on measuring by hand"
            } else {
                "give the `unit` that the controller has, as ROB_1 or T_ROB1"
            };
            ReadoutError::new(self.web.whom(), problem, remedy)
        })
    }
}

/// The joints of an answer, deg; `None` if there are none.
pub fn joints_of_answer(answer: &str) -> Option<Vec<f64>> {
    ["rax_", "j"].iter().find_map(|stem| {
        let joint = |k: usize| element(answer, &format!("{stem}{k}"));
        let joints: Vec<f64> = (1..=MOST_JOINTS).map_while(joint).collect();
        (!joints.is_empty()).then_some(joints)
    })
}

/// The number in `<span class="NAME">1.5</span>`, or after `"NAME":` in JSON.
fn element(answer: &str, name: &str) -> Option<f64> {
    let quoted = format!("\"{name}\"");
    let after = answer.split_once(&quoted)?.1.trim_start_matches([' ', '>', ':', '"', '\n', '\r', '\t']);
    let end = after.find(['<', '"', ',', '}', '\n']).unwrap_or(after.len());
    crate::line_form::number(&after[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_both_resources_and_versions() {
        let spans = |stem: &str| {
            let spans: String = (1..=6).map(|k| format!("<span class=\"{stem}{k}\">{}.5</span>\n", 10 * k)).collect();
            format!(
                "<ul><li class=\"ms-jointtarget\" title=\"jointtarget\">\n{spans}<span class=\"eax_a\">9E+09</span></li></ul>"
            )
        };
        let want = Some(vec![10.5, 20.5, 30.5, 40.5, 50.5, 60.5]);
        assert_eq!(joints_of_answer(&spans("rax_")), want);
        assert_eq!(joints_of_answer(&spans("j")), want);
        let json = r#"{ "state" : [ { "_type" : "ms-jointtarget", "rax_1" : "10.5", "rax_2": "20.5","rax_3":"-3e-1"} ] }"#;
        assert_eq!(joints_of_answer(json), Some(vec![10.5, 20.5, -0.3]));
        assert_eq!(joints_of_answer("<span class=\"code\">-1073445865</span>"), None);
    }
}
