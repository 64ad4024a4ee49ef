//! What the form asks, as the flags of `anisobond calibrate`, and the answer.

use std::time::Instant;

use anisobond::tensor::{Material, SYMMETRY_TOLERANCE};
use anisobond::{Error, Result};
use anisobond_app::{calibrated_case, calibration_page, calibration_page_data};
use anisobond_formats::{BondModuli, builtin_material, material_text, parse_any, parse_class};
use clap::Parser;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::args;
use crate::calibrate::{Calibrated, shape_and_horizon};
use crate::text::in_shell;

/// More bonds than this take too long between two keys.
const MOST_BONDS: f64 = 150_000.0;

/// Flags that the form may set, with the values that need not be said.
const FLAGS: [(&str, &str); 10] = [
    ("model", "central"),
    ("form", ""),
    ("promise", "sum"),
    ("lower-bound", "0"),
    ("metric", "norm"),
    ("shape", "sphere"),
    ("semi-axes", ""),
    ("horizon", ""),
    ("spacing", ""),
    ("influence", "inverse"),
];

/// What the form holds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    material: MaterialText,
    /// A class whose closest tensor is taken instead; empty for none.
    #[serde(default)]
    class: String,
    flags: Map<String, Value>,
    #[serde(default)]
    rotate: Vec<String>,
}

/// A built-in name, or the text of a material file or of another program.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum MaterialText {
    Name(String),
    Text(String),
}

/// A calibration with what belongs to it.
pub struct Answer {
    pub done: Calibrated,
    /// The material as a file.
    pub material: String,
    /// A case file, or why there is none.
    pub case: Result<String>,
    /// The command that does the same.
    command: String,
    /// What the page shows.
    page: String,
    /// Time that the calibration took (s).
    seconds: f64,
}

/// Files of an answer, and what they are.
const FILES: [(&str, &str); 8] = [
    ("bonds.csv", "the bonds"),
    ("calibration.json", "what was reached, with its evidence"),
    ("neighbourhood.vtp", "for ParaView"),
    ("neighbourhood.svg", "picture"),
    ("neighbourhood.png", "picture"),
    ("material.toml", "the tensor"),
    ("case.toml", "a bar of it, for anisobond run"),
    ("report.html", "this page, in one file"),
];

impl Question {
    /// Calibrate.
    ///
    /// # Errors
    /// What the command line would say.
    pub fn answer(&self) -> Result<Answer> {
        let args = self.args()?;
        let (shape, ..) = shape_and_horizon(&args.neighbourhood)?;
        let places: f64 = shape.semi_axes().map(|a| 2.0 * a + 1.0).iter().product();
        if places > MOST_BONDS {
            let remedy = format!("use a smaller horizon, or `{}` in a terminal", self.command());
            return Err(Error::input(format!("about {places:.1e} bonds are too many while you wait"), remedy));
        }
        let material = self.material()?;
        let start = Instant::now();
        let done = Calibrated::new(&args, material)?;
        let seconds = start.elapsed().as_secs_f64();
        let (material, moduli) = (&done.material, BondModuli::of(&done.result));
        Ok(Answer {
            page: calibration_page_data(material, &done.report, &done.neighbourhood, &moduli, &self.command())?,
            material: material_text(material),
            case: calibrated_case(material, &done.neighbourhood, &done.result),
            command: self.command(),
            seconds,
            done,
        })
    }

    /// The flags, read as those of the command line.
    fn args(&self) -> Result<args::Calibrate> {
        let mut words: Vec<String> = ["anisobond", "calibrate", "material"].map(String::from).to_vec();
        for (flag, value) in &self.flags {
            let Some(value) = value.as_str().filter(|_| FLAGS.iter().any(|(known, _)| known == flag)) else {
                return Err(Error::input(format!("--{flag} is not of the studio"), "leave it out"));
            };
            if flag == "influence" && !["constant", "inverse", "hat", "power"].contains(&value) {
                let remedy = "use constant, inverse, hat or power; files are read on the command line only";
                return Err(Error::input(format!("--influence {value}: not a known function"), remedy));
            }
            words.push(format!("--{flag}={value}"));
        }
        words.extend(self.rotate.iter().map(|r| format!("--rotate={r}")));
        let refused = |e: clap::Error| {
            let text = e.to_string();
            let first = text.lines().next().unwrap_or_default();
            Error::input(first.trim_start_matches("error: "), "")
        };
        match args::Cli::try_parse_from(words).map_err(refused)?.command {
            args::Command::Calibrate(args) => Ok(args),
            _ => Err(Error::input("no calibration", "")),
        }
    }

