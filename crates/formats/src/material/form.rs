//! Which of the ways to give a stiffness a file takes.

use super::components;
use crate::tree::{Entry, Node, place};
use anisobond::{Error, Result};

/// The ways to give a stiffness, for messages.
const FORMS: &str = "stiffness (a 6×6 matrix), compliance, c11 … c66, or a table [engineering]";

/// The form a file gives its stiffness in, and the entry that says so.
pub(crate) enum Form<'n> {
    Stiffness(&'n Entry),
    Compliance(&'n Entry),
    Engineering(&'n Entry),
    /// The first component.
    Components(&'n Entry),
}

impl<'n> Form<'n> {
    fn of(entry: &'n Entry) -> Option<Self> {
        match entry.key.as_str() {
            "stiffness" => Some(Form::Stiffness(entry)),
            "compliance" => Some(Form::Compliance(entry)),
            "engineering" => Some(Form::Engineering(entry)),
            key => components::component_of(key).map(|_| Form::Components(entry)),
        }
    }

    pub(super) fn entry(&self) -> &'n Entry {
        match self {
            Form::Stiffness(e) | Form::Compliance(e) | Form::Engineering(e) | Form::Components(e) => e,
        }
    }

    /// The one form of a table; `first` is one that it has under another name.
    pub(crate) fn only(table: &'n Node, first: Option<Self>) -> Result<Self> {
        let mut found = first;
        for form in table.entries().iter().filter_map(Form::of) {
            match &found {
                None => found = Some(form),
                Some(Form::Components(_)) if matches!(form, Form::Components(_)) => {}
                Some(first) => {
                    let (first, second) = (first.entry(), form.entry());
                    return Err(Error::input(
                        format!("{} and {} both give the stiffness", first.key, second.key),
                        "keep one of them",
                    )
                    .at(place(second.line, &second.key)));
                }
            }
        }
        found.ok_or_else(|| {
            Error::input("no stiffness is given", format!("add {FORMS}")).at(format!("line {}", table.line))
        })
    }
}
