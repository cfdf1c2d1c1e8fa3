//! Variables and functions, and where they can be seen.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

use super::tree::Definition;
use super::trouble::Trouble;
use super::value::Value;

/// How many elements and characters all variables of a program may hold together.
const MAX_STORED: usize = 1 << 20;

/// The names of one call. The program's own body is the outermost scope, which also holds the globals.
#[derive(Default)]
pub(crate) struct Scope {
    variables: RefCell<HashMap<String, Value>>,
    functions: RefCell<HashMap<String, Rc<Definition>>>,
    parent: Option<Rc<Scope>>,
    /// The size of the variables of all scopes of the program.
    stored: Rc<Cell<usize>>,
}

/// A function and the scope that it was defined in, whose names it sees.
pub(crate) struct Function {
    pub definition: Rc<Definition>,
    pub home: Rc<Scope>,
}

impl Drop for Scope {
    fn drop(&mut self) {
        let own = self.variables.get_mut().values().fold(0_usize, |sum, value| sum.saturating_add(value.weight()));
        self.stored.set(self.stored.get().saturating_sub(own));
    }
}

impl Scope {
    pub(crate) fn inside(parent: &Rc<Self>) -> Self {
        Self {
            variables: RefCell::default(),
            functions: RefCell::default(),
            parent: Some(Rc::clone(parent)),
            stored: Rc::clone(&parent.stored),
        }
    }

    pub(crate) fn get(&self, name: &str) -> Option<Value> {
        let mut scope = self;
        loop {
            if let Some(value) = scope.variables.borrow().get(name) {
                return Some(value.clone());
            }
            scope = scope.parent.as_deref()?;
        }
    }

    /// Sets the variable of this scope.
    pub(crate) fn set_here(&self, name: &str, value: Value) -> Result<(), Trouble> {
        let mut variables = self.variables.borrow_mut();
        let freed = variables.get(name).map_or(0, Value::weight);
        let stored = self.stored.get().saturating_sub(freed).saturating_add(value.weight());
        if stored > MAX_STORED {
            return Err(Trouble::new(format!("the variables hold more than {MAX_STORED} elements or characters")));
        }
        self.stored.set(stored);
        match variables.get_mut(name) {
            Some(variable) => *variable = value,
            None => {
                variables.insert(name.to_owned(), value);
            }
        }
        Ok(())
    }

    /// Sets the innermost variable of this name, and makes one here if there is none.
    pub(crate) fn set_nearest(&self, name: &str, value: Value) -> Result<(), Trouble> {
        let mut scope = self;
        while !scope.variables.borrow().contains_key(name) {
            match scope.parent.as_deref() {
                Some(parent) => scope = parent,
                None => return self.set_here(name, value),
            }
        }
        scope.set_here(name, value)
    }

    pub(crate) fn set_global(&self, name: &str, value: Value) -> Result<(), Trouble> {
        let mut scope = self;
        while let Some(parent) = scope.parent.as_deref() {
            scope = parent;
        }
        scope.set_here(name, value)
    }

    pub(crate) fn define(&self, definition: &Rc<Definition>) {
        self.functions.borrow_mut().insert(definition.name.clone(), Rc::clone(definition));
    }

    pub(crate) fn function(self: &Rc<Self>, name: &str) -> Option<Function> {
        let mut scope = self;
        loop {
            // The scope is found, not remembered by the function: they would keep each other alive.
            if let Some(definition) = scope.functions.borrow().get(name) {
                return Some(Function { definition: Rc::clone(definition), home: Rc::clone(scope) });
            }
            scope = scope.parent.as_ref()?;
        }
    }
}
