//! What stops a program while it runs.

/// Where in a program something happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The line of the program's text, counted from one.
    pub line: usize,
    /// The function or thread that the line belongs to.
    pub function: String,
}

/// An error that ends a running program: what is wrong, and where once that is known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", prefix(.place.as_ref()))]
pub struct Trouble {
    message: String,
    place: Option<Place>,
}

impl Trouble {
    /// An error with this message; the interpreter adds the place.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), place: None }
    }

    /// Adds the place, unless a place nearer to the cause is already known.
    pub(crate) fn at(mut self, line: usize, function: &str) -> Self {
        self.place.get_or_insert_with(|| Place { line, function: function.to_owned() });
        self
    }
}

fn prefix(place: Option<&Place>) -> String {
    match place {
        Some(Place { line, function }) if function.is_empty() => format!("line {line}: "),
        Some(Place { line, function }) => format!("line {line}, in {function}: "),
        None => String::new(),
    }
}
