//! Carries out statements.

use std::future::ready;
use std::rc::Rc;

use super::machine::{Frame, Host, Machine, Step, Stop};
use super::operators::{set_element, truth};
use super::tree::{Action, Assignment, Branch, Choice, Expression, Reach, Statement};
use super::trouble::Trouble;
use super::value::{Thread, Value};

/// Where a program goes on after a statement.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Value),
}

impl<H: Host> Machine<H> {
    /// Carries out the body of a function; what it returns.
    pub(crate) async fn body(self: &Rc<Self>, statements: &[Statement], frame: &Frame<'_>) -> Result<Value, Stop> {
        match self.block(statements, frame).await? {
            Flow::Return(value) => Ok(value),
            Flow::Next | Flow::Break | Flow::Continue => Ok(Value::None),
        }
    }

    fn block<'a>(self: &'a Rc<Self>, statements: &'a [Statement], frame: &'a Frame<'a>) -> Step<'a, Flow> {
        Box::pin(async move {
            frame.task.descend()?;
            let mut flow = Flow::Next;
            for statement in statements {
                self.pace().await;
                let outcome = self.statement(&statement.action, frame).await;
                flow = outcome.map_err(|stop| stop.at(statement.line, frame.function))?;
                if !matches!(flow, Flow::Next) {
                    break;
                }
            }
            frame.task.ascend();
            Ok(flow)
        })
    }

    fn statement<'a>(self: &'a Rc<Self>, action: &'a Action, frame: &'a Frame<'a>) -> Step<'a, Flow> {
        match action {
            Action::Assign(assignment) => Box::pin(self.assign(assignment, frame)),
            Action::If(choice) => Box::pin(self.choose(choice, frame)),
            Action::While(branch) => Box::pin(self.repeat(branch, frame)),
            Action::Return(None) => Box::pin(ready(Ok(Flow::Return(Value::None)))),
            Action::Return(Some(value)) => Box::pin(async move { Ok(Flow::Return(self.evaluate(value, frame).await?)) }),
            Action::Break => Box::pin(ready(Ok(Flow::Break))),
            Action::Continue => Box::pin(ready(Ok(Flow::Continue))),
            Action::Halt => Box::pin(ready(Err(Stop::Halt))),
            Action::Nothing => Box::pin(ready(Ok(Flow::Next))),
            Action::Define(definition) => {
                frame.scope.define(definition);
                Box::pin(ready(Ok(Flow::Next)))
            }
            Action::Kill(thread) => Box::pin(self.kill(thread, frame)),
            Action::Join(thread) => Box::pin(self.join(thread, frame)),
            Action::Evaluate(expression) => Box::pin(async move {
                self.evaluate(expression, frame).await?;
                Ok(Flow::Next)
            }),
        }
    }

    async fn kill(self: &Rc<Self>, thread: &Expression, frame: &Frame<'_>) -> Result<Flow, Stop> {
        if let Some(thread) = self.thread(thread, frame).await? {
            thread.kill().await;
        }
        Ok(Flow::Next)
    }

    async fn join(self: &Rc<Self>, thread: &Expression, frame: &Frame<'_>) -> Result<Flow, Stop> {
        let Some(thread) = self.thread(thread, frame).await? else { return Ok(Flow::Next) };
        if thread.id() == frame.task.thread {
            return Err(Trouble::new("a thread cannot wait for its own end").into());
        }
        thread.join().await;
        Ok(Flow::Next)
    }

    /// The thread of a handle. Programs in use end threads that they have not started yet, whose handle is a number still.
    async fn thread(self: &Rc<Self>, expression: &Expression, frame: &Frame<'_>) -> Result<Option<Thread>, Stop> {
        match self.evaluate(expression, frame).await? {
            Value::Thread(thread) => Ok(Some(thread)),
            Value::Integer(_) => Ok(None),
            other => Err(Trouble::new(format!("a thread is needed here, not {}", other.kind())).into()),
        }
    }

    async fn assign(self: &Rc<Self>, assignment: &Assignment, frame: &Frame<'_>) -> Result<Flow, Stop> {
        let mut value = self.evaluate(&assignment.value, frame).await?;
        let name = &assignment.name;
        if !assignment.indices.is_empty() {
            let mut indices = Vec::new();
            for index in &assignment.indices {
                indices.push(self.evaluate(index, frame).await?);
            }
            let list = frame.scope.get(name).ok_or_else(|| Trouble::new(format!("there is no variable {name}")))?;
            value = set_element(list, &indices, value)?.limited()?;
        }
        match assignment.reach {
            Reach::Nearest => frame.scope.set_nearest(name, value)?,
            Reach::Local => frame.scope.set_here(name, value)?,
            Reach::Global => frame.scope.set_global(name, value)?,
        }
        Ok(Flow::Next)
    }

    async fn choose(self: &Rc<Self>, choice: &Choice, frame: &Frame<'_>) -> Result<Flow, Stop> {
        for branch in &choice.branches {
            if truth(&self.evaluate(&branch.condition, frame).await?)? {
                return self.block(&branch.body, frame).await;
            }
        }
        self.block(&choice.otherwise, frame).await
    }

    async fn repeat(self: &Rc<Self>, branch: &Branch, frame: &Frame<'_>) -> Result<Flow, Stop> {
        while truth(&self.evaluate(&branch.condition, frame).await?)? {
            match self.block(&branch.body, frame).await? {
                Flow::Next | Flow::Continue => {}
                Flow::Break => break,
                returned @ Flow::Return(_) => return Ok(returned),
            }
            tokio::task::yield_now().await;
        }
        Ok(Flow::Next)
    }
}
