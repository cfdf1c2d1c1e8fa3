//! Computes expressions and calls functions.

use std::future::ready;
use std::rc::Rc;

use tokio::sync::watch;

use super::arguments::{Arguments, Named};
use super::builtins;
use super::machine::{Frame, Host, Machine, Step, Stop, Task};
use super::operators::{apply, element, negate, truth};
use super::scope::{Function, Scope};
use super::tree::{Call, Definition, Expression, Kind, Operator, Pair};
use super::trouble::Trouble;
use super::value::{Allowance, Thread, Value};

impl<H: Host> Machine<H> {
    pub(crate) fn evaluate<'a>(self: &'a Rc<Self>, expression: &'a Expression, frame: &'a Frame<'a>) -> Step<'a, Value> {
        // Every kind has a future of its own on the heap: one for all would take the stack of all of them at each level.
        let inner: Step<'a, Value> = match &expression.kind {
            Kind::Constant(value) => return Box::pin(ready(Ok(value.clone()))),
            Kind::Name(name) => Box::pin(ready(variable(name, frame))),
            Kind::List(elements) => Box::pin(self.list(elements, frame)),
            Kind::Pose(elements) => Box::pin(self.pose(elements, frame)),
            Kind::Call(call) => Box::pin(self.call(call, frame)),
            Kind::Run(call) => Box::pin(self.start(call, frame)),
            Kind::Binary(operator, pair) => Box::pin(self.binary(*operator, pair, frame)),
            Kind::Index(pair) => Box::pin(self.index(pair, frame)),
            Kind::Not(operand) => Box::pin(self.not(operand, frame)),
            Kind::Negate(operand) => Box::pin(self.negative(operand, frame)),
        };
        Box::pin(async move {
            frame.task.descend()?;
            let result = inner.await;
            frame.task.ascend();
            result.map_err(|stop| stop.at(expression.line, frame.function))
        })
    }

    async fn index(self: &Rc<Self>, pair: &Pair, frame: &Frame<'_>) -> Result<Value, Stop> {
        let list = self.evaluate(&pair.left, frame).await?;
        let index = self.evaluate(&pair.right, frame).await?;
        Ok(element(&list, &index)?)
    }

    async fn not(self: &Rc<Self>, operand: &Expression, frame: &Frame<'_>) -> Result<Value, Stop> {
        let operand = self.evaluate(operand, frame).await?;
        Ok(Value::Bool(!truth(&operand)?))
    }

    async fn negative(self: &Rc<Self>, operand: &Expression, frame: &Frame<'_>) -> Result<Value, Stop> {
        let operand = self.evaluate(operand, frame).await?;
        Ok(negate(&operand)?)
    }

    async fn list(self: &Rc<Self>, elements: &[Expression], frame: &Frame<'_>) -> Result<Value, Stop> {
        let mut allowance = Allowance::new();
        let mut values = Vec::new();
        for element in elements {
            let value = self.evaluate(element, frame).await?;
            allowance.take(&value)?;
            values.push(value);
        }
        Ok(Value::List(values).limited()?)
    }

    async fn pose(self: &Rc<Self>, elements: &[Expression], frame: &Frame<'_>) -> Result<Value, Stop> {
        let mut pose = [0.0; 6];
        for (place, element) in pose.iter_mut().zip(elements) {
            let value = self.evaluate(element, frame).await?;
            let number = value.number();
            *place = number.ok_or_else(|| Trouble::new(format!("a pose is made of numbers, not of {}", value.kind())))?;
        }
        Ok(Value::Pose(pose))
    }

    async fn binary(self: &Rc<Self>, operator: Operator, pair: &Pair, frame: &Frame<'_>) -> Result<Value, Stop> {
        let left = self.evaluate(&pair.left, frame).await?;
        let decided = match operator {
            Operator::And => !truth(&left)?,
            Operator::Or => truth(&left)?,
            _ => false,
        };
        if decided {
            return Ok(left);
        }
        let right = self.evaluate(&pair.right, frame).await?;
        Ok(apply(operator, &left, &right)?)
    }

    async fn call(self: &Rc<Self>, call: &Call, frame: &Frame<'_>) -> Result<Value, Stop> {
        let arguments = Box::pin(self.arguments(call, frame)).await?;
        // Boxed: what the call needs must not lie on the stack while its arguments are computed.
        Box::pin(self.dispatch(&call.name, arguments, frame)).await
    }

    async fn dispatch(self: &Rc<Self>, name: &str, arguments: Arguments, frame: &Frame<'_>) -> Result<Value, Stop> {
        if let Some(function) = frame.scope.function(name) {
            if function.definition.thread {
                return Err(Trouble::new(format!("{name} is a thread: it is started with run")).into());
            }
            return Box::pin(self.invoke(&function, &arguments, frame.task)).await;
        }
        match builtins::call(name, &arguments) {
            Some(result) => Ok(result?),
            None => Ok(Box::pin(self.host.call(name, &arguments)).await?),
        }
    }

    async fn arguments(self: &Rc<Self>, call: &Call, frame: &Frame<'_>) -> Result<Arguments, Stop> {
        let mut allowance = Allowance::new();
        let mut positional = Vec::new();
        let mut named = Vec::new();
        for argument in &call.arguments {
            let value = self.evaluate(&argument.value, frame).await?;
            allowance.take(&value)?;
            match &argument.name {
                Some(name) => named.push(Named { name: name.clone(), value }),
                None => positional.push(value),
            }
        }
        Ok(Arguments::new(positional, named))
    }

    async fn invoke(self: &Rc<Self>, function: &Function, arguments: &Arguments, task: &Task) -> Result<Value, Stop> {
        task.enter()?;
        let definition = &function.definition;
        let frame = Frame { scope: Rc::new(Scope::inside(&function.home)), function: &definition.name, task };
        check_arguments(definition, arguments)?;
        for (position, parameter) in definition.parameters.iter().enumerate() {
            let value = match (arguments.get(position, &parameter.name), &parameter.default) {
                (Some(value), _) => value.clone(),
                (None, Some(default)) => self.evaluate(default, &frame).await?,
                (None, None) => {
                    let message = format!("{} needs the argument {}", definition.name, parameter.name);
                    return Err(Trouble::new(message).into());
                }
            };
            frame.scope.set_here(&parameter.name, value)?;
        }
        let result = self.body(&definition.body, &frame).await?;
        task.leave();
        Ok(result)
    }

    async fn start(self: &Rc<Self>, call: &Call, frame: &Frame<'_>) -> Result<Value, Stop> {
        let arguments = Box::pin(self.arguments(call, frame)).await?;
        self.spawn(&call.name, arguments, frame).map_err(Stop::from)
    }

    fn spawn(self: &Rc<Self>, name: &str, arguments: Arguments, frame: &Frame<'_>) -> Result<Value, Trouble> {
        let function = frame.scope.function(name).filter(|function| function.definition.thread);
        let function = function.ok_or_else(|| Trouble::new(format!("there is no thread {name}")))?;
        let counted = self.counted()?;
        let id = self.next_thread();
        let machine = Rc::clone(self);
        let (sender, ended) = watch::channel(());
        let handle = tokio::task::spawn_local(async move {
            // Dropped last, in this order: who waits for the end finds the thread gone and no longer counted.
            let _sender = sender;
            let _counted = counted;
            let task = Task::new(id);
            if let Err(stop) = machine.invoke(&function, &arguments, &task).await {
                machine.end(stop);
            }
        });
        Ok(Value::Thread(Thread::new(id, handle.abort_handle(), ended)))
    }
}

fn variable(name: &str, frame: &Frame<'_>) -> Result<Value, Stop> {
    frame.scope.get(name).ok_or_else(|| Trouble::new(format!("there is no variable {name}")).into())
}

fn check_arguments(definition: &Definition, arguments: &Arguments) -> Result<(), Trouble> {
    let taken = arguments.positional().len();
    if taken > definition.parameters.len() {
        return Err(Trouble::new(format!("{} has {} arguments, not {taken}", definition.name, definition.parameters.len())));
    }
    let free = definition.parameters.get(taken..).unwrap_or_default();
    let strange = arguments.named().iter().find(|named| free.iter().all(|parameter| parameter.name != named.name));
    match strange {
        Some(named) => Err(Trouble::new(format!("{} has no argument {} to be set", definition.name, named.name))),
        None => Ok(()),
    }
}
