//! Words of a pbrt-v4 scene, and the parameters of a directive.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::error::Problem;
use crate::import::report::{Place, Report};

pub type Read<T> = Result<T, Box<Problem>>;

/// A place in a scene.
#[derive(Debug, Clone)]
pub struct At {
    pub file: Rc<Path>,
    pub line: usize,
}

impl At {
    pub fn problem(&self, message: impl Into<String>) -> Box<Problem> {
        Box::new(Problem {
            file: self.file.to_path_buf(),
            line: Some(self.line),
            message: message.into(),
            ..Problem::default()
        })
    }

    pub fn place(&self) -> Place {
        Place::line(&self.file, self.line)
    }

    /// The file that `name` means here.
    pub fn file(&self, name: &str) -> Read<PathBuf> {
        crate::import::path_beside(&self.file, name).map_err(|message| self.problem(message))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Token {
    /// A directive, a number, `true` or `false`.
    Word(String),
    Text(String),
    Open,
    Close,
}

/// A file, word by word.
pub struct Tokens {
    text: Vec<u8>,
    at: usize,
    line: usize,
    file: Rc<Path>,
    peeked: Option<(Token, At)>,
}

pub fn shown(text: &str) -> String {
    text.chars().take(40).collect::<String>().escape_debug().to_string()
}

impl Tokens {
    pub fn new(text: Vec<u8>, file: &Path) -> Tokens {
        Tokens { text, at: 0, line: 1, file: file.into(), peeked: None }
    }

    fn here(&self) -> At {
        At { file: self.file.clone(), line: self.line }
    }

    pub fn peek(&mut self) -> Read<Option<&(Token, At)>> {
        if self.peeked.is_none() {
            self.peeked = self.read()?;
        }
        Ok(self.peeked.as_ref())
    }

    pub fn next(&mut self) -> Read<Option<(Token, At)>> {
        match self.peeked.take() {
            Some(token) => Ok(Some(token)),
            None => self.read(),
        }
    }

    fn read(&mut self) -> Read<Option<(Token, At)>> {
        loop {
            match self.text.get(self.at) {
                None => return Ok(None),
                Some(b'\n') => (self.line, self.at) = (self.line + 1, self.at + 1),
                Some(byte) if byte.is_ascii_whitespace() => self.at += 1,
                Some(b'#') => {
                    let end = self.text[self.at..].iter().position(|b| *b == b'\n');
                    self.at = end.map_or(self.text.len(), |end| self.at + end);
                }
                Some(_) => break,
            }
        }
        let at = self.here();
        let token = match self.text[self.at] {
            b'[' => (Token::Open, 1),
            b']' => (Token::Close, 1),
            b'"' => {
                let rest = &self.text[self.at + 1..];
                let end = rest.iter().position(|b| matches!(b, b'"' | b'\n'));
                let end = end
                    .filter(|end| rest[*end] == b'"')
                    .ok_or_else(|| at.problem("a text in quotes has no end on its line"))?;
                (Token::Text(String::from_utf8_lossy(&rest[..end]).into_owned()), end + 2)
            }
            _ => {
                let rest = &self.text[self.at..];
                let is_end = |b: &u8| b.is_ascii_whitespace() || matches!(b, b'"' | b'[' | b']' | b'#');
                let end = rest.iter().position(is_end).unwrap_or(rest.len());
                (Token::Word(String::from_utf8_lossy(&rest[..end]).into_owned()), end)
            }
        };
        self.at += token.1;
        Ok(Some((token.0, at)))
    }

    /// The text that must come now.
    pub fn text(&mut self, what: &str, at: &At) -> Read<String> {
        match self.next()? {
            Some((Token::Text(text), _)) => Ok(text),
            Some((_, at)) => Err(at.problem(format!("{what} in quotes is expected here"))),
            None => Err(at.problem(format!("the file ends where {what} is expected"))),
        }
    }

    /// `N` numbers, in brackets or not.
    pub fn numbers<const N: usize>(&mut self, at: &At) -> Read<[f64; N]> {
        let bracket = matches!(self.peek()?, Some((Token::Open, _)));
        if bracket {
            self.next()?;
        }
        let mut numbers = [0.0; N];
        for value in &mut numbers {
            match self.next()? {
                Some((Token::Word(word), at)) => *value = number(&word, &at)?,
                Some((_, at)) => return Err(at.problem(format!("{N} numbers are expected here"))),
                None => return Err(at.problem(format!("the file ends where {N} numbers are expected"))),
            }
        }
        if bracket && !matches!(self.next()?, Some((Token::Close, _))) {
            return Err(at.problem(format!("has more than {N} numbers, or no `]`")));
        }
        Ok(numbers)
    }

    /// All `"type name" values` that follow.
    pub fn parameters(&mut self) -> Read<Parameters> {
        let mut all = Vec::new();
        while let Some((Token::Text(_), _)) = self.peek()? {
            let Some((Token::Text(declared), at)) = self.next()? else { break };
            let mut words = declared.split_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return Err(at.problem(format!("a parameter is `\"type name\"`, not `\"{}\"`", shown(&declared))));
            };
            let mut values = Vec::new();
            match self.next()? {
                Some((Token::Open, _)) => loop {
                    match self.next()? {
                        Some((Token::Close, _)) => break,
                        Some((token @ (Token::Word(_) | Token::Text(_)), _)) => values.push(token),
                        Some((_, at)) => return Err(at.problem("`[` within `[`")),
                        None => return Err(at.problem(format!("the values of `{}` have no `]`", shown(name)))),
                    }
                },
                Some((token @ (Token::Word(_) | Token::Text(_)), _)) => values.push(token),
                _ => return Err(at.problem(format!("`{}` has no value", shown(name)))),
            }
            let (numbers, texts) = match values.first() {
                Some(Token::Text(_)) => (Vec::new(), texts(values, &at)?),
                _ if kind == "bool" => (Vec::new(), words_of(values)),
                _ => (numbers_of(&values, &at)?, Vec::new()),
            };
            all.push(Parameter {
                kind: kind.to_owned(),
                name: name.to_owned(),
                numbers,
                texts,
                at,
                asked: Cell::new(false),
            });
        }
        Ok(Parameters(all))
    }
}

fn texts(values: Vec<Token>, at: &At) -> Read<Vec<String>> {
    let text = |token| match token {
        Token::Text(text) => Ok(text),
        _ => Err(at.problem("has texts and numbers in one list")),
    };
    values.into_iter().map(text).collect()
}

fn words_of(values: Vec<Token>) -> Vec<String> {
    values.into_iter().filter_map(|token| if let Token::Word(word) = token { Some(word) } else { None }).collect()
}

fn numbers_of(values: &[Token], at: &At) -> Read<Vec<f64>> {
    let of = |token: &Token| match token {
        Token::Word(word) => number(word, at),
        _ => Err(at.problem("has texts and numbers in one list")),
    };
    values.iter().map(of).collect()
}

fn number(word: &str, at: &At) -> Read<f64> {
    let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
    number.ok_or_else(|| at.problem(format!("`{}` is not a finite number", shown(word))))
}

#[derive(Debug, Clone)]
pub struct Parameter {
    pub kind: String,
    pub name: String,
    pub numbers: Vec<f64>,
    pub texts: Vec<String>,
    pub at: At,
    asked: Cell<bool>,
}

/// Of one directive.
#[derive(Debug, Clone, Default)]
pub struct Parameters(pub Vec<Parameter>);

impl Parameters {
    pub fn get(&self, name: &str) -> Option<&Parameter> {
        // The last one counts.
        let found = self.0.iter().rev().find(|parameter| parameter.name == name)?;
        found.asked.set(true);
        Some(found)
    }

