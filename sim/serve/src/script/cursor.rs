//! The place in a program's text that is being read.

use super::lexer::{Lexeme, SyntaxError, Token};

const KEYWORDS: [&str; 24] = [
    "def",
    "sec",
    "thread",
    "end",
    "if",
    "elif",
    "else",
    "while",
    "return",
    "break",
    "continue",
    "pass",
    "halt",
    "local",
    "global",
    "kill",
    "join",
    "run",
    "enter_critical",
    "exit_critical",
    "and",
    "or",
    "xor",
    "not",
];

pub(crate) struct Cursor {
    lexemes: Vec<Lexeme>,
    at: usize,
    /// How many expressions are open around this place.
    pub levels: usize,
    /// How many blocks are open around this place.
    pub blocks: usize,
    /// How many loops of the same function are open around this place.
    pub loops: usize,
}

impl Cursor {
    pub(crate) fn new(lexemes: Vec<Lexeme>) -> Self {
        Self { lexemes, at: 0, levels: 0, blocks: 0, loops: 0 }
    }

    pub(crate) fn token(&self) -> &Token {
        self.lexemes.get(self.at).map_or(&Token::End, |lexeme| &lexeme.token)
    }

    pub(crate) fn line(&self) -> usize {
        self.lexemes.get(self.at).or(self.lexemes.last()).map_or(1, |lexeme| lexeme.line)
    }

    pub(crate) fn advance(&mut self) {
        self.at = self.at.saturating_add(1);
    }

    pub(crate) fn error<T>(&self, expected: &str) -> Result<T, SyntaxError> {
        Err(SyntaxError { line: self.line(), expected: expected.to_owned(), found: self.token().describe() })
    }

    pub(crate) fn is_sign(&self, sign: &str) -> bool {
        matches!(self.token(), Token::Sign(found) if *found == sign)
    }

    pub(crate) fn is_word(&self, word: &str) -> bool {
        matches!(self.token(), Token::Name(found) if found == word)
    }

    /// Whether the sign comes after the present token.
    pub(crate) fn is_sign_next(&self, sign: &str) -> bool {
        let next = self.lexemes.get(self.at.saturating_add(1)).map(|lexeme| &lexeme.token);
        matches!(next, Some(Token::Sign(found)) if *found == sign)
    }

    pub(crate) fn accept_sign(&mut self, sign: &str) -> bool {
        let found = self.is_sign(sign);
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn accept_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn expect_sign(&mut self, sign: &str) -> Result<(), SyntaxError> {
        if self.accept_sign(sign) { Ok(()) } else { self.error(&format!("`{sign}`")) }
    }

    pub(crate) fn expect_word(&mut self, word: &str) -> Result<(), SyntaxError> {
        if self.accept_word(word) { Ok(()) } else { self.error(&format!("`{word}`")) }
    }

    /// A name that the language has not taken for itself.
    pub(crate) fn expect_name(&mut self) -> Result<String, SyntaxError> {
        let name = match self.token() {
            Token::Name(name) if !KEYWORDS.contains(&name.as_str()) => name.clone(),
            _ => return self.error("a name"),
        };
        self.advance();
        Ok(name)
    }

    pub(crate) fn skip_lines(&mut self) {
        while *self.token() == Token::NewLine {
            self.advance();
        }
    }

    pub(crate) fn expect_line_end(&mut self) -> Result<(), SyntaxError> {
        match self.token() {
            Token::NewLine => {
                self.advance();
                Ok(())
            }
            // Controllers take another statement on the same line, and clients in use send some.
            Token::End | Token::Name(_) => Ok(()),
            _ => self.error("the end of the line"),
        }
    }
}
