//! What is not plausible of a case's materials and sizes.

use super::CaseFile;
use super::matter::{Filling, Matter};
use anisobond::tensor::{Material, doubtful_length};

/// In sentences without an end, each with its place.
pub(super) fn doubts(case: &CaseFile) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    if let Some(grid) = &case.grid {
        all.extend(doubtful_length("grid.spacing: a spacing", grid.neighbourhood.spacing()));
    }
    for region in &case.regions {
        let matters: Vec<&Matter> = match &region.filling {
            Filling::One(matter) => vec![matter],
            Filling::Grains { matter, .. } => vec![matter],
            Filling::Layers { layers, .. } => layers.iter().map(|(_, matter)| matter).collect(),
        };
        for matter in matters {
            let (stiffness, density) = (matter.stiffness, matter.density);
            let material = Material { name: String::new(), stiffness, density, source: String::new() };
            for doubt in material.doubts() {
                let words = format!("region {}: {doubt}", region.name);
                if !all.contains(&words) {
                    all.push(words);
                }
            }
        }
    }
    all
}
