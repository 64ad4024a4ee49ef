//! The files of a result's folder, made in memory before the first is written.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::{LatticeReport, ModelReport};
use anisobond::calibration::ModelCalibration;
use anisobond::experiment::LatticeStudy;
use anisobond::lattice::Neighbourhood;
use anisobond::tensor::Material;
use anisobond::{Error, Result};
use anisobond_formats::inputs::{checksum, read_bytes};
use anisobond_formats::{
    BondModuli, PackingFormat, bonds_csv, json_file, json_value, lattice_bonds_csv, lattice_vtp, neighbourhood_vtp,
    packing_text,
};
use anisobond_plot::{NeighbourhoodPicture, Scalar, View};

/// Names and contents of files.
pub type Files = Vec<(&'static str, Vec<u8>)>;

/// Width of PNG pictures of neighbourhoods, and of lattices (pixels).
const WIDTHS: [u32; 2] = [1800, 1600];

/// Key of a report's file under which the checksums of the files beside it stand.
const CHECKSUMS: &str = "checksums";

/// A report's file, which says which files beside it are its own.
fn report_of(report: &impl Serialize, files: &[(&str, &[u8])]) -> Result<Vec<u8>> {
    let mut report = json_value(report)?;
    for (name, bytes) in files {
        report[CHECKSUMS][name] = checksum([*bytes]).into();
    }
    json_file(&report)
}

/// Refuses a file beside a report that is not the one that was written with it.
///
/// # Errors
/// A file that cannot be read, or of another checksum; a report that has none.
pub(super) fn require_own(report: &Value, folder: &Path, name: &str) -> Result<()> {
    let bytes = read_bytes(&folder.join(name))?;
    match report[CHECKSUMS][name].as_str() {
        Some(sum) if sum == checksum([bytes.as_slice()]) => Ok(()),
        Some(_) => Err(Error::input(
            format!(
                "{name} is not the one that was written with its report: it was changed, or is of another calibration"
            ),
            "write the folder again with calibrate or lattice",
        )),
        None => Err(Error::input(
            format!("the report does not say which {name} is its own"),
            "write the folder again with calibrate or lattice of this program",
        )),
    }
}

/// The files of a calibration: report, bonds, VTK file and pictures, these in the views given or the usual three.
///
/// # Errors
/// Moduli that are not those of the neighbourhood; what the pictures refuse.
pub fn calibration_files(
    material: &Material,
    neighbourhood: &Neighbourhood,
    r: &ModelCalibration,
    report: &ModelReport,
    views: Option<Vec<View>>,
) -> Result<Files> {
    let moduli = BondModuli::of(r);
    let mut options = NeighbourhoodPicture::of(&material.name);
    if let Some(views) = views {
        options.views = views;
    }
    let bonds = bonds_csv(neighbourhood, &moduli, &material.name)?.into_bytes();
    let mut files: Files = vec![
        ("calibration.json", report_of(report, &[("bonds.csv", &bonds)])?),
        ("bonds.csv", bonds),
        ("neighbourhood.vtp", neighbourhood_vtp(neighbourhood, &moduli)?.into_bytes()),
    ];
    if moduli.tangential.is_some() {
        options.quantity = "normal micromodulus c_n".into();
    }
    let scene = anisobond_plot::neighbourhood_scene(neighbourhood, moduli.normal, &options)?;
    files.push(("neighbourhood.svg", scene.svg().into_bytes()));
    files.push(("neighbourhood.png", scene.png(WIDTHS[0])?));
    if let Some(tangential) = moduli.tangential {
        options.quantity = "tangential micromodulus c_t".into();
        let scene = anisobond_plot::neighbourhood_scene(neighbourhood, tangential, &options)?;
        files.push(("neighbourhood-tangential.svg", scene.svg().into_bytes()));
        files.push(("neighbourhood-tangential.png", scene.png(WIDTHS[0])?));
    }
    Ok(files)
}

/// The files of a lattice: report, bonds, packing, VTK file and pictures.
///
/// # Errors
/// What the pictures refuse.
pub fn lattice_files(material: &Material, study: &LatticeStudy, report: &LatticeReport) -> Result<Files> {
    let (lattice, stiffness) = (&study.lattice, &study.stiffness);
    let scalar = Scalar { name: "normal stiffness k_n".into(), unit: "N/m".into() };
    let scene = |what| anisobond_plot::lattice_scene(lattice, &stiffness.normal, scalar.clone(), &material.name, what);
    let spheres = scene(anisobond_plot::LatticeView::Spheres)?;
    let bonds = scene(anisobond_plot::LatticeView::Bonds)?;
    let spheres_file = packing_text(&lattice.packing, PackingFormat::Csv).into_bytes();
    let bonds_file = lattice_bonds_csv(lattice, stiffness, &material.name).into_bytes();
    Ok(vec![
        ("lattice.json", report_of(report, &[("bonds.csv", &bonds_file), ("packing.csv", &spheres_file)])?),
        ("bonds.csv", bonds_file),
        ("packing.csv", spheres_file),
        ("lattice.vtp", lattice_vtp(lattice, stiffness)?.into_bytes()),
        ("spheres.svg", spheres.svg().into_bytes()),
        ("spheres.png", spheres.png(WIDTHS[1])?),
        ("bonds.svg", bonds.svg().into_bytes()),
        ("bonds.png", bonds.png(WIDTHS[1])?),
    ])
}
