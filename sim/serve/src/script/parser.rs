//! Reads programs.

use std::rc::Rc;

use super::cursor::Cursor;
use super::lexer::{SyntaxError, Token, lex};
use super::tree::{Action, Assignment, Branch, Choice, Definition, Expression, Kind, Parameter, Program, Reach, Statement};

/// How deep blocks may be nested.
const MAX_BLOCKS: usize = 50;

/// Reads the text of a program: one `def name():` ... `end` or `sec name():` ... `end`, or bare statements.
pub fn parse(text: &str) -> Result<Program, SyntaxError> {
    let mut cursor = Cursor::new(lex(text)?);
    cursor.skip_lines();
    let secondary = cursor.is_word("sec");
    let mut body = cursor.block(&[])?;
    if *cursor.token() != Token::End {
        return cursor.error("the end of the program");
    }
    if body.len() == 1
        && let Some(Statement { action: Action::Define(definition), .. }) = body.first()
        && !definition.thread
    {
        return Ok(Program { main: Rc::clone(definition), secondary });
    }
    if body.is_empty() {
        return cursor.error("a statement");
    }
    body.shrink_to_fit();
    let main = Definition { name: String::new(), thread: false, parameters: Vec::new(), body };
    Ok(Program { main: Rc::new(main), secondary: false })
}

impl Cursor {
    /// The statements up to one of these words, or up to the end of the program.
    fn block(&mut self, ends: &[&str]) -> Result<Vec<Statement>, SyntaxError> {
        self.blocks = self.blocks.saturating_add(1);
        if self.blocks > MAX_BLOCKS {
            return self.error(&format!("at most {MAX_BLOCKS} blocks inside one another"));
        }
        let mut statements = Vec::new();
        loop {
            self.skip_lines();
            if *self.token() == Token::End || ends.iter().any(|end| self.is_word(end)) {
                break;
            }
            let line = self.line();
            let action = self.action()?;
            self.expect_line_end()?;
            statements.push(Statement { line, action });
        }
        self.blocks = self.blocks.saturating_sub(1);
        Ok(statements)
    }

    fn action(&mut self) -> Result<Action, SyntaxError> {
        let word = match self.token() {
            Token::Name(name) => name.clone(),
            _ => return self.value_or_assignment(Reach::Nearest),
        };
        match word.as_str() {
            "def" | "sec" | "thread" => return self.definition(),
            "if" => return self.choice(),
            "while" => return self.repetition(),
            "run" => return Ok(Action::Evaluate(self.expression()?)),
            "local" | "global" | "return" | "break" | "continue" | "pass" | "halt" | "kill" | "join" => {}
            "enter_critical" | "exit_critical" => {}
            _ => return self.value_or_assignment(Reach::Nearest),
        }
        if matches!(word.as_str(), "break" | "continue") && self.loops == 0 {
            return self.error("a statement outside of a loop");
        }
        self.advance();
        match word.as_str() {
            "local" => self.value_or_assignment(Reach::Local),
            "global" => self.value_or_assignment(Reach::Global),
            "return" if matches!(self.token(), Token::NewLine | Token::End) => Ok(Action::Return(None)),
            "return" => Ok(Action::Return(Some(self.expression()?))),
            "break" => Ok(Action::Break),
            "continue" => Ok(Action::Continue),
            "halt" => Ok(Action::Halt),
            "kill" => Ok(Action::Kill(self.expression()?)),
            "join" => Ok(Action::Join(self.expression()?)),
            // Threads take turns only where they wait: nothing has to be locked.
            _ => Ok(Action::Nothing),
        }
    }

    fn value_or_assignment(&mut self, reach: Reach) -> Result<Action, SyntaxError> {
        let target = self.expression()?;
        if reach == Reach::Nearest && !self.is_sign("=") {
            return Ok(Action::Evaluate(target));
        }
        let mut indices = Vec::new();
        let mut place = target;
        let name = loop {
            match place.kind {
                Kind::Name(name) => break name,
                Kind::Index(pair) => {
                    indices.push(*pair.right);
                    place = *pair.left;
                }
                _ => return self.error("a variable before"),
            }
        };
        indices.reverse();
        self.expect_sign("=")?;
        Ok(Action::Assign(Assignment { reach, name, indices, value: self.expression()? }))
    }

    fn choice(&mut self) -> Result<Action, SyntaxError> {
        let mut branches = Vec::new();
        while self.accept_word(if branches.is_empty() { "if" } else { "elif" }) {
            let condition = self.condition()?;
            branches.push(Branch { condition, body: self.block(&["elif", "else", "end"])? });
        }
        let mut otherwise = Vec::new();
        if self.accept_word("else") {
            self.expect_sign(":")?;
            otherwise = self.block(&["end"])?;
        }
        self.expect_word("end")?;
        Ok(Action::If(Choice { branches, otherwise }))
    }

