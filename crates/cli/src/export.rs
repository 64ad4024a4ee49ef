//! `anisobond export`.

use anisobond::Result;
use anisobond_app::{BondedCell, Engine, export};

use crate::{Ending, args, grid_test};

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
    let export = export(&BondedCell::read(&args.folder, nodes)?, engine)?;
    let output = args.output.clone().unwrap_or_else(|| args.folder.join(name));
    export.write(&output, args.force)?;
    let names: Vec<&str> = export.files.iter().map(|f| f.0.as_str()).collect();
    eprintln!("wrote {} in {}", names.join(", "), output.display());
    if let Some(warning) = export.warning {
        eprintln!("warning: {warning}");
    }
    Ok(Ending::Done)
}
