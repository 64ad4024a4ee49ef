//! `anisobond lattice` and `anisobond element-test`.

use std::path::Path;

use anisobond::Result;
use anisobond::calibration::Model;
use anisobond::experiment::element_test::{DynamicTest, ElementTest, Rotations};
use anisobond::experiment::{
    CorrectionChoice, CorrectionForm, CorrectionReport, LatticePlan, LatticeStudy, anisotropy_axis, turned_to_axis,
};
use anisobond::tensor::{Material, Stiffness};
use anisobond_app::lattice_report::Checks;
use anisobond_app::report::Voigt;
use anisobond_app::{ElementTestReport, LatticeReport};
use anisobond_formats::PackingReading;
use nalgebra::Vector3;

use crate::pack::read_words;
use crate::waiting::watched;
use crate::{Ending, args, folder, grid_test, report, text};

pub fn run(args: &args::Lattice) -> Result<Ending> {
    let Planned { material, study, read } =
        study(&args.packing, &args.file, &args.material, &args.bonds, Rotations::Free)?;
    let report = LatticeReport::new(&material, &study)?;
    if let Some(folder) = &args.output {
        folder::write(folder, &anisobond_app::lattice_files(&material, &study, &report)?, args.force)?;
        report::beside(args.report, folder)?;
    }
    if args.json {
        text::print_json(&with_reading(&report, &read)?)?;
    } else {
        text::print(&(read_words(&read) + &describe_lattice(&report)))?;
    }
    Ok(Ending::Done)
}

pub fn test(args: &args::ElementTest) -> Result<Ending> {
    let rotations = if args.rotations == args::RotationsName::Free { Rotations::Free } else { Rotations::Blocked };
    let Some(packing) = &args.packing else { return grid_test::run(args, rotations) };
    let Planned { material, study, read } = study(packing, &args.file, &args.material, &args.bonds, rotations)?;
    let report = match args.method {
        args::MethodName::Static => {
            let test = ElementTest { rotations, ..ElementTest::default() };
            let result = watched(|watch| ElementTest { watch: watch.clone(), ..test }.run(&study.network()))?;
            ElementTestReport::of_static(&material, &study, &result)?
        }
        args::MethodName::Dynamic => {
            let test = DynamicTest { rotations, strain: args.strain, ..DynamicTest::default() };
            let result = watched(|watch| DynamicTest { watch: watch.clone(), ..test }.run(&study.network()))?;
            ElementTestReport::of_dynamic(&material, &study, &result)?
        }
    };
    if let Some(folder) = &args.output {
        let measured = Stiffness::from_voigt_rows(&report.measured)?;
        let tensors = [("prescribed", &study.prescribed), ("measured", &measured)];
        let subtitle = format!("contact radius {}", text::number(report.lattice.contact_radius));
        let mut files = vec![("element-test.json", anisobond_formats::json_file(&report)?)];
        files.extend(directional(&material, &subtitle, &tensors)?);
        let bonds = anisobond_formats::lattice_bonds_csv(&study.lattice, &study.stiffness, &material.name);
        let packing = anisobond_formats::packing_text(&study.lattice.packing, anisobond_formats::PackingFormat::Csv);
        files.extend([("bonds.csv", bonds.into_bytes()), ("packing.csv", packing.into_bytes())]);
        folder::write(folder, &files, args.force)?;
        report::beside(args.report, folder)?;
    }
    if args.json {
        text::print_json(&with_reading(&report, &read)?)?;
    } else {
        text::print(&(read_words(&read) + &describe_test(&report)))?;
    }
    if !report.solver.converged {
        eprintln!(
            "anisobond: the solver did not converge (residual {:.1e}); the values are not final",
            report.solver.residual
        );
    }
    Ok(Ending::Done)
}

/// Width of PNG pictures (pixels).
const PICTURE_WIDTH: u32 = 1600;

/// Pictures and numbers of Young's modulus over directions.
pub fn directional(
    material: &Material,
    subtitle: &str,
    tensors: &[(&str, &Stiffness)],
) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let polar =
        anisobond_plot::directional_picture(&format!("Young's modulus of {}", material.name), subtitle, tensors)?;
    Ok(vec![
        ("directional.svg", polar.svg().into_bytes()),
        ("directional.png", polar.png(PICTURE_WIDTH)?),
        ("directional.csv", anisobond_plot::directional_csv(tensors)?.into_bytes()),
    ])
}

/// The library's model; the default where none is named.
pub fn model(name: Option<args::LatticeModelName>, default: Model) -> Model {
    match name {
        None => default,
        Some(args::LatticeModelName::Central) => Model::Central,
        Some(args::LatticeModelName::Micropolar) => Model::Micropolar,
        Some(args::LatticeModelName::Hybrid) => Model::Hybrid,
    }
}

