//! Which tool and which base hold where: a program is followed along its statements, over branches, loops and calls.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::scan::{Frame, Name};

/// Passes after which a program that still changes is left as it is; each follows one more level of loops or jumps.
const MOST_PASSES: usize = 20;

/// A statement as far as frames are concerned.
#[derive(Debug, Clone)]
pub(super) enum Step {
    /// A routine begins; the names of others call it.
    Begin(String),
    /// A routine ends.
    End,
    /// A branch begins; what follows is its first side (IF), or nothing yet (SWITCH).
    Branch { is_side: bool },
    /// Another side of the branch; the last one is taken where no other is (ELSE, DEFAULT).
    Other { is_last: bool },
    /// A branch ends.
    Join,
    /// A loop begins.
    Loop,
    /// A loop ends.
    Again,
    /// A routine is called.
    Call(String),
    /// Execution goes to a label, always or under a condition.
    Jump { label: String, always: bool },
    /// The routine is left.
    Leave,
    /// A label.
    Label(String),
    /// A frame is set.
    Set(Frame, Name),
    /// A position is used, by its number; frames stated with it hold for it alone.
    Use(usize, [Option<Name>; 2]),
}

/// A frame that may hold: the one of the caller, or a named one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Holds {
    Callers,
    Named(Name),
}

/// Frames that may hold, tool and base; empty where no statement leads.
type State = [BTreeSet<Holds>; 2];

/// An open branch: the state at its head, what its sides left, and whether one of them is always taken.
struct Open {
    head: State,
    sides: State,
    has_last: bool,
}

/// Names of the frames in which a position is used; empty if no frame is set before.
pub(super) type Names = BTreeSet<Name>;

/// What is known of the routines.
#[derive(Default)]
struct Known {
    exits: HashMap<String, State>,
    labels: HashMap<(String, String), State>,
    loops: HashMap<usize, State>,
    /// Of every routine its callers: their name, and the frames that hold there.
    callers: BTreeMap<String, BTreeMap<usize, (String, State)>>,
    uses: BTreeMap<usize, BTreeMap<usize, (String, State)>>,
}

/// Follows a program; returns for every number of a position the tools and the bases in which it is used.
pub(super) fn follow(steps: &[Step]) -> HashMap<usize, [Names; 2]> {
    let mut known = Known::default();
    for _ in 0..MOST_PASSES {
        if !known.pass(steps) {
            break;
        }
    }
    let mut entries: BTreeMap<String, [Names; 2]> = BTreeMap::new();
    for _ in 0..MOST_PASSES {
        let before = entries.clone();
        for (routine, callers) in &known.callers {
            for (caller, state) in callers.values() {
                let from = entries.get(caller).cloned().unwrap_or_default();
                let to = entries.entry(routine.clone()).or_default();
                for (k, (to, from)) in to.iter_mut().zip(&from).enumerate() {
                    to.extend(resolved(&state[k], from));
                }
            }
        }
        if entries == before {
            break;
        }
    }
    let of_use = |sites: &BTreeMap<usize, (String, State)>| {
        let mut names = [Names::new(), Names::new()];
        for (routine, state) in sites.values() {
            let from = entries.get(routine).cloned().unwrap_or_default();
            (0..2).for_each(|k| names[k].extend(resolved(&state[k], &from[k])));
        }
        names
    };
    known.uses.iter().map(|(position, sites)| (*position, of_use(sites))).collect()
}

/// The names that hold where the frames of the caller are these.
fn resolved(state: &BTreeSet<Holds>, callers: &Names) -> Names {
    let of = |holds: &Holds| match holds {
        Holds::Callers => callers.clone(),
        Holds::Named(name) => Names::from([name.clone()]),
    };
    state.iter().flat_map(of).collect()
}

fn join(into: &mut State, other: &State) -> bool {
    let before = into.iter().map(BTreeSet::len).sum::<usize>();
    into.iter_mut().zip(other).for_each(|(into, other)| into.extend(other.iter().cloned()));
    into.iter().map(BTreeSet::len).sum::<usize>() != before
}

fn of_caller() -> State {
    [BTreeSet::from([Holds::Callers]), BTreeSet::from([Holds::Callers])]
}

impl Known {
    /// Follows all statements once; true if something new was found.
    fn pass(&mut self, steps: &[Step]) -> bool {
        let mut is_new = false;
        let (mut routine, mut state) = (String::new(), of_caller());
        let mut branches: Vec<Open> = Vec::new();
        let mut loops: Vec<usize> = Vec::new();
        for (at, step) in steps.iter().enumerate() {
            match step {
                Step::Begin(name) => {
                    (routine, state) = (name.clone(), of_caller());
                    branches.clear();
                    loops.clear();
                }
                Step::End => {
                    is_new |= join(self.exits.entry(routine.clone()).or_default(), &state);
                    (routine, state) = (String::new(), of_caller());
                }
                Step::Branch { is_side } => {
                    branches.push(Open { head: state.clone(), sides: State::default(), has_last: false });
                    if !is_side {
                        state = State::default();
                    }
                }
                Step::Other { is_last } => {
                    if let Some(open) = branches.last_mut() {
                        join(&mut open.sides, &state);
                        open.has_last |= is_last;
                        state.clone_from(&open.head);
                    }
                }
                Step::Join => {
                    if let Some(open) = branches.pop() {
                        join(&mut state, &open.sides);
                        if !open.has_last {
                            join(&mut state, &open.head);
                        }
                    }
                }
                Step::Loop => {
                    join(&mut state, self.loops.entry(at).or_default());
                    loops.push(at);
                }
                Step::Again => {
                    if let Some(start) = loops.pop() {
                        is_new |= join(self.loops.entry(start).or_default(), &state);
                    }
                }
                Step::Call(name) => {
                    let here = (routine.clone(), state.clone());
                    self.callers.entry(name.clone()).or_default().insert(at, here);
                    if let Some(exit) = self.exits.get(name) {
                        state = [0, 1].map(|k| substituted(&exit[k], &state[k]));
                    }
                }
                Step::Jump { label, always } => {
                    is_new |= join(self.labels.entry((routine.clone(), label.clone())).or_default(), &state);
                    if *always {
                        state = State::default();
                    }
                }
                Step::Leave => {
                    is_new |= join(self.exits.entry(routine.clone()).or_default(), &state);
                    state = State::default();
                }
                Step::Label(label) => {
                    let from = self.labels.entry((routine.clone(), label.clone())).or_default();
                    join(&mut state, from);
                }
                // Behind a jump nothing leads here, and nothing is set.
                Step::Set(..) if state.iter().all(BTreeSet::is_empty) => {}
                Step::Set(frame, name) => state[*frame as usize] = BTreeSet::from([Holds::Named(name.clone())]),
                Step::Use(position, own) => {
                    let mut here = state.clone();
                    for (k, own) in own.iter().enumerate() {
                        if let Some(name) = own {
                            here[k] = BTreeSet::from([Holds::Named(name.clone())]);
                        }
                    }
                    self.uses.entry(*position).or_default().insert(at, (routine.clone(), here));
                }
            }
        }
        is_new
    }
}

/// What holds after a call, where `exit` holds at the end of the routine and `state` before it.
fn substituted(exit: &BTreeSet<Holds>, state: &BTreeSet<Holds>) -> BTreeSet<Holds> {
    let of = |holds: &Holds| match holds {
        Holds::Callers => state.clone(),
        Holds::Named(_) => BTreeSet::from([holds.clone()]),
    };
    exit.iter().flat_map(of).collect()
}
