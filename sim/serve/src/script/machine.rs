//! What the threads of a running program share.

use std::cell::{Cell, RefCell};
use std::pin::Pin;
use std::rc::Rc;

use tokio::sync::Notify;

use super::arguments::Arguments;
use super::scope::Scope;
use super::trouble::Trouble;
use super::value::Value;

/// How deep functions may call one another.
pub const MAX_CALLS: usize = 100;

/// How many threads of a program may run at once.
pub const MAX_THREADS: usize = 50;

/// How deep blocks and expressions of all open calls may be nested together: each level takes from the stack.
const MAX_DEPTH: usize = 400;

/// After how many statements a program lets others run.
const PATIENCE: u32 = 100;

/// The controller that a program runs on.
pub trait Host: 'static {
    /// Calls a function of the controller: any function that neither the program defines nor the language has.
    ///
    /// A function that the controller does not have is an error. The future is dropped where it waits when the program
    /// ends or kills the thread that calls, so whatever it began has to end with it. Local tasks that it spawns end with
    /// the program.
    fn call(&self, name: &str, arguments: &Arguments) -> impl Future<Output = Result<Value, Trouble>>;
}

pub(crate) type Step<'a, T> = Pin<Box<dyn Future<Output = Result<T, Stop>> + 'a>>;

/// Why a program goes no further.
#[derive(Debug)]
pub(crate) enum Stop {
    Halt,
    Trouble(Trouble),
}

impl From<Trouble> for Stop {
    fn from(trouble: Trouble) -> Self {
        Self::Trouble(trouble)
    }
}

impl Stop {
    pub(crate) fn at(self, line: usize, function: &str) -> Self {
        match self {
            Self::Halt => Self::Halt,
            Self::Trouble(trouble) => Self::Trouble(trouble.at(line, function)),
        }
    }
}

pub(crate) struct Machine<H> {
    pub host: Rc<H>,
    threads: Cell<usize>,
    started: Cell<u64>,
    statements: Cell<u32>,
    stopping: Notify,
    stop: RefCell<Option<Stop>>,
}

/// One thread of the program, or its main line.
#[derive(Default)]
pub(crate) struct Task {
    pub thread: u64,
    depth: Cell<usize>,
    calls: Cell<usize>,
}

/// One call of a function.
pub(crate) struct Frame<'a> {
    pub scope: Rc<Scope>,
    pub function: &'a str,
    pub task: &'a Task,
}

/// Counts a thread for as long as it exists.
pub(crate) struct Counted<H> {
    machine: Rc<Machine<H>>,
}

impl<H> Drop for Counted<H> {
    fn drop(&mut self) {
        self.machine.threads.set(self.machine.threads.get().saturating_sub(1));
    }
}

impl<H> Machine<H> {
    pub(crate) fn new(host: Rc<H>) -> Self {
        Self {
            host,
            threads: Cell::new(0),
            started: Cell::new(0),
            statements: Cell::new(0),
            stopping: Notify::new(),
            stop: RefCell::new(None),
        }
    }

    /// Lets others run after every so many statements.
    pub(crate) async fn pace(&self) {
        let statements = self.statements.get().saturating_add(1);
        if statements < PATIENCE {
            self.statements.set(statements);
        } else {
            self.statements.set(0);
            tokio::task::yield_now().await;
        }
    }

    pub(crate) fn counted(self: &Rc<Self>) -> Result<Counted<H>, Trouble> {
        if self.threads.get() >= MAX_THREADS {
            return Err(Trouble::new(format!("more than {MAX_THREADS} threads at once")));
        }
        self.threads.set(self.threads.get().saturating_add(1));
        Ok(Counted { machine: Rc::clone(self) })
    }

    pub(crate) fn next_thread(&self) -> u64 {
        self.started.set(self.started.get().saturating_add(1));
        self.started.get()
    }

    /// Ends the whole program from inside a thread; the first reason counts.
    pub(crate) fn end(&self, stop: Stop) {
        self.stop.borrow_mut().get_or_insert(stop);
        self.stopping.notify_one();
    }

    /// Returns once a thread has ended the program.
    pub(crate) async fn ended(&self) -> Stop {
        loop {
            if let Some(stop) = self.stop.borrow_mut().take() {
                return stop;
            }
            self.stopping.notified().await;
        }
    }
}

impl Task {
    pub(crate) fn new(thread: u64) -> Self {
        Self { thread, ..Self::default() }
    }

    pub(crate) fn descend(&self) -> Result<(), Trouble> {
        deeper(&self.depth, MAX_DEPTH, "blocks and expressions are nested too deep in the functions that call one another")
    }

    // No guards: an error ends the whole task, so only what succeeds has to count back.
    pub(crate) fn ascend(&self) {
        self.depth.set(self.depth.get().saturating_sub(1));
    }

    pub(crate) fn enter(&self) -> Result<(), Trouble> {
        deeper(&self.calls, MAX_CALLS, "functions call one another too deep")
    }

    pub(crate) fn leave(&self) {
        self.calls.set(self.calls.get().saturating_sub(1));
    }
}

fn deeper(count: &Cell<usize>, most: usize, message: &str) -> Result<(), Trouble> {
    if count.get() >= most {
        return Err(Trouble::new(message));
    }
    count.set(count.get().saturating_add(1));
    Ok(())
}