    fn material(&self) -> Result<Material> {
        let mut material = match &self.material {
            MaterialText::Name(name) => builtin_material(name.trim())?,
            MaterialText::Text(text) => {
                let json = text.trim_start().starts_with('{');
                parse_any(text, if json { "material.json" } else { "material.toml" }, None)?.material
            }
        };
        if !self.class.is_empty() {
            let class = parse_class(&self.class)?;
            material.stiffness = material.stiffness.symmetry(SYMMETRY_TOLERANCE).fit(class).closest;
            material.name += &format!(", closest {}", class.name());
        }
        Ok(material)
    }

    fn command(&self) -> String {
        let material = match &self.material {
            MaterialText::Name(name) if self.class.is_empty() => name.trim().to_string(),
            _ => "material.toml".into(),
        };
        let flags = self.flags.iter().filter_map(|(flag, value)| {
            let value = value.as_str().filter(|v| !FLAGS.contains(&(flag, v)))?;
            Some(format!("--{flag} {}", in_shell(value)))
        });
        let turns = self.rotate.iter().map(|r| format!("--rotate {}", in_shell(r)));
        let words = ["anisobond calibrate".into(), in_shell(&material)].into_iter().chain(flags).chain(turns);
        words.collect::<Vec<String>>().join(" ")
    }
}

impl Answer {
    /// The answer as JSON; `id` is its place among those whose files are kept.
    pub fn json(&self, id: u64) -> String {
        let about = |name: &str| FILES.iter().find(|(known, _)| *known == name).map_or("picture", |(_, about)| about);
        let files: Vec<Value> = self.names().map(|name| json!({"name": name, "about": about(name)})).collect();
        let no_case = self.case.as_ref().err().map(ToString::to_string);
        let head = json!({
            "id": id, "seconds": self.seconds, "command": self.command, "files": files, "no_case": no_case,
        });
        let head = head.to_string();
        // The page's data are JSON already.
        format!("{},\"page\":{}}}", &head[..head.len() - 1], self.page)
    }

    /// Names of its files.
    fn names(&self) -> impl Iterator<Item = &'static str> {
        let case = self.case.is_ok();
        let tangential = self.done.result.tangential().is_some();
        let more = ["neighbourhood-tangential.svg", "neighbourhood-tangential.png"];
        let names = FILES.iter().map(|(name, _)| *name).filter(move |name| case || *name != "case.toml");
        names.chain(more.into_iter().filter(move |_| tangential))
    }

    /// One of its files; `None` for a name that is none of theirs.
    pub fn file(&self, name: &str) -> Result<Option<Vec<u8>>> {
        Ok(Some(match name {
            "bonds.csv" => self.done.bonds()?.into_bytes(),
            "material.toml" => self.material.clone().into_bytes(),
            "case.toml" => match &self.case {
                Ok(case) => case.clone().into_bytes(),
                Err(_) => return Ok(None),
            },
            "report.html" => calibration_page(&self.page).into_bytes(),
            _ => {
                if !self.names().any(|known| known == name) {
                    return Ok(None);
                }
                let files = self.done.files(None)?;
                return Ok(files.into_iter().find(|(own, _)| *own == name).map(|(_, bytes)| bytes));
            }
        }))
    }

    /// All its files, for a folder.
    pub fn files(&self) -> Result<Vec<(&'static str, Vec<u8>)>> {
        let mut files = self.done.files(None)?;
        for name in ["material.toml", "case.toml", "report.html"] {
            if let Some(bytes) = self.file(name)? {
                files.push((name, bytes));
            }
        }
        Ok(files)
    }
}
