//! Sentences that name options of the work, which each way in spells in its own way.

use std::fmt;

/// An option of the work by its name: `resume`, or `row` with a value.
///
/// A program spells it as it is given there (`--resume`, `resume=True`); a library only names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Its name.
    pub name: &'static str,
    /// What to give; empty where it is only chosen.
    pub value: String,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value.as_str() {
            "" => write!(f, "\"{}\"", self.name),
            value => write!(f, "{} = \"{value}\"", self.name),
        }
    }
}

/// Words, and options between them.
///
/// ```
/// use anisobond::Wording;
/// let remedy = Wording::from("go on with ").choice("resume", "").words(", or give another folder");
/// assert_eq!(remedy.to_string(), "go on with \"resume\", or give another folder");
/// assert_eq!(remedy.spelled(&|choice| format!("--{}", choice.name)), "go on with --resume, or give another folder");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wording(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Words(String),
    Choice(Choice),
}

impl Wording {
    /// More words.
    pub fn words(mut self, words: impl Into<String>) -> Self {
        self.0.push(Piece::Words(words.into()));
        self
    }

    /// An option, with what to give for it, or nothing where it is only chosen.
    pub fn choice(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.0.push(Piece::Choice(Choice { name, value: value.into() }));
        self
    }

    /// Whether the option of that name is in it.
    pub fn names(&self, name: &str) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Choice(choice) if choice.name == name))
    }

    /// The sentence, its options as they are spelled somewhere.
    pub fn spelled(&self, spell: &dyn Fn(&Choice) -> String) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Words(words) => words.clone(),
            Piece::Choice(choice) => spell(choice),
        };
        self.0.iter().map(piece).collect()
    }
}

impl fmt::Display for Wording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(&Choice::to_string))
    }
}

impl From<&str> for Wording {
    fn from(words: &str) -> Self {
        Wording::default().words(words)
    }
}

impl From<String> for Wording {
    fn from(words: String) -> Self {
        Wording::default().words(words)
    }
}
