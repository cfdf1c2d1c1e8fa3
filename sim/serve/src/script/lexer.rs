//! The text of a program, cut into words, numbers and signs.

/// The longest text of a program, in bytes.
pub const MAX_TEXT: usize = 1 << 20;

/// Why a text is not a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: expected {expected}, found {found}")]
pub struct SyntaxError {
    /// The line, counted from one.
    pub line: usize,
    /// What could have stood there.
    pub expected: String,
    /// What stood there instead.
    pub found: String,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Token {
    Name(String),
    Integer(i64),
    Float(f64),
    Text(String),
    Sign(&'static str),
    NewLine,
    End,
}

impl Token {
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Name(name) => format!("`{name}`"),
            Self::Integer(number) => number.to_string(),
            Self::Float(number) => number.to_string(),
            Self::Text(_) => "a text".to_owned(),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::NewLine => "the end of the line".to_owned(),
            Self::End => "the end of the program".to_owned(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lexeme {
    pub token: Token,
    pub line: usize,
}

// Longer signs first: `==` would otherwise be read as two `=`.
const SIGNS: [&str; 18] = ["==", "!=", "<=", ">=", "+", "-", "*", "/", "%", "(", ")", "[", "]", ",", ":", "=", "<", ">"];

struct Lexer<'a> {
    rest: &'a str,
    line: usize,
    open: usize,
}

/// Cuts a text into lexemes; the last one is always the end.
pub(crate) fn lex(text: &str) -> Result<Vec<Lexeme>, SyntaxError> {
    let mut lexer = Lexer { rest: text.trim_start_matches('\u{feff}'), line: 1, open: 0 };
    if text.len() > MAX_TEXT {
        return Err(lexer.error(&format!("a program of at most {MAX_TEXT} bytes"), format!("{} bytes", text.len())));
    }
    let mut lexemes = Vec::new();
    loop {
        let line = lexer.line;
        let Some(token) = lexer.next()? else { continue };
        let last = token == Token::End;
        lexemes.push(Lexeme { token, line });
        if last {
            return Ok(lexemes);
        }
    }
}

impl<'a> Lexer<'a> {
    fn error(&self, expected: &str, found: String) -> SyntaxError {
        SyntaxError { line: self.line, expected: expected.to_owned(), found }
    }

    fn take(&mut self, length: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at_checked(length).unwrap_or((self.rest, ""));
        self.rest = rest;
        taken
    }

    fn take_while(&mut self, wanted: impl Fn(char) -> bool) -> &'a str {
        self.take(self.rest.find(|c| !wanted(c)).unwrap_or(self.rest.len()))
    }

    /// The next token; none after space, comments and line ends inside brackets.
    fn next(&mut self) -> Result<Option<Token>, SyntaxError> {
        let Some(first) = self.rest.chars().next() else { return Ok(Some(Token::End)) };
        match first {
            '\n' => {
                self.take(1);
                self.line = self.line.saturating_add(1);
                Ok((self.open == 0).then_some(Token::NewLine))
            }
            '#' => {
                self.take_while(|c| c != '\n');
                Ok(None)
            }
            c if c.is_whitespace() => {
                self.take_while(|c| c.is_whitespace() && c != '\n');
                Ok(None)
            }
            c if c.is_ascii_alphabetic() || c == '_' => {
                Ok(Some(Token::Name(self.take_while(|c| c.is_ascii_alphanumeric() || c == '_').to_owned())))
            }
            '"' | '\'' => self.text(first).map(Some),
            c if c.is_ascii_digit() || c == '.' => self.number().map(Some),
            _ => self.sign(first).map(Some),
        }
    }

    fn text(&mut self, quote: char) -> Result<Token, SyntaxError> {
        self.take(1);
        let text = self.take_while(|c| c != quote && c != '\n');
        if self.rest.starts_with(quote) {
            self.take(1);
            return Ok(Token::Text(text.to_owned()));
        }
        Err(self.error(&format!("the closing {quote} of a text"), "the end of the line".to_owned()))
    }

    fn number(&mut self) -> Result<Token, SyntaxError> {
        let start = self.rest;
        let hexadecimal = start.get(..2).is_some_and(|prefix| prefix.eq_ignore_ascii_case("0x"));
        if hexadecimal {
            self.take(2);
            let digits = self.take_while(|c| c.is_ascii_hexdigit());
            let number = i64::from_str_radix(digits, 16);
            return number.map(Token::Integer).map_err(|_| self.error("a number", format!("`0x{digits}`")));
        }
        self.take_while(|c| c.is_ascii_digit());
        let mut whole = true;
        if self.rest.starts_with('.') {
            whole = false;
            self.take(1);
            self.take_while(|c| c.is_ascii_digit());
        }
        if let Some(exponent) = self.rest.strip_prefix(['e', 'E']) {
            let digits = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
            if digits.starts_with(|c: char| c.is_ascii_digit()) {
                whole = false;
                self.rest = digits;
                self.take_while(|c| c.is_ascii_digit());
            }
        }
        let length = start.len().saturating_sub(self.rest.len());
        let digits = start.get(..length).unwrap_or(start);
        let token = if whole { digits.parse().ok().map(Token::Integer) } else { None };
        let fractional = || digits.parse().ok().filter(|number: &f64| !whole && number.is_finite()).map(Token::Float);
        token.or_else(fractional).ok_or_else(|| self.error("a number that can be represented", format!("`{digits}`")))
    }

    fn sign(&mut self, first: char) -> Result<Token, SyntaxError> {
        let found = SIGNS.into_iter().find(|sign| self.rest.starts_with(sign));
        let Some(sign) = found else {
            return Err(self.error("a character of the language", format!("`{}`", first.escape_default())));
        };
        self.take(sign.len());
        match sign {
            "(" | "[" => self.open = self.open.saturating_add(1),
            ")" | "]" => self.open = self.open.saturating_sub(1),
            _ => {}
        }
        Ok(Token::Sign(sign))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Vec<Token> {
        lex(text).map(|lexemes| lexemes.into_iter().map(|lexeme| lexeme.token).collect()).unwrap_or_default()
    }

    #[test]
    fn numbers_keep_their_kind() {
        let expected =
            [Token::Integer(12), Token::Float(1e-3), Token::Float(0.5), Token::Integer(31), Token::Float(2.0), Token::End];
        assert_eq!(tokens("12 1e-3 .5 0x1F 2."), expected);
        assert!(lex("99999999999999999999").is_err());
        assert!(lex("1e999").is_err());
        assert!(lex(".").is_err());
        assert!(lex("0x").is_err());
    }

    #[test]
    fn lines_end_outside_brackets_only() {
        assert_eq!(tokens("[\r\n 1 # one\n]\n").len(), 5);
        assert_eq!(lex("a\n\"b").map_err(|error| error.line), Err(2));
        assert!(lex("$5.4 x").is_err());
        assert!(lex("\u{e9}").is_err());
    }

    #[test]
    fn long_texts_are_refused() {
        assert!(lex(&" ".repeat(MAX_TEXT + 1)).is_err());
    }
}