fn plan(args: &args::BondArgs, test: ElementTest) -> LatticePlan {
    let correct = args.correct.map(|name| match name {
        args::CorrectName::Elliptic => CorrectionChoice::Elliptic,
        args::CorrectName::General => CorrectionChoice::General,
    });
    LatticePlan::new(model(args.model, Model::Micropolar), correct, test)
}

/// A report with what the packing's file was taken for.
fn with_reading(report: &impl serde::Serialize, read: &PackingReading) -> Result<serde_json::Value> {
    let mut document = anisobond_formats::json_value(report)?;
    document["packing_read_as"] = read.read_as.clone().into();
    document["packing_columns"] = anisobond_formats::json_value(&read.columns)?;
    document["packing_notes"] = read.notes.clone().into();
    Ok(document)
}

/// A lattice, its material, and what its packing's file was taken for.
struct Planned {
    material: Material,
    study: LatticeStudy,
    read: PackingReading,
}

fn study(
    packing: &Path,
    file: &args::SphereFileArgs,
    material: &str,
    args: &args::BondArgs,
    rotations: Rotations,
) -> Result<Planned> {
    let mut material = args.table.find(material)?.material;
    let read = file.read(packing)?;
    if let Some(given) = &args.axis {
        let axis = match given.contains(':') {
            true => anisobond_formats::parse_orientation(given).map_err(|e| e.at("--axis"))? * Vector3::z(),
            false => text::vector(given, "--axis")?,
        };
        material.stiffness = turned_to_axis(&material.stiffness, &axis)?;
    }
    let axis = anisotropy_axis(&material.stiffness);
    let study = watched(|watch| {
        let plan = plan(args, ElementTest { rotations, watch: watch.clone(), ..ElementTest::default() });
        LatticeStudy::planned(read.packing.clone(), &material.stiffness, &axis, args.contact_radius, &plan)
    })?;
    if let Some(fit) = study.fit
        && fit.distance > 1e-6
    {
        eprintln!(
            "note: {} is {} % away from transverse isotropy about the axis; its closest such tensor is used",
            material.name,
            text::number(100.0 * fit.distance)
        );
    }
    Ok(Planned { material, study, read })
}

/// A lattice, and its tensors side by side.
pub fn describe_lattice(r: &LatticeReport) -> String {
    let mut columns = vec![("prescribed", &r.prescribed)];
    columns.extend(replaced(r));
    columns.push(("lattice", &r.lattice));
    columns.extend(r.best_fit.iter().map(|c| ("best fit", c)));
    describe(r) + &components(&columns) + &energy(r)
}

/// The tensor of elliptic moduli, where it is not the material's.
fn replaced(r: &LatticeReport) -> Option<(&'static str, &Voigt)> {
    Some(("elliptic", r.elliptic.as_ref()?.elliptic.as_ref()?))
}

/// How far the energy of a strain is off, and what to look at.
fn energy(r: &LatticeReport) -> String {
    text::energy_error(r.energy_error) + &r.warnings.iter().map(|w| format!("warning: {w}\n")).collect::<String>()
}

fn describe(r: &LatticeReport) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.prescribed));
    let stress = |x: f64| format!("{} {name}", text::number(x / unit));
    let mut out = format!(
        "{} on {} spheres, contact radius {}, model {}\n{} contacts, {} per sphere",
        r.material,
        r.packing.number,
        text::number(r.contact_radius),
        model_name(r.model),
        r.contacts,
        text::number(r.coordination)
    );
    out += &r.elliptic.as_ref().map_or(String::new(), |e| format!("; axis {}", text::direction(&e.axis)));
    out += &format!("\n\nμ                 {}\n", text::number(r.mu));
    if let Some(elliptic) = &r.elliptic {
        let (e, c44) = (&elliptic.lattice_moduli, &elliptic.c44);
        out += &format!("lattice moduli    E_N^a′ {}  E_N^b′ {}  ", stress(e.en_a), stress(e.en_b));
        out += &format!("E_T^a′ {}  E_T^b′ {}\n", stress(e.et_a), stress(e.et_b));
        if (c44.given - c44.dependent).abs() > 1e-9 * c44.given.abs() {
            out += &format!(
                "C44               {} follows from the four elliptic moduli, for the material's {}\n",
                stress(c44.dependent),
                stress(c44.given)
            );
        }
    }
    if let Some(correction) = &r.correction {
        out += &describe_correction(correction);
    }
    out
}

/// A model as it is named on the command line.
pub fn model_name(model: Model) -> &'static str {
    match model {
        Model::Central => "central",
        Model::Micropolar => "micropolar",
        Model::Hybrid => "hybrid",
    }
}

