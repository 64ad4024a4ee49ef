//! The files of a result's folder, made in memory before the first is written.

use super::picture::{self, NeighbourhoodPicture, Scalar, View};
use super::{
    BondModuli, LatticeReport, ModelReport, PackingFormat, bonds_csv, json_file, lattice_bonds_csv, lattice_vtp,
    neighbourhood_vtp, packing_text,
};
use crate::Result;
use crate::calibration::ModelCalibration;
use crate::experiment::LatticeStudy;
use crate::lattice::Neighbourhood;
use crate::tensor::Material;

/// Names and contents of files.
pub type Files = Vec<(&'static str, Vec<u8>)>;

/// Width of PNG pictures of neighbourhoods, and of lattices (pixels).
const WIDTHS: [u32; 2] = [1800, 1600];

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
    let mut files: Files = vec![
        ("calibration.json", json_file(report)?),
        ("bonds.csv", bonds_csv(neighbourhood, &moduli, &material.name)?.into_bytes()),
        ("neighbourhood.vtp", neighbourhood_vtp(neighbourhood, &moduli)?.into_bytes()),
    ];
    if moduli.tangential.is_some() {
        options.quantity = "normal micromodulus c_n".into();
    }
    let scene = picture::neighbourhood_scene(neighbourhood, moduli.normal, &options)?;
    files.push(("neighbourhood.svg", scene.svg().into_bytes()));
    files.push(("neighbourhood.png", scene.png(WIDTHS[0])?));
    if let Some(tangential) = moduli.tangential {
        options.quantity = "tangential micromodulus c_t".into();
        let scene = picture::neighbourhood_scene(neighbourhood, tangential, &options)?;
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
    let scene = |what| picture::lattice_scene(lattice, &stiffness.normal, scalar.clone(), &material.name, what);
    let spheres = scene(picture::LatticeView::Spheres)?;
    let bonds = scene(picture::LatticeView::Bonds)?;
    Ok(vec![
        ("lattice.json", json_file(report)?),
        ("bonds.csv", lattice_bonds_csv(lattice, stiffness, &material.name).into_bytes()),
        ("packing.csv", packing_text(&lattice.packing, PackingFormat::Csv).into_bytes()),
        ("lattice.vtp", lattice_vtp(lattice, stiffness)?.into_bytes()),
        ("spheres.svg", spheres.svg().into_bytes()),
        ("spheres.png", spheres.png(WIDTHS[1])?),
        ("bonds.svg", bonds.svg().into_bytes()),
        ("bonds.png", bonds.png(WIDTHS[1])?),
    ])
}
