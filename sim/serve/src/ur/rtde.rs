//! Real-time data exchange of the served controller.

use std::cell::Cell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use calibench_wire::ur::{DataType, Datum, Package, PackageKind, PackageReader, input_type, output_type};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::spawn_local;
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::Controller;
use crate::fault::Fault;

/// Version of the protocol.
const PROTOCOL: u16 = 2;

/// Version of the controller's software that the twin reports.
const SOFTWARE: [u32; 4] = [5, 12, 2, 1_101_534];

/// Variables that only later software has: from 5.23 and 10.11 on.
const LATER: [&str; 1] = ["actual_current_as_torque"];

/// Range of the packages a second.
const FREQUENCIES: [f64; 2] = [1.0, 500.0];

/// Most recipes of inputs that a client may set up.
const MOST_RECIPES: usize = 255;

/// Accepts clients until the socket is closed.
///
/// # Errors
/// When the socket fails.
pub async fn listen(listener: TcpListener, controller: Rc<Controller>) -> io::Result<()> {
    let clients = Cell::new(0);
    loop {
        let (stream, _) = listener.accept().await?;
        clients.set(clients.get() + 1);
        let (number, controller) = (clients.get(), Rc::clone(&controller));
        spawn_local(async move {
            let recipes = Recipes { outputs: Vec::new(), inputs: Vec::new(), frequency: FREQUENCIES[1], is_sending: false };
            let mut connection = Connection { stream, number, controller, recipes, said: 0 };
            // An error ends this connection only.
            drop(connection.serve().await);
            connection.controller.claimed.borrow_mut().retain(|_, client| *client != number);
        });
    }
}

/// A variable of a recipe.
#[derive(Debug, Clone)]
struct Variable {
    name: String,
    kind: DataType,
}

struct Recipes {
    outputs: Vec<Variable>,
    inputs: Vec<Vec<Variable>>,
    frequency: f64,
    is_sending: bool,
}

struct Connection {
    stream: TcpStream,
    number: u64,
    controller: Rc<Controller>,
    recipes: Recipes,
    said: usize,
}

impl Connection {
    async fn serve(&mut self) -> io::Result<()> {
        self.stream.set_nodelay(true)?;
        let mut broken = self.controller.arm.broken_links.subscribe();
        let mut packages = PackageReader::default();
        let mut buffer = [0; 4096];
        let mut clock = self.clock();
        loop {
            let length = tokio::select! {
                read = self.stream.read(&mut buffer) => read?,
                _ = clock.tick(), if self.recipes.is_sending => {
                    self.send_data().await?;
                    continue;
                }
                _ = broken.changed() => return self.stream.set_zero_linger(),
            };
            if length == 0 {
                return Ok(());
            }
            self.controller.arm.floor.traffic.note_robot_request(length);
            packages.push(&buffer[..length]);
            while let Some(package) = packages.next_package().map_err(io::Error::other)? {
                if self.controller.arm.floor.faults.borrow_mut().strikes(Fault::HalfOpen, 0) {
                    // Stays open, and says nothing more.
                    while self.stream.read(&mut buffer).await? > 0 {}
                    return Ok(());
                }
                let kind = package.kind;
                if let Some(body) = self.answer(package) {
                    self.send(&Package { kind, body }).await?;
                }
                if kind == PackageKind::Outputs {
                    clock = self.clock();
                }
            }
        }
    }

    fn clock(&self) -> Interval {
        let mut clock = interval(Duration::from_secs_f64(1.0 / self.recipes.frequency));
        clock.set_missed_tick_behavior(MissedTickBehavior::Skip);
        clock
    }

    async fn send(&mut self, package: &Package) -> io::Result<()> {
        let bytes = package.encode();
        self.controller.arm.floor.traffic.note_robot_answer(bytes.len());
        self.stream.write_all(&bytes).await
    }

    async fn send_data(&mut self) -> io::Result<()> {
        for words in self.controller.messages_from(self.said) {
            self.said += 1;
            self.send(&Package::message(&words, "controller", 1)).await?;
        }
        let mut body = vec![1];
        for Variable { name, kind } in &self.recipes.outputs {
            self.controller.output(name).encode(*kind, &mut body);
        }
        self.send(&Package { kind: PackageKind::Data, body }).await
    }

