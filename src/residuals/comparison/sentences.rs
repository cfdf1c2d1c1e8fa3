//! Sentences on a comparison: what is observed, what it means, what to do.

use super::{Comparison, SIGNIFICANCE, Standout, Subject};
use crate::effects::registry::Registry;
use crate::effects::variable_in_words;
use crate::residuals::noise_floor::NoiseSource;
use crate::residuals::views::{JointCurve, JointVariable};
use crate::units::{DEG, MM, UM, URAD};

/// Three significant digits, but at most six decimals and all digits before the point.
fn three(x: f64) -> String {
    let before = if x == 0.0 || !x.is_finite() { 1 } else { x.abs().log10().floor() as i32 + 1 };
    format!("{x:.*}", (3 - before).clamp(0, 6) as usize)
}

/// `(+124, -85.1, +45.3) ± (4.9, 3.0, 3.3)`.
fn vector(values: &[f64], sigmas: &[f64], unit: f64) -> String {
    let list = |v: &[f64], sign: bool| {
        let one = |x: &f64| if sign && *x >= 0.0 { format!("+{}", three(x / unit)) } else { three(x / unit) };
        v.iter().map(one).collect::<Vec<_>>().join(", ")
    };
    format!("({}) ± ({})", list(values, true), list(sigmas, false))
}

fn chance(p: f64) -> String {
    if p < 1e-15 {
        "chance under 1e-15".into()
    } else if p < 1e-3 {
        format!("chance {p:.0e}")
    } else {
        format!("chance {p:.3}")
    }
}

fn percent(share: f64) -> String {
    format!("{:.*} %", usize::from(share < 0.1), 100.0 * share)
}

/// Share that a finding explains, and its probability by chance, in words.
fn explains(finding: &Standout) -> String {
    format!("explains {}, {}", percent(finding.test.explains), chance(finding.test.p_family))
}

/// The effects that a finding suggests, among which a diagnosis decides; `otherwise` if there are none.
fn suggested(finding: &Standout, registry: &Registry, otherwise: &str) -> String {
    let called = |id: &String| format!("{} ({id})", registry.in_words(id));
    match finding.effects.as_slice() {
        [] => otherwise.to_owned(),
        [one] => format!("it could be {}", called(one)),
        many => format!("it could be one of {}", many.iter().map(called).collect::<Vec<_>>().join("; ")),
    }
}

/// A joint error that depends on a variable: its meaning and remedy.
fn of_curve(finding: &Standout, curve: &JointCurve, registry: &Registry) -> String {
    let (meaning, otherwise) = match curve.against {
        JointVariable::Angle(_) => ("an error of its own gear or encoder", "try an error curve of the joint"),
        JointVariable::Torque(_) => ("it gives way to the load otherwise than the model says", "check the masses entered"),
        JointVariable::Approach(_) => ("lost motion by the side of approach", "approach from one side"),
        JointVariable::Lag(_) => (
            "it follows commanded minus reported angle",
            "make sure that the actual angles are recorded, and wait until the arm is still",
        ),
        JointVariable::Payload => {
            ("the load acts otherwise than the model says", "check mass and centre of mass of the payloads")
        }
        JointVariable::Time | JointVariable::Temperature => ("it drifts", "let the robot warm up"),
    };
    format!(
        "Joint {} against the {} is significant ({}): its apparent angle error swings by {} µrad; {meaning}: {}.",
        curve.joint,
        variable_in_words(&curve.against.name()),
        explains(finding),
        three(curve.swing() / URAD),
        suggested(finding, registry, otherwise)
    )
}

impl Comparison {
    /// The findings in sentences, the noise floor first.
    pub fn sentences(&self) -> Vec<String> {
        let mut said = vec![self.of_noise()];
        said.extend(self.of_contradiction());
        said.extend(self.of_lack_of_fit());
        said.extend(self.of_standing());
        said.extend(self.of_first_look());
        said.extend(self.findings.iter().map(|f| self.of_finding(f)));
        said.extend(self.of_what_is_left());
        said.extend(self.of_strays());
        said
    }

