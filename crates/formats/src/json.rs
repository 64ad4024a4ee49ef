//! JSON of reports. JSON has no NaN and no infinity, and its writers put `null` in their place, which says "not given":
//! here such a number is refused by name.

use std::fmt::Display;

use serde::Serialize;
use serde::ser;
use serde_json::Value;

use anisobond::{Error, Result};

/// A report as the text of a JSON document, with a line's end.
///
/// # Errors
/// A number that is not finite, by its place in the report.
pub fn json_text(report: &impl Serialize) -> Result<String> {
    refuse_non_finite(report)?;
    serde_json::to_string_pretty(report).map(|text| text + "\n").map_err(unwritable)
}

/// A report as the bytes of a JSON file.
///
/// # Errors
/// As [`json_text`].
pub fn json_file(report: &impl Serialize) -> Result<Vec<u8>> {
    json_text(report).map(String::into_bytes)
}

/// A report as a JSON value.
///
/// # Errors
/// As [`json_text`].
pub fn json_value(report: &impl Serialize) -> Result<Value> {
    refuse_non_finite(report)?;
    serde_json::to_value(report).map_err(unwritable)
}

fn unwritable(e: serde_json::Error) -> Error {
    Error::file("write", "a report as JSON", e.into())
}

/// Refuses a report with a number that JSON cannot hold.
///
/// # Errors
/// The first such number, by its place in the report.
pub fn refuse_non_finite(report: &impl Serialize) -> Result<()> {
    match non_finite(report) {
        None => Ok(()),
        Some(place) => Err(Error::input(
            format!("the result has a number that is not finite: {place}"),
            "check the input for numbers at the limits of what can be computed",
        )),
    }
}

/// The place of the first number that is not finite, and that number: "moduli.hill is NaN".
pub fn non_finite(report: &impl Serialize) -> Option<String> {
    report.serialize(&mut Finite::default()).err().map(|found| found.0)
}

/// Walks through a report and writes nothing.
#[derive(Default)]
struct Finite {
    /// Keys and numbers on the way to the present value.
    way: Vec<String>,
    /// Elements of the lists on the way.
    counts: Vec<usize>,
}

/// A number that is not finite.
#[derive(Debug)]
struct Found(String);

impl Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Found {}

impl ser::Error for Found {
    fn custom<T: Display>(message: T) -> Self {
        Found(message.to_string())
    }
}

type Looked = std::result::Result<(), Found>;

impl Finite {
    fn look(&self, x: f64) -> Looked {
        let place = if self.way.is_empty() { "it".into() } else { self.way.join(".") };
        if x.is_finite() { Ok(()) } else { Err(Found(format!("{place} is {x}"))) }
    }

    fn at<T: Serialize + ?Sized>(&mut self, step: impl Into<String>, value: &T) -> Looked {
        self.way.push(step.into());
        let looked = value.serialize(&mut *self);
        if looked.is_ok() {
            self.way.pop();
        }
        looked
    }

    fn element<T: Serialize + ?Sized>(&mut self, value: &T) -> Looked {
        let number = self.counts.last_mut().map_or(0, |count| {
            *count += 1;
            *count - 1
        });
        self.at(number.to_string(), value)
    }

    fn list(&mut self) -> std::result::Result<&mut Self, Found> {
        self.counts.push(0);
        Ok(self)
    }

    fn listed(&mut self) -> Looked {
        self.counts.pop();
        Ok(())
    }
}

/// Values that are finite whatever they are.
macro_rules! passes {
    ($($name:ident: $kind:ty),*) => { $(fn $name(self, _: $kind) -> Looked { Ok(()) })* };
}

