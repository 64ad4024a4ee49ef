//! The command line of anisobond: flags to library types, library results to text. No physics here.
//!
//! Answers go to stdout, progress and messages to stderr. Exit codes: 0 done, 1 a verification deviates, 2 bad input,
//! 3 `--require-exact` asked and not reached, 130 interrupted.

mod advise;
mod args;
mod calibrate;
mod calibration_text;
mod case;
mod cavity;
mod export;
mod folder;
mod grid_test;
mod interrupt;
mod lattice;
mod materials;
mod pack;
mod report;
mod run;
mod studio;
mod sweep;
mod table;
mod tensor;
mod text;
mod verify;

use std::process::ExitCode;

use anisobond::{Error, Result};
use clap::{CommandFactory, Parser};

/// How a command ended, other than by an error.
pub enum Ending {
    /// What was asked is done.
    Done,
    /// A verification found a value of ours that is not the reference.
    Deviates,
    /// The target was not reached to the required error.
    NotExact,
}

fn main() -> ExitCode {
    let cli = args::Cli::parse();
    match run(cli) {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Deviates) => ExitCode::from(1),
        Ok(Ending::NotExact) => ExitCode::from(3),
        Err(error) => {
            eprintln!("anisobond: {error}");
            ExitCode::from(if matches!(error, Error::Interrupted { .. }) { 130 } else { 2 })
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