    pub fn number(&self, name: &str) -> Read<Option<f64>> {
        let Some(found) = self.get(name) else { return Ok(None) };
        match found.numbers[..] {
            [number] => Ok(Some(number)),
            _ => Err(found.at.problem(format!("`{name}` must be one number"))),
        }
    }

    pub fn text(&self, name: &str) -> Read<Option<&str>> {
        let Some(found) = self.get(name) else { return Ok(None) };
        match &found.texts[..] {
            [text] => Ok(Some(text)),
            _ => Err(found.at.problem(format!("`{name}` must be one text"))),
        }
    }

    pub fn boolean(&self, name: &str, default: bool) -> Read<bool> {
        let Some(found) = self.get(name) else { return Ok(default) };
        match found.texts.first().map(String::as_str) {
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            _ => Err(found.at.problem(format!("`{name}` must be true or false"))),
        }
    }

    pub fn vector(&self, name: &str) -> Read<Option<glam::DVec3>> {
        let Some(found) = self.get(name) else { return Ok(None) };
        match found.numbers[..] {
            [x, y, z] => Ok(Some(glam::DVec3::new(x, y, z))),
            _ => Err(found.at.problem(format!("`{name}` must be three numbers"))),
        }
    }

    /// With what others state, where these do not (`Attribute`).
    pub fn over(mut self, defaults: &Parameters) -> Parameters {
        for default in &defaults.0 {
            if !self.0.iter().any(|own| own.name == default.name) {
                self.0.push(default.clone());
            }
        }
        self
    }

    /// What they say has been said of the directive as a whole.
    pub fn ask_for_all(&self) {
        self.0.iter().for_each(|parameter| parameter.asked.set(true));
    }

    /// Tells what nobody asked for.
    pub fn finish(&self, of: &str, report: &mut Report) {
        for parameter in self.0.iter().filter(|parameter| !parameter.asked.get()) {
            report.left_out(parameter.at.place(), format!("`{}` of {of}", shown(&parameter.name)));
        }
    }
}