    /// The body of the answer, if there is one.
    fn answer(&mut self, Package { kind, body }: Package) -> Option<Vec<u8>> {
        match kind {
            PackageKind::ProtocolVersion => Some(vec![u8::from(body == PROTOCOL.to_be_bytes())]),
            PackageKind::ControllerVersion => Some(SOFTWARE.iter().flat_map(|number| number.to_be_bytes()).collect()),
            PackageKind::Outputs => Some(self.set_outputs(&body)),
            PackageKind::Inputs => Some(self.set_inputs(&body)),
            PackageKind::Start | PackageKind::Pause => {
                self.recipes.is_sending = kind == PackageKind::Start && !self.recipes.outputs.is_empty();
                Some(vec![u8::from(kind == PackageKind::Pause || self.recipes.is_sending)])
            }
            PackageKind::Data => {
                self.take(&body);
                None
            }
            PackageKind::Message => None,
        }
    }

    fn set_outputs(&mut self, body: &[u8]) -> Vec<u8> {
        let mut names = body;
        let frequency = Datum::decode(DataType::Double, &mut names).map_or(f64::NAN, |frequency| frequency.real());
        if (FREQUENCIES[0]..=FREQUENCIES[1]).contains(&frequency) {
            self.recipes.frequency = frequency;
        }
        let names = names_in(names);
        let types: Vec<Option<DataType>> =
            names.iter().map(|name| output_type(name).filter(|_| !LATER.contains(&name.as_str()))).collect();
        self.recipes.outputs = variables(&names, &types);
        answer(1, &types, |_| "NOT_FOUND")
    }

    fn set_inputs(&mut self, body: &[u8]) -> Vec<u8> {
        let names = names_in(body);
        let mut claimed = self.controller.claimed.borrow_mut();
        let is_taken = |name: &str| claimed.get(name).is_some_and(|client| *client != self.number);
        let types: Vec<Option<DataType>> = names.iter().map(|name| input_type(name).filter(|_| !is_taken(name))).collect();
        let failed =
            answer(0, &types, |k| if names.get(k).is_some_and(|name| is_taken(name)) { "IN_USE" } else { "NOT_FOUND" });
        let recipe = variables(&names, &types);
        if recipe.is_empty() || self.recipes.inputs.len() == MOST_RECIPES {
            return failed;
        }
        claimed.extend(recipe.iter().map(|variable| (variable.name.clone(), self.number)));
        self.recipes.inputs.push(recipe);
        answer(self.recipes.inputs.len() as u8, &types, |_| "NOT_FOUND")
    }

    fn take(&self, body: &[u8]) {
        let Some((&number, mut values)) = body.split_first() else { return };
        let recipe = usize::from(number).checked_sub(1).and_then(|k| self.recipes.inputs.get(k));
        let Some(recipe) = recipe else { return };
        let taken: Option<Vec<(String, Datum)>> =
            recipe.iter().map(|variable| Some((variable.name.clone(), Datum::decode(variable.kind, &mut values)?))).collect();
        // A package that is too short is dropped whole.
        self.controller.take_inputs(taken.unwrap_or_default().into_iter());
    }
}

/// The names of a list that clients write with a comma between or after them.
fn names_in(list: &[u8]) -> Vec<String> {
    let list = String::from_utf8_lossy(list);
    list.split(',').map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// The variables of a recipe; none if one of them is not to be had.
fn variables(names: &[String], types: &[Option<DataType>]) -> Vec<Variable> {
    let both = names.iter().zip(types);
    let variables: Option<Vec<Variable>> =
        both.map(|(name, kind)| Some(Variable { name: name.clone(), kind: (*kind)? })).collect();
    variables.unwrap_or_default()
}

/// Number and types of a recipe; `missing` says why a variable has no type.
fn answer(number: u8, types: &[Option<DataType>], missing: impl Fn(usize) -> &'static str) -> Vec<u8> {
    let names = types.iter().enumerate().map(|(k, kind)| kind.map_or_else(|| missing(k), DataType::name));
    let mut body = vec![number];
    body.extend_from_slice(names.collect::<Vec<_>>().join(",").as_bytes());
    body
}
