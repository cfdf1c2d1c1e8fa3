//! Reads expressions.

use super::cursor::Cursor;
use super::lexer::{SyntaxError, Token};
use super::tree::{Argument, Call, Expression, Kind, Operator, Pair};
use super::value::Value;

/// How deep expressions may be nested.
const MAX_LEVELS: usize = 100;

impl Cursor {
    pub(crate) fn expression(&mut self) -> Result<Expression, SyntaxError> {
        self.binary(1)
    }

    fn binary(&mut self, weakest: u8) -> Result<Expression, SyntaxError> {
        let mut left = self.unary()?;
        while let Some(operator) = self.operator().filter(|operator| operator.strength() >= weakest) {
            let line = self.line();
            self.advance();
            let right = self.binary(operator.strength().saturating_add(1))?;
            let pair = Pair { left: Box::new(left), right: Box::new(right) };
            left = self.limited(Expression::new(line, Kind::Binary(operator, pair)))?;
        }
        Ok(left)
    }

    fn operator(&self) -> Option<Operator> {
        let sign = match self.token() {
            Token::Sign(sign) => sign,
            Token::Name(name) => name.as_str(),
            _ => return None,
        };
        Some(match sign {
            "or" => Operator::Or,
            "xor" => Operator::Xor,
            "and" => Operator::And,
            "==" => Operator::Equal,
            "!=" => Operator::NotEqual,
            "<" => Operator::Less,
            ">" => Operator::Greater,
            "<=" => Operator::LessEqual,
            ">=" => Operator::GreaterEqual,
            "+" => Operator::Add,
            "-" => Operator::Subtract,
            "*" => Operator::Multiply,
            "/" => Operator::Divide,
            "%" => Operator::Remainder,
            _ => return None,
        })
    }

    /// A chain such as `1 + 1 + 1` grows without brackets, and is a tree that is as deep.
    fn limited(&self, expression: Expression) -> Result<Expression, SyntaxError> {
        if expression.height > MAX_LEVELS {
            return self.error(&format!("an expression of at most {MAX_LEVELS} levels"));
        }
        Ok(expression)
    }

    fn unary(&mut self) -> Result<Expression, SyntaxError> {
        self.levels = self.levels.saturating_add(1);
        if self.levels > MAX_LEVELS {
            return self.error(&format!("an expression of at most {MAX_LEVELS} levels"));
        }
        let line = self.line();
        let expression = if self.accept_word("not") {
            // As in Python, `not a == b` denies the comparison.
            let operand = self.binary(Operator::Equal.strength())?;
            Expression::new(line, Kind::Not(Box::new(operand)))
        } else if self.accept_sign("-") {
            Expression::new(line, Kind::Negate(Box::new(self.unary()?)))
        } else if self.accept_sign("+") {
            self.unary()?
        } else if self.accept_word("run") {
            let name = self.expect_name()?;
            Expression::new(line, Kind::Run(self.call(name)?))
        } else {
            self.indexed()?
        };
        self.levels = self.levels.saturating_sub(1);
        self.limited(expression)
    }

    fn indexed(&mut self) -> Result<Expression, SyntaxError> {
        let mut expression = self.primary()?;
        while self.is_sign("[") {
            // `matrix[row, column]` is short for `matrix[row][column]`.
            while self.is_sign("[") || self.is_sign(",") {
                let line = self.line();
                self.advance();
                let pair = Pair { left: Box::new(expression), right: Box::new(self.expression()?) };
                expression = self.limited(Expression::new(line, Kind::Index(pair)))?;
            }
            self.expect_sign("]")?;
        }
        Ok(expression)
    }

    fn primary(&mut self) -> Result<Expression, SyntaxError> {
        // A value may stand on the next line, as in programs of clients in use.
        self.skip_lines();
        let line = self.line();
        let constant = match self.token() {
            Token::Integer(number) => Value::Integer(*number),
            Token::Float(number) => Value::Float(*number),
            Token::Text(text) => Value::Text(text.clone()),
            Token::Name(name) => match name.as_str() {
                "True" | "true" => Value::Bool(true),
                "False" | "false" => Value::Bool(false),
                "None" => Value::None,
                _ => return self.named(line),
            },
            Token::Sign("(") => {
                self.advance();
                let inner = self.expression()?;
                self.expect_sign(")")?;
                return Ok(inner);
            }
            Token::Sign("[") => {
                let elements = self.elements()?;
                return Ok(Expression::new(line, Kind::List(elements)));
            }
            _ => return self.error("a value"),
        };
        self.advance();
        Ok(Expression::new(line, Kind::Constant(constant)))
    }

    fn named(&mut self, line: usize) -> Result<Expression, SyntaxError> {
        let name = match self.expect_name() {
            Ok(name) => name,
            Err(_) => return self.error("a value"),
        };
        if self.is_sign("(") {
            return Ok(Expression::new(line, Kind::Call(self.call(name)?)));
        }
        if name != "p" || !self.is_sign("[") {
            return Ok(Expression::new(line, Kind::Name(name)));
        }
        let mut elements = self.elements()?;
        match elements.len() {
            6 => Ok(Expression::new(line, Kind::Pose(elements))),
            // Programs call a variable `p`, too.
            1 => {
                let Some(index) = elements.pop() else { return self.error("an index") };
                let variable = Expression::new(line, Kind::Name(name));
                Ok(Expression::new(line, Kind::Index(Pair { left: Box::new(variable), right: Box::new(index) })))
            }
            _ => self.error("the six numbers of a pose before"),
        }
    }

    fn elements(&mut self) -> Result<Vec<Expression>, SyntaxError> {
        self.expect_sign("[")?;
        let mut elements = Vec::new();
        while !self.accept_sign("]") {
            elements.push(self.expression()?);
            if !self.is_sign("]") {
                self.expect_sign(",")?;
            }
        }
        Ok(elements)
    }

    fn call(&mut self, name: String) -> Result<Call, SyntaxError> {
        self.expect_sign("(")?;
        let mut arguments: Vec<Argument> = Vec::new();
        while !self.accept_sign(")") {
            let name = if self.is_sign_next("=") {
                let name = self.expect_name()?;
                self.advance();
                Some(name)
            } else if arguments.iter().any(|argument| argument.name.is_some()) {
                return self.error("an argument with a name, as the one before has");
            } else {
                None
            };
            if name.is_some() && arguments.iter().any(|argument| argument.name == name) {
                return self.error("each argument only once before");
            }
            arguments.push(Argument { name, value: self.expression()? });
            if !self.is_sign(")") {
                self.expect_sign(",")?;
            }
        }
        Ok(Call { name, arguments })
    }
}
