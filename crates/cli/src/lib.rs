//! The command line of anisobond: flags to library types, library results to text. No physics here.
//!
//! Answers go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 a verification deviates, 2 bad input,
//! 3 `--require-exact` asked and not reached, 4 a calibration did not converge, 5 rows of a table failed and others did not, 130
//! interrupted.

mod advise;
mod args;
mod calibrate;
mod calibration_text;
mod case;
mod cavity;
#[cfg(test)]
mod documented;
mod export;
mod folder;
mod grid_test;
mod interrupt;
mod lattice;
mod materials;
mod pack;
mod rank;
mod report;
mod rows;
mod run;
mod studio;
mod sweep;
mod table;
mod tensor;
mod text;
mod verify;
mod waiting;

use std::ffi::OsString;

use anisobond::{Error, Result};
use clap::{CommandFactory, Parser};

/// Results in words, as the command line prints them.
pub mod describe {
    pub use crate::advise::describe as advice;
    pub use crate::calibration_text::describe as calibration;
    pub use crate::case::checked as case;
    pub use crate::grid_test::describe as grid_test;
    pub use crate::lattice::{describe_lattice as lattice, describe_test as element_test};
    pub use crate::pack::describe as packing;
    pub use crate::run::describe as run;
    pub use crate::tensor::describe as tensor;
    pub use crate::text::{number, stress_unit};
    pub use crate::verify::{findings as verify, table as findings};
}

/// How a command ended, other than by an error.
enum Ending {
    /// What was asked is done.
    Done,
    /// A verification found a value of ours that is not the reference.
    Deviates,
    /// The target was not reached to the required error.
    NotExact,
    /// A calibration did not converge: its bonds are what the solver came to.
    NotConverged,
    /// Rows of a table, or jobs of a sweep, failed; the others are done.
    RowsFailed,
}

/// Run the command of a command line, the program's name first, and return the exit code.
///
/// Ctrl-C is taken over by the commands that can keep what they have finished; others leave it as it is.
pub fn main_from(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = words.into_iter().collect();
    report::typed(&words);
    let cli = match args::Cli::try_parse_from(words) {
        Ok(cli) => cli,
        // Help and versions come this way too, with code 0.
        Err(error) => {
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    match run(cli) {
        Ok(Ending::Done) => 0,
        Ok(Ending::Deviates) => 1,
        Ok(Ending::NotExact) => 3,
        Ok(Ending::NotConverged) => 4,
        Ok(Ending::RowsFailed) => 5,
        Err(error) => {
            eprintln!("anisobond: {}", text::sentence(&error));
            if matches!(error, Error::Interrupted { .. }) { 130 } else { 2 }
        }
    }
}

fn run(cli: args::Cli) -> Result<Ending> {
    if let Some(threads) = cli.threads {
        if threads == 0 {
            return Err(Error::input("--threads 0", "give at least 1"));
        }
        // Fails only if a pool exists already; this is the first use.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    }
    match cli.command {
        args::Command::Tensor(a) => tensor::run(&a),
        args::Command::Calibrate(a) => calibrate::run(&a),
        args::Command::Advise(a) => advise::run(&a),
        args::Command::Rank(a) => rank::run(&a),
        args::Command::Pack(a) => pack::run(&a),
        args::Command::Lattice(a) => lattice::run(&a),
        args::Command::ElementTest(a) => lattice::test(&a),
        args::Command::Sweep(a) => sweep::run(&a),
        args::Command::Run(a) => run::run(&a),
        args::Command::Check(a) => case::check(&a),
        args::Command::New(a) => case::new(&a),
        args::Command::Export(a) => export::run(&a),
        args::Command::Report(a) => report::run(&a),
        args::Command::Studio(a) => studio::run(&a),
        args::Command::Verify(a) => verify::run(&a),
        args::Command::Materials(a) => materials::run(&a),
        args::Command::Completions(a) => {
            let mut script = Vec::new();
            clap_complete::generate(a.shell, &mut args::Cli::command(), "anisobond", &mut script);
            text::print(&String::from_utf8_lossy(&script)).map(|()| Ending::Done)
        }
    }
}
