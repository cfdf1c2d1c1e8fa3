//! What a function of the controller is called with.

use super::value::Value;

/// An argument that the call names, as in `movej(q, a=1.4)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// The name of the parameter.
    pub name: String,
    /// The value given to it.
    pub value: Value,
}

/// The arguments of one call. Parameters are looked up by their position (from zero) and by their name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Arguments {
    positional: Vec<Value>,
    named: Vec<Named>,
}

impl Arguments {
    /// Arguments of which some have positions and others have names.
    pub fn new(positional: Vec<Value>, named: Vec<Named>) -> Self {
        Self { positional, named }
    }

    /// The arguments without names, in order.
    pub fn positional(&self) -> &[Value] {
        &self.positional
    }

    /// The arguments with names.
    pub fn named(&self) -> &[Named] {
        &self.named
    }

    /// The value of the parameter with this position or this name.
    pub fn get(&self, position: usize, name: &str) -> Option<&Value> {
        let named = || self.named.iter().find(|named| named.name == name).map(|named| &named.value);
        self.positional.get(position).or_else(named)
    }

    /// The parameter as a number; none if it is missing or something else.
    pub fn number(&self, position: usize, name: &str) -> Option<f64> {
        self.get(position, name)?.number()
    }

    /// The parameter as a whole number; none if it is missing or something else.
    pub fn integer(&self, position: usize, name: &str) -> Option<i64> {
        self.get(position, name)?.integer()
    }

    /// The parameter as the numbers of a list or a pose; none if it is missing or something else.
    pub fn numbers(&self, position: usize, name: &str) -> Option<Vec<f64>> {
        self.get(position, name)?.numbers()
    }

    /// The parameter as a pose; none if it is missing or something else.
    pub fn pose(&self, position: usize, name: &str) -> Option<[f64; 6]> {
        self.get(position, name)?.pose()
    }
}
