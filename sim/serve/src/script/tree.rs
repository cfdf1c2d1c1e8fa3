//! A program as a tree.

use std::rc::Rc;

use super::value::Value;

/// A program that has been read and can be run.
#[derive(Debug, Clone)]
pub struct Program {
    pub(crate) main: Rc<Definition>,
    pub(crate) secondary: bool,
}

impl Program {
    /// The name after `def`; empty for bare statements.
    pub fn name(&self) -> &str {
        &self.main.name
    }

    /// Whether it was defined with `sec`: such a program runs beside the main one and must not move the robot.
    pub fn is_secondary(&self) -> bool {
        self.secondary
    }
}

#[derive(Debug)]
pub(crate) struct Definition {
    pub name: String,
    pub thread: bool,
    pub parameters: Vec<Parameter>,
    pub body: Vec<Statement>,
}

#[derive(Debug)]
pub(crate) struct Parameter {
    pub name: String,
    pub default: Option<Expression>,
}

#[derive(Debug)]
pub(crate) struct Statement {
    pub line: usize,
    pub action: Action,
}

#[derive(Debug)]
pub(crate) enum Action {
    Assign(Assignment),
    If(Choice),
    While(Branch),
    Return(Option<Expression>),
    Break,
    Continue,
    Halt,
    Nothing,
    Define(Rc<Definition>),
    Kill(Expression),
    Join(Expression),
    Evaluate(Expression),
}

#[derive(Debug)]
pub(crate) struct Assignment {
    pub reach: Reach,
    pub name: String,
    pub indices: Vec<Expression>,
    pub value: Expression,
}

/// Which variable an assignment means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    Nearest,
    Local,
    Global,
}

#[derive(Debug)]
pub(crate) struct Choice {
    pub branches: Vec<Branch>,
    pub otherwise: Vec<Statement>,
}

#[derive(Debug)]
pub(crate) struct Branch {
    pub condition: Expression,
    pub body: Vec<Statement>,
}

#[derive(Debug)]
pub(crate) struct Expression {
    pub line: usize,
    /// How many levels there are below and including this one.
    pub height: usize,
    pub kind: Kind,
}

#[derive(Debug)]
pub(crate) enum Kind {
    Constant(Value),
    Name(String),
    List(Vec<Expression>),
    Pose(Vec<Expression>),
    Call(Call),
    Run(Call),
    Index(Pair),
    Not(Box<Expression>),
    Negate(Box<Expression>),
    Binary(Operator, Pair),
}

#[derive(Debug)]
pub(crate) struct Pair {
    pub left: Box<Expression>,
    pub right: Box<Expression>,
}

#[derive(Debug)]
pub(crate) struct Call {
    pub name: String,
    pub arguments: Vec<Argument>,
}

#[derive(Debug)]
pub(crate) struct Argument {
    pub name: Option<String>,
    pub value: Expression,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Or,
    Xor,
    And,
    Equal,
    NotEqual,
    Less,
    Greater,
    LessEqual,
    GreaterEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
}

impl Expression {
    pub(crate) fn new(line: usize, kind: Kind) -> Self {
        let tallest = |expressions: &[Self]| expressions.iter().map(|expression| expression.height).max().unwrap_or(0);
        let below = match &kind {
            Kind::Constant(_) | Kind::Name(_) => 0,
            Kind::List(elements) | Kind::Pose(elements) => tallest(elements),
            Kind::Call(call) | Kind::Run(call) => {
                call.arguments.iter().map(|argument| argument.value.height).max().unwrap_or(0)
            }
            Kind::Index(pair) | Kind::Binary(_, pair) => pair.left.height.max(pair.right.height),
            Kind::Not(operand) | Kind::Negate(operand) => operand.height,
        };
        Self { line, height: below.saturating_add(1), kind }
    }
}

impl Operator {
    /// How tightly it binds; the loosest is one.
    pub(crate) fn strength(self) -> u8 {
        match self {
            Self::Or => 1,
            Self::Xor => 2,
            Self::And => 3,
            Self::Equal | Self::NotEqual | Self::Less | Self::Greater | Self::LessEqual | Self::GreaterEqual => 4,
            Self::Add | Self::Subtract => 5,
            Self::Multiply | Self::Divide | Self::Remainder => 6,
        }
    }
}