    fn repetition(&mut self) -> Result<Action, SyntaxError> {
        self.advance();
        let condition = self.condition()?;
        self.loops = self.loops.saturating_add(1);
        let body = self.block(&["end"])?;
        self.loops = self.loops.saturating_sub(1);
        self.expect_word("end")?;
        Ok(Action::While(Branch { condition, body }))
    }

    fn condition(&mut self) -> Result<Expression, SyntaxError> {
        let condition = self.expression()?;
        self.expect_sign(":")?;
        Ok(condition)
    }

    fn definition(&mut self) -> Result<Action, SyntaxError> {
        let thread = self.is_word("thread");
        self.advance();
        let name = self.expect_name()?;
        let parameters = self.parameters()?;
        self.expect_sign(":")?;
        // A loop around a definition is none of the function's.
        let around = std::mem::take(&mut self.loops);
        let body = self.block(&["end"])?;
        self.loops = around;
        self.expect_word("end")?;
        Ok(Action::Define(Rc::new(Definition { name, thread, parameters, body })))
    }

    fn parameters(&mut self) -> Result<Vec<Parameter>, SyntaxError> {
        self.expect_sign("(")?;
        let mut parameters: Vec<Parameter> = Vec::new();
        while !self.accept_sign(")") {
            let name = self.expect_name()?;
            if parameters.iter().any(|parameter| parameter.name == name) {
                return self.error("each parameter only once before");
            }
            let default = if self.accept_sign("=") { Some(self.expression()?) } else { None };
            parameters.push(Parameter { name, default });
            if !self.is_sign(")") {
                self.expect_sign(",")?;
            }
        }
        Ok(parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line_of(text: &str) -> Option<usize> {
        parse(text).err().map(|error| error.line)
    }

    #[test]
    fn programs_have_names() {
        let program = parse("\n# a comment\ndef work():\r\n  pass\r\nend # done\n\n").unwrap();
        assert_eq!((program.name(), program.is_secondary()), ("work", false));
        assert!(parse("sec light():\n x()\nend").unwrap().is_secondary());
        assert_eq!(parse("movej([0,\n 1], a=1)").unwrap().name(), "");
    }

    #[test]
    fn errors_name_the_line_and_the_want() {
        let error = parse("def f():\n x = = 3\nend").err().unwrap();
        assert_eq!(error.to_string(), "line 2: expected a value, found `=`");
        let error = parse("def f():\n if True:\n  x = 1\n end\n").err().unwrap();
        assert_eq!(error.to_string(), "line 5: expected `end`, found the end of the program");
        assert_eq!(line_of("x = 1\nend"), Some(2));
        assert_eq!(line_of("x = 1 2"), Some(1));
        assert_eq!(line_of("\nbreak"), Some(2));
        assert_eq!(line_of("while True:\n def f():\n  break\n end\nend"), Some(3));
        assert_eq!(line_of("f(a=1, 2)"), Some(1));
        assert_eq!(line_of("f(a=1, a=2)"), Some(1));
        assert_eq!(line_of("p[1, 2]"), Some(1));
        assert_eq!(line_of("f() = 3"), Some(1));
        assert_eq!(line_of("local x"), Some(1));
        assert_eq!(line_of("if x\nend"), Some(1));
        assert_eq!(line_of("def if():\nend"), Some(1));
        assert_eq!(line_of(""), Some(1));
    }

    #[test]
    fn deep_nesting_is_refused() {
        assert!(parse(&"(".repeat(10_000)).is_err());
        assert!(parse(&"[".repeat(10_000)).is_err());
        assert!(parse(&"f(".repeat(10_000)).is_err());
        assert!(parse(&format!("x = {}1", "-".repeat(10_000))).is_err());
        assert!(parse(&format!("x = {}True", "not ".repeat(10_000))).is_err());
        assert!(parse(&format!("x = 1{}", "+1".repeat(10_000))).is_err());
        assert!(parse(&format!("x = y{}", "[0]".repeat(10_000))).is_err());
        assert!(parse(&"if True:\n".repeat(10_000)).is_err());
        assert!(parse(&"def f():\n".repeat(10_000)).is_err());
        assert!(parse(&format!("{}{}", "while True:\n".repeat(10_000), "end\n".repeat(10_000))).is_err());
        assert!(parse(&format!("x = {}1{}", "(".repeat(60), ")".repeat(60))).is_ok());
        assert!(parse(&format!("x = 1{}", "+1".repeat(90))).is_ok());
    }

    #[test]
    fn long_chains_of_branches_are_not_nested() {
        let text = format!("if x == 0:\n{}else:\nend", "elif x == 1:\n y = 2\n".repeat(1000));
        assert!(parse(&text).is_ok());
    }
}
