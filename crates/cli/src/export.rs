//! `anisobond export`.

use anisobond::Result;
use anisobond::io::{BondedCell, Engine, export};

use crate::{Ending, args, folder, grid_test};

pub fn run(args: &args::Export) -> Result<Ending> {
    let (engine, name) = match args.to {
        args::EngineName::Lammps => (Engine::Lammps, "lammps"),
        args::EngineName::Abaqus => (Engine::Abaqus, "abaqus"),
        args::EngineName::Calculix => (Engine::Calculix, "calculix"),
        args::EngineName::Yade => (Engine::Yade, "yade"),
        args::EngineName::Woo => (Engine::Woo, "woo"),
        args::EngineName::Peridigm => (Engine::Peridigm(args.within), "peridigm"),
        args::EngineName::PeriLab => (Engine::PeriLab(args.within), "perilab"),
        args::EngineName::MatrixMarket => (Engine::MatrixMarket, "matrix-market"),
        args::EngineName::Numpy => (Engine::Numpy, "numpy"),
    };
    let nodes = args.nodes.as_deref().map(|n| grid_test::nodes("--nodes", n)).transpose()?;
    let files = export(&BondedCell::read(&args.folder, nodes)?, engine)?;
    let files: Vec<(&str, Vec<u8>)> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    let output = args.output.clone().unwrap_or_else(|| args.folder.join(name));
    folder::write(&output, &files)?;
    Ok(Ending::Done)
}