impl ser::Serializer for &mut Finite {
    type Ok = ();
    type Error = Found;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    passes!(serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64,
        serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_char: char,
        serialize_str: &str, serialize_bytes: &[u8], serialize_unit_struct: &'static str);

    fn serialize_f32(self, x: f32) -> Looked {
        self.look(f64::from(x))
    }
    fn serialize_f64(self, x: f64) -> Looked {
        self.look(x)
    }
    fn serialize_none(self) -> Looked {
        Ok(())
    }
    fn serialize_unit(self) -> Looked {
        Ok(())
    }
    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Looked {
        Ok(())
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Looked {
        value.serialize(self)
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Looked {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Looked {
        self.at(variant, value)
    }
    fn serialize_seq(self, _: Option<usize>) -> std::result::Result<Self, Found> {
        self.list()
    }
    fn serialize_tuple(self, _: usize) -> std::result::Result<Self, Found> {
        self.list()
    }
    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> std::result::Result<Self, Found> {
        self.list()
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> std::result::Result<Self, Found> {
        self.list()
    }
    fn serialize_map(self, _: Option<usize>) -> std::result::Result<Self, Found> {
        Ok(self)
    }
    fn serialize_struct(self, _: &'static str, _: usize) -> std::result::Result<Self, Found> {
        Ok(self)
    }
    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> std::result::Result<Self, Found> {
        Ok(self)
    }
}

/// Lists of all kinds.
macro_rules! list {
    ($($kind:ident, $add:ident);*) => { $(impl ser::$kind for &mut Finite {
        type Ok = ();
        type Error = Found;
        fn $add<T: Serialize + ?Sized>(&mut self, value: &T) -> Looked {
            self.element(value)
        }
        fn end(self) -> Looked {
            self.listed()
        }
    })* };
}

list!(SerializeSeq, serialize_element; SerializeTuple, serialize_element;
    SerializeTupleStruct, serialize_field; SerializeTupleVariant, serialize_field);

impl ser::SerializeMap for &mut Finite {
    type Ok = ();
    type Error = Found;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Looked {
        let word = serde_json::to_value(key).map_err(ser::Error::custom)?;
        self.way.push(word.as_str().map_or_else(|| word.to_string(), String::from));
        Ok(())
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Looked {
        value.serialize(&mut **self)?;
        self.way.pop();
        Ok(())
    }
    fn end(self) -> Looked {
        Ok(())
    }
}

/// Fields of both kinds.
macro_rules! fields {
    ($($kind:ident),*) => { $(impl ser::$kind for &mut Finite {
        type Ok = ();
        type Error = Found;
        fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Looked {
            self.at(key, value)
        }
        fn end(self) -> Looked {
            Ok(())
        }
    })* };
}

fields!(SerializeStruct, SerializeStructVariant);

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    #[serde(rename_all = "lowercase")]
    enum Kind {
        Plain,
        Of(f64),
    }

    #[derive(Serialize)]
    struct Report {
        name: &'static str,
        kinds: Vec<Kind>,
        #[serde(flatten)]
        inner: Inner,
    }

    #[derive(Serialize)]
    struct Inner {
        rows: [[f64; 2]; 2],
        none: Option<f64>,
        raw: Box<serde_json::value::RawValue>,
    }

    #[test]
    fn numbers_that_json_does_not_have_are_named() {
        let report = |x: f64, y: f64| Report {
            name: "NaN",
            kinds: vec![Kind::Plain, Kind::Of(x)],
            inner: Inner {
                rows: [[1.0, 2.0], [y, 4.0]],
                none: None,
                raw: serde_json::value::to_raw_value(&[1, 2]).unwrap(),
            },
        };
        assert_eq!(non_finite(&report(1.0, f64::MAX)), None);
        assert!(json_text(&report(1.0, 2.0)).unwrap().ends_with("}\n"));
        assert_eq!(non_finite(&report(f64::NAN, 2.0)).unwrap(), "kinds.1.of is NaN");
        assert_eq!(non_finite(&report(1.0, f64::NEG_INFINITY)).unwrap(), "rows.1.0 is -inf");
        assert_eq!(non_finite(&f32::INFINITY).unwrap(), "it is inf");
        assert!(json_value(&report(f64::NAN, 2.0)).unwrap_err().to_string().contains("kinds.1.of is NaN"));
    }
}