    fn of_noise(&self) -> String {
        let Some(level) = self.noise.level else {
            return "The instrument noise is unknown: the data neither state it nor hold replicates, so the views can only be judged against each \
                    other. State it in [noise] of dataset.toml, or measure ten targets twice and name them in the column repeat."
                .into();
        };
        let size = format!("{} µm per axis, {} mm rms in 3-D", three(level.per_axis / UM), three(level.rms / MM));
        match (self.noise.source, self.noise.replicates, level.interval) {
            (NoiseSource::Replicates, Some(r), Some([low, high])) => format!(
                "Instrument noise {size} (95 %: {} to {} mm), from the scatter of {} replicates of {} targets.",
                three(low / MM),
                three(high / MM),
                r.samples,
                r.groups
            ),
            _ => format!("Instrument noise {size}, as the data state it."),
        }
    }

    fn of_contradiction(&self) -> Option<String> {
        let (p, stated, replicates) = (self.noise.agreement_p?, self.noise.stated_per_axis?, self.noise.replicates?);
        let found = stated * (replicates.squares / replicates.dof).sqrt();
        let (size, risk) = if found > stated { ("small", "doubts too little") } else { ("large", "overlooks errors") };
        self.noise.contradicts_statement().then(|| {
            format!(
                "Replicates scatter by {} µm per axis where {} µm are stated ({}): the stated noise is too {size}, and whoever trusts it {risk}. \
                 Correct it in [noise] of dataset.toml and identify again.",
                three(found / UM),
                three(stated / UM),
                chance(p)
            )
        })
    }

    fn of_lack_of_fit(&self) -> Option<String> {
        let fit = &self.lack_of_fit;
        let (noise, unexplained) = (fit.noise_left?, fit.unexplained?);
        let [low, high] = fit.interval?;
        let balance = format!("Noise left {} mm in a residual of {} mm", three(noise / MM), three(self.rms / MM));
        Some(match fit.p {
            Some(p) if p < SIGNIFICANCE => format!(
                "{balance}; {} mm (95 %: {} to {}) is unexplained ({}).",
                three(unexplained / MM),
                three(low / MM),
                three(high / MM),
                chance(p)
            ),
            Some(p) if fit.noise_overstated => format!(
                "The stated noise would leave {} mm, and the residual is {} mm ({}): it is stated too large, so the views are judged against each \
                 other. Measure ten targets twice to know the noise, and correct [noise] of dataset.toml.",
                three(noise / MM),
                three(self.rms / MM),
                chance(1.0 - p)
            ),
            Some(p) => format!(
                "{balance}; what is unexplained is no more than chance leaves ({}), {} mm at most.",
                chance(p),
                three(high / MM)
            ),
            None => format!(
                "{balance}; {} mm is unexplained, but too few targets are without replicates to test that.",
                three(unexplained / MM)
            ),
        })
    }

    fn of_standing(&self) -> Vec<String> {
        let mut said = Vec::new();
        if self.fit_relation.fitted {
            said.push(format!(
                "The calibration was fitted to these rows: its {} free parameters{} have absorbed what they could. A small residual does not \
                 prove accuracy elsewhere; only rows that were not fitted can.",
                self.fit_relation.absorbed,
                match self.fit_relation.held {
                    0 => String::new(),
                    held => format!(", and {held} with prior knowledge,"),
                }
            ));
        }
        let from = [(&self.fit_relation.refitted, "these samples"), (&self.fit_relation.from_fit_rows, "rows of set fit")];
        for (names, what) in from.into_iter().filter(|(names, _)| !names.is_empty()) {
            said.push(format!(
                "Not in the calibration, so fitted to {what} first, and invisible in the views: {}.",
                names.join(", ")
            ));
        }
        said
    }

    /// ` of dataset, session S` if there are several set-ups, otherwise empty.
    fn place(&self, setup: usize) -> String {
        match self.setups.get(setup) {
            Some(s) if self.setups.len() > 1 && s.session.is_empty() => format!(" of {}", s.dataset),
            Some(s) if self.setups.len() > 1 => format!(" of {}, session {}", s.dataset, s.session),
            _ => String::new(),
        }
    }

