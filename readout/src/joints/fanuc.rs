//! FANUC: the page `/MD/CURPOS.DG` of the controller's web server, which needs no option and no program.
//!
//! Its text has a part for each motion group: `Group #: 1`, then `Joint   1:     86.75` for every joint, in degrees (mm of a
//! sliding axis) with two decimals. Joint 3 is as on the pendant, from the horizontal; robot models count it from the link before,
//! which is joint 3 plus joint 2.

use super::JointReader;
use super::web::{LogIn, Web};
use crate::ReadoutError;

/// Path of the page.
const PAGE: &str = "/MD/CURPOS.DG";

/// A FANUC controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FanucSettings {
    /// `HOST` or `HOST:PORT` of its web server, usually port 80.
    pub address: String,
    /// Motion group, from 1.
    pub group: usize,
    /// True if joint 3 counts from the horizontal, as on arms with six joints.
    pub is_coupled: bool,
    /// Who logs in, where it asks for that.
    pub log_in: Option<LogIn>,
}

/// The page of a controller.
pub(super) struct FanucPage {
    web: Web,
    group: usize,
    is_coupled: bool,
}

impl FanucPage {
    pub fn new(settings: &FanucSettings) -> Self {
        let FanucSettings { address, group, is_coupled, log_in } = settings;
        let web = Web::new(&format!("FANUC at {address}"), address, log_in.clone());
        FanucPage { web, group: *group, is_coupled: *is_coupled }
    }
}

impl JointReader for FanucPage {
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError> {
        let answer = self.web.get(PAGE, "*/*")?;
        let joints = joints_of_page(&answer.text, self.group).ok_or_else(|| {
            let problem = format!("{PAGE} has no joints of motion group {} (status {})", self.group, answer.status);
            ReadoutError::new(self.web.whom(), problem, "open the page in a browser, and give the `group` that it shows")
        });
        joints.map(|mut joints| {
            if let (true, [_, second, third, ..]) = (self.is_coupled, joints.as_mut_slice()) {
                *third += *second;
            }
            joints
        })
    }
}

/// The joints of a motion group on the page of positions, deg (or mm of a sliding axis); `None` if there are none.
pub fn joints_of_page(page: &str, group: usize) -> Option<Vec<f64>> {
    let mut here = 1;
    let mut joints = Vec::new();
    for line in page.lines().map(str::trim) {
        if let Some(number) = line.strip_prefix("Group #:") {
            here = number.trim().parse().ok()?;
        }
        let value = line.strip_prefix("Joint").and_then(|rest| rest.split_once(':'));
        let Some((number, value)) = value.filter(|_| here == group) else { continue };
        // They are numbered in their order: another number is of another kind of line.
        if number.trim().parse() != Ok(joints.len() + 1) {
            return None;
        }
        joints.push(crate::line_form::number(value)?);
    }
    (!joints.is_empty()).then_some(joints)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_of_a_controller_with_two_groups() {
        // In the layout of V7.70 and V8.30, with numbers of our own.
        let page = "<HTML><PRE>\nF Number: E00000\nCURRENT ROBOT POSITION::\nGroup #:  1\n \nCURRENT JOINT POSITION:\nJoint   1:     10.25\nJoint   2:      -.50\nJoint   3:     -0.75\n\nFrame #:  0  Tool #:  7\nX:    622.47\n\nCURRENT ROBOT POSITION::\nGroup #:  2\n \nCURRENT JOINT POSITION:\nJoint   1:    812.34\n</PRE>";
        assert_eq!(joints_of_page(page, 1), Some(vec![10.25, -0.5, -0.75]));
        assert_eq!(joints_of_page(page, 2), Some(vec![812.34]));
        assert_eq!(joints_of_page(page, 3), None);
        assert_eq!(joints_of_page("<html>404</html>", 1), None);
        assert_eq!(joints_of_page("Joint   1: ******\n", 1), None);
    }
}