/// How a correction went.
pub fn describe_correction(r: &CorrectionReport) -> String {
    let percent = |x: &f64| format!("{:.2e} %", 100.0 * x);
    let history: Vec<String> = r.history.iter().map(percent).collect();
    let form = match r.form {
        CorrectionForm::Elliptic => "elliptic moduli",
        CorrectionForm::General => "moduli of every direction",
        CorrectionForm::Central => "normal moduli of every direction",
        CorrectionForm::Nodal => "nodal term",
    };
    let mut out = format!("corrected         {form}: {} corrections, error {}\n", r.corrections, history.join(" → "));
    out += &format!(
        "                  k_n {} … {} N/m, k_t {} … {} N/m\n",
        text::number(r.smallest_normal),
        text::number(r.largest_normal),
        text::number(r.smallest_tangential),
        text::number(r.largest_tangential)
    );
    if let Some(nodal) = &r.nodal {
        let sign = if nodal.positive {
            "positive: nothing has negative energy".to_string()
        } else {
            format!("negative by {} Pa, yet no displacement of negative energy was met", text::number(-nodal.moduli[0]))
        };
        out +=
            &format!("                  Z is {sign}; {} % of the bonds kept\n", text::number(100.0 * nodal.bond_share));
    }
    if let Some(shortfall) = &r.shortfall {
        out += &format!("                  {shortfall}\n");
    }
    out
}

/// The components that differ for a transversely isotropic tensor, side by side.
pub fn components(columns: &[(&str, &Voigt)]) -> String {
    let (unit, name) = text::stress_unit(columns.iter().map(|c| text::largest(c.1)).fold(0.0, f64::max));
    let mut out = format!("\n  {:8}", format!("({name})"));
    columns.iter().for_each(|(title, _)| out += &format!("{title:>12}"));
    out += "\n";
    for (a, b) in [(1, 1), (2, 2), (3, 3), (1, 2), (1, 3), (2, 3), (4, 4), (5, 5), (6, 6)] {
        out += &format!("  C{a}{b}     ");
        columns.iter().for_each(|(_, c)| out += &format!("{:>12.4}", c[a - 1][b - 1] / unit));
        out += "\n";
    }
    out
}

/// A lattice and its element test.
pub fn describe_test(r: &ElementTestReport) -> String {
    let (unit, name) = text::stress_unit(text::largest(&r.lattice.prescribed));
    let mut out = describe(&r.lattice);
    let mut columns = vec![("prescribed", &r.lattice.prescribed)];
    columns.extend(replaced(&r.lattice));
    columns.extend([("lattice", &r.lattice.lattice), ("measured", &r.measured)]);
    columns.extend(r.lattice.best_fit.iter().map(|c| ("best fit", c)));
    out += &components(&columns);
    out += &format!("\nmeasured is {} % away from prescribed\n", text::number(100.0 * r.relative_error));
    out += &energy(&r.lattice);
    if let Some(e) = &r.engineering {
        let row = |values: [f64; 3]| values.map(|x| format!("{x:>10.4}")).concat();
        out += &format!("  E_x E_y E_z    ({name}) {}\n", row([e.ex, e.ey, e.ez].map(|x| x / unit)));
        out += &format!("  G_yz G_zx G_xy ({name}) {}\n", row([e.gyz, e.gzx, e.gxy].map(|x| x / unit)));
        out += &format!("  ν_xy ν_xz ν_yz       {}\n", row([e.nu_xy, e.nu_xz, e.nu_yz]));
        out += &format!("  ν_yx ν_zx ν_zy       {}\n", row([e.nu_yx, e.nu_zx, e.nu_zy]));
    }
    if let Some(c) = &r.consistency {
        let couple = |[a, b]: [f64; 2]| format!("{:.2} %", 200.0 * (a - b).abs() / (a.abs() + b.abs()));
        out += &format!(
            "  symmetric couples differ by: E_x E_y {}, G_yz G_zx {}, ν_xy ν_yx {}, ν_xz ν_yz {}, ν_zx ν_zy {}\n",
            couple(c.ex_ey),
            couple(c.gyz_gzx),
            couple(c.nu_xy_nu_yx),
            couple(c.nu_xz_nu_yz),
            couple(c.nu_zx_nu_zy)
        );
        out += &format!(
            "  dependent: ν_xz = ν_zx E_x/E_z = {:.4}, G_xy = E_x/2(1 + ν_xy) = {:.4} {name}\n",
            c.dependent_nu_xz,
            c.dependent_gxy / unit
        );
    }
    out += &match r.certificate {
        Checks::Static(c) => format!(
            "static, rotations {}; force balance {:.1e}, asymmetry {:.1e}, energy against stress {:.1e}\n",
            if r.rotations == Rotations::Free { "free" } else { "blocked" },
            c.force_balance,
            c.asymmetry,
            c.energy_consistency
        ),
        Checks::Dynamic { force_balance, lateral_stress, asymmetry } => format!(
            "dynamic to {} % logarithmic strain; unbalanced {force_balance:.1e}, lateral stress {lateral_stress:.1e}, symmetric couples differ by {asymmetry:.1e}\n",
            text::number(100.0 * r.strain)
        ),
    };
    out += &format!("{} iterations, residual {:.1e}\n", r.solver.iterations, r.solver.residual);
    out
}