    fn of_finding(&self, finding: &Standout) -> String {
        let (sizes, sigmas) = (&finding.sizes, &finding.sigmas);
        let explains = explains(finding);
        match finding.subject {
            Subject::Ball(b) => {
                let ball = &self.balls[b];
                let name =
                    if self.several_datasets() { format!("{} of {}", ball.ball, ball.dataset) } else { ball.ball.clone() };
                format!(
                    "Ball {name} is significant ({explains}): it seems to be {} µm (world axes) from its stated place. If no effect of the arm \
                     explains it better (a diagnosis tries each), measure it again on the CMM, or leave its place to the fit (free = true).",
                    vector(sizes, sigmas, UM)
                )
            }
            Subject::Tool(s) => format!(
                "The tool{} is significant ({explains}): in its own axes the TCP seems {} µm off. If no effect of the arm explains it better (a \
                 diagnosis tries each), master the gauge again and check the TCP; if both are right, {}.",
                self.place(s),
                vector(sizes, sigmas, UM),
                suggested(finding, &self.registry, "compare the scale of the artifact with that of the arm")
            ),
            Subject::World(s) => format!(
                "The base{} is significant ({explains}): the robot seems moved by {} µm and turned by {} µrad (world axes). Where it or the \
                 artifact was moved, re-estimate the base; where not, {}.",
                self.place(s),
                vector(&sizes[..3], &sigmas[..3], UM),
                vector(&sizes[3..], &sigmas[3..], URAD),
                suggested(finding, &self.registry, "look for a base that tips or drifts")
            ),
            Subject::Curve(c) => of_curve(finding, &self.joints[c], &self.registry),
            Subject::Offset(k) => format!(
                "Joint {} is significant ({explains}): it seems {} ± {} µrad ({:.3} deg) off at every angle. Check its zero mark; if it was \
                 mastered again since, identify again.",
                self.offsets[k].joint,
                three(sizes[0] / URAD),
                three(sigmas[0] / URAD),
                sizes[0] / DEG
            ),
            Subject::Sample(w) => {
                let sample = &self.worst[w];
                format!(
                    "Sample {} disagrees with all others ({explains}): {} mm off, {} times what is usual. Measure it again or leave it out, and \
                     identify again before you believe the rest.",
                    sample.id,
                    three(sample.residual.norm() / MM),
                    three(sample.normalised)
                )
            }
        }
    }

    /// The finding to look at first, and why, if it is not the strongest.
    fn of_first_look(&self) -> Option<String> {
        let first = self.first_look().filter(|first| !std::ptr::eq(*first, &self.findings[0]))?;
        let look = self.look_at(first.subject);
        let name = match first.subject {
            Subject::Ball(b) => format!("ball {}", self.balls[b].ball),
            Subject::Tool(s) => format!("the tool{}", self.place(s)),
            Subject::World(s) => format!("the base{}", self.place(s)),
            Subject::Curve(c) => {
                format!("joint {} against the {}", self.joints[c].joint, variable_in_words(&self.joints[c].against.name()))
            }
            Subject::Offset(k) => format!("joint {}", self.offsets[k].joint),
            Subject::Sample(w) => format!("sample {}", self.worst[w].id),
        };
        Some(format!("Look first at {name}, even if more is explained elsewhere. {}", look.because()))
    }

    fn of_what_is_left(&self) -> Option<String> {
        let known = self.noise.level.is_some() && !self.lack_of_fit.noise_overstated;
        let missing = !known || self.lack_of_fit.p.is_none_or(|p| p < SIGNIFICANCE);
        if self.findings.is_empty() {
            return Some(match (missing, known) {
                (true, true) => {
                    "No ball, tool, base, joint or sample explains it alone: what is unexplained comes from several causes, follows \
                                 something that is not shown here, or is noise beyond the stated."
                        .into()
                }
                (true, false) => "No ball, tool, base, joint or sample differs significantly from the rest.".into(),
                (false, _) => "Nothing is significant: the residual is noise.".into(),
            });
        }
        let left = match self.findings.len() {
            1 => "With that removed",
            _ => "Each of these shares is in addition to those before it; with all removed",
        };
        let rms = three(self.rms * self.left.sqrt() / MM);
        Some(match self.lack_of_fit.noise_left.filter(|_| known) {
            Some(noise) => format!("{left} about {rms} mm rms would remain (noise left {} mm).", three(noise / MM)),
            None => format!("{left} about {rms} mm rms would remain."),
        })
    }

    /// Names samples that are farther off than chance allows but are not among the findings.
    fn of_strays(&self) -> Option<String> {
        let found = |w: usize| self.findings.iter().any(|f| f.subject == Subject::Sample(w));
        let strays = (0..self.worst.len()).filter(|&w| self.worst[w].test.p_family < SIGNIFICANCE && !found(w));
        let names: Vec<&str> = strays.map(|w| self.worst[w].id.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "Further off than chance allows: {}. Check what happened there; one wrong row can pull the whole fit.",
                names.join(", ")
            )
        })
    }

    /// True if there are several datasets, so that balls must be named with theirs.
    pub fn several_datasets(&self) -> bool {
        self.setups.iter().any(|s| s.dataset != self.setups[0].dataset)
    }
}
