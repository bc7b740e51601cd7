//! The scene file as a tree of values that remember where they were written, so that every later mistake can be
//! shown in its place.

use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml::value::Datetime;

use super::arrays::Data;

/// Where a key or value was written.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// Byte range of the scene file.
    File(Range<usize>),
    /// Index of the `--set` override.
    Set(usize),
    /// Nowhere: the file as a whole, or a table that exists only because its members do.
    Whole,
}

/// A value and its place.
#[derive(Debug, Clone)]
pub struct Node {
    pub value: Value,
    pub origin: Origin,
}

/// A TOML value. Whole numbers that do not fit i64 become floats; nothing in a scene is that large a count.
#[derive(Debug, Clone)]
pub enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Datetime(Datetime),
    Array(Vec<Node>),
    Table(Vec<Entry>),
    /// What no file can hold: numbers in memory, where a file would be named.
    Data(Arc<Data>),
}

/// One key of a table, in the order of the file.
#[derive(Debug, Clone)]
pub struct Entry {
    pub key: String,
    /// Where the key stands: the place to point at when the table behind it lacks something.
    pub key_origin: Origin,
    pub node: Node,
}

impl Value {
    /// A date or time as TOML spells it.
    pub fn datetime(text: &str) -> Option<Value> {
        text.parse().ok().map(Value::Datetime)
    }

    /// What the value is, as a phrase for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::String(_) => "a string",
            Value::Integer(_) => "a whole number",
            Value::Float(_) => "a number",
            Value::Boolean(_) => "a boolean",
            Value::Datetime(_) => "a date",
            Value::Array(_) => "an array",
            Value::Table(_) => "a table",
            Value::Data(_) => "an array of numbers in memory",
        }
    }
}

/// A syntax error: byte range, where known, and message.
pub type SyntaxError = (Option<Range<usize>>, String);

/// The tree of a whole TOML document, or all its syntax errors.
pub fn parse_document(text: &str) -> Result<Vec<Entry>, Vec<SyntaxError>> {
    let (table, errors) = DeTable::parse_recoverable(text);
    syntax(errors)?;
    Ok(convert_table(table.get_ref(), &|span| Origin::File(span)))
}

/// The value that `text`, given to override `set`, spells in TOML.
pub fn parse_value(text: &str, set: usize) -> Result<Node, Vec<SyntaxError>> {
    let (value, errors) = DeValue::parse_recoverable(text);
    syntax(errors)?;
    Ok(convert(&value, &|_| Origin::Set(set)))
}

fn syntax(errors: Vec<toml::de::Error>) -> Result<(), Vec<SyntaxError>> {
    if errors.is_empty() {
        return Ok(());
    }
    Err(errors.iter().map(|e| (e.span(), e.message().replace('\n', ", "))).collect())
}

type MakeOrigin<'a> = &'a dyn Fn(Range<usize>) -> Origin;

fn convert_table(table: &DeTable<'_>, origin: MakeOrigin) -> Vec<Entry> {
    let mut keys: Vec<_> = table.iter().collect();
    // The parser sorts by name; the file's order is what a reader expects of messages and of resolved scenes.
    keys.sort_by_key(|(key, _)| key.span().start);
    keys.into_iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            key_origin: origin(key.span()),
            node: convert(value, origin),
        })
        .collect()
}

fn convert(value: &Spanned<DeValue<'_>>, origin: MakeOrigin) -> Node {
    let converted = match value.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(whole) => Value::Integer(whole),
            Err(_) => Value::Float(
                u128::from_str_radix(i.as_str(), i.radix())
                    .map_or_else(|_| i.as_str().parse().unwrap_or(f64::INFINITY), |whole| whole as f64),
            ),
        },
        DeValue::Float(f) => Value::Float(f.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Datetime(date) => Value::Datetime(*date),
        DeValue::Array(items) => Value::Array(items.iter().map(|item| convert(item, origin)).collect()),
        DeValue::Table(table) => Value::Table(convert_table(table, origin)),
    };
    Node { value: converted, origin: origin(value.span()) }
}
