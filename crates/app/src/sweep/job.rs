//! One job of a sweep: its parameters, in order, and the id that follows from them.

use std::fmt;

use serde::Serialize;
use serde_json::{Map, Value as Json};

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A finite number.
    Number(f64),
    /// Anything else, quantities with units too: "130 MPa".
    Text(String),
}

impl Value {
    /// A number where the whole text is one, otherwise the text, without spaces around it.
    pub(super) fn of_text(text: &str) -> Self {
        let text = text.trim();
        // Words such as "inf" and "nan" are parsed by Rust; here they are words.
        let digits = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
            && text.contains(|c: char| c.is_ascii_digit());
        match text.parse::<f64>() {
            Ok(number) if digits && number.is_finite() => Value::Number(number),
            _ => Value::Text(text.into()),
        }
    }

    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        if let Value::Number(number) = self { Some(*number) } else { None }
    }

    /// The text, if it is one.
    pub fn text(&self) -> Option<&str> {
        if let Value::Text(text) = self { Some(text) } else { None }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Text(text) => f.write_str(text),
            Value::Number(x) if *x == 0.0 || (1e-5..1e15).contains(&x.abs()) => write!(f, "{x}"),
            Value::Number(x) => write!(f, "{x:e}"),
        }
    }
}

/// One job of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// 16 hexadecimal digits that depend on the parameters alone, not on their order, the title or the file.
    pub id: String,
    /// What to call the job: the table's title, or the parameters that vary.
    pub title: String,
    /// Name and value of every parameter, in the table's order.
    pub parameters: Vec<(String, Value)>,
    /// Where it stands in its file, for messages: "line 7".
    pub place: String,
}

impl Job {
    pub(super) fn new(title: String, parameters: Vec<(String, Value)>, place: String) -> Self {
        Job { id: id(&parameters), title, parameters, place }
    }

    /// The value of a parameter; `None` where the table does not give it.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.parameters.iter().find(|(own, _)| own == name).map(|(_, value)| value)
    }

    /// The parameters as a JSON object.
    pub fn json(&self) -> Json {
        let entry = |(name, value): &(String, Value)| {
            let value = match value {
                Value::Number(x) => Json::from(*x),
                Value::Text(text) => Json::from(text.as_str()),
            };
            (name.clone(), value)
        };
        Json::Object(self.parameters.iter().map(entry).collect::<Map<_, _>>())
    }
}

/// Hash (FNV-1a, 64 bits) of names and values sorted by name.
fn id(parameters: &[(String, Value)]) -> String {
    let mut sorted: Vec<&(String, Value)> = parameters.iter().collect();
    sorted.sort_by(|a, b| a.0.cmp(&b.0));
    let mut hash = Hash::new();
    for (name, value) in sorted {
        hash.add(name.as_bytes());
        match value {
            // −0 is 0.
            Value::Number(x) => hash.add(&[b"n".as_slice(), &(x + 0.0).to_bits().to_be_bytes()].concat()),
            Value::Text(text) => hash.add(&[b"t", text.as_bytes()].concat()),
        }
    }
    hash.digits()
}

/// FNV-1a over pieces, each with its length, so that pieces cannot run into each other.
pub(super) struct Hash(u64);

impl Hash {
    pub(super) fn new() -> Self {
        Hash(0xcbf2_9ce4_8422_2325)
    }

    pub(super) fn add(&mut self, bytes: &[u8]) {
        for &byte in (bytes.len() as u64).to_be_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub(super) fn digits(&self) -> String {
        format!("{:016x}", self.0)
    }
}
