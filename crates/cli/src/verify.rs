//! `anisobond verify`.

use std::path::Path;

use anisobond::experiment::{Finding, Verdict, prakash, smilauer};
use anisobond::{Error, Result};
use anisobond_formats::read_packing;
use serde_json::json;

use crate::{Ending, args, cavity, text};

/// A suite: the document, what recomputes its values (`None` where what that needs is not here), and its misprints
/// that no value shows.
struct Suite {
    name: &'static str,
    document: &'static str,
    findings: fn(&args::Verify) -> Result<Option<Vec<Finding>>>,
    errata: &'static [&'static str],
}

const SUITES: [Suite; 3] = [
    Suite {
        name: "prakash",
        document: "Prakash, A General Numerical Method to Model Anisotropy in Discretized Bond-Based Peridynamics",
        findings: |_| prakash::findings().map(Some),
        errata: &prakash::ERRATA,
    },
    Suite {
        name: "smilauer",
        document: "Šmilauer, Cross-anisotropy model with discrete elements",
        findings: smilauer_findings,
        errata: &smilauer::ERRATA,
    },
    Suite {
        name: "cavity",
        document: "Šmilauer, Cross-anisotropy model with discrete elements: the circular cavity, its observations as numbers",
        findings: cavity_findings,
        errata: &cavity::ERRATA,
    },
];

/// Where the reference packing of the cross-anisotropy document lies beside a checkout; it is not shipped.
const REFERENCE_PACKING: &str = "../shared/data/woo-packing-2556.txt";

fn smilauer_findings(args: &args::Verify) -> Result<Option<Vec<Finding>>> {
    let path = match &args.packing {
        Some(path) => path.clone(),
        None if Path::new(REFERENCE_PACKING).exists() => REFERENCE_PACKING.into(),
        None if args.suite.is_none() => {
            eprintln!("skipped smilauer: it needs the document's packing (--packing FILE)");
            return Ok(None);
        }
        None => {
            return Err(Error::input(
                "the suite smilauer needs the document's packing",
                "give as the packing (--packing) 'pbc-spheres_N=2556,r=0.03,rRelFuzz=0.txt', which the document offers for download",
            ));
        }
    };
    smilauer::findings(&read_packing(path)?).map(Some)
}

/// It runs simulations, so it is named to be run.
fn cavity_findings(args: &args::Verify) -> Result<Option<Vec<Finding>>> {
    if args.suite.is_none() {
        eprintln!("skipped cavity: it takes a minute or more; name it to run it (anisobond verify cavity)");
        return Ok(None);
    }
    cavity::findings().map(Some)
}

fn suite(name: &str) -> Result<&'static Suite> {
    SUITES.iter().find(|s| name.eq_ignore_ascii_case(s.name)).ok_or_else(|| {
        let names: Vec<&str> = SUITES.iter().map(|s| s.name).collect();
        Error::input(format!("unknown suite {name}"), format!("use one of {}", names.join(", ")))
    })
}

/// The values of a suite, recomputed: its document and findings.
///
/// # Errors
/// An unknown suite; one that needs the document's packing, without it.
pub fn findings(name: &str, packing: Option<&Path>) -> Result<(&'static str, Vec<Finding>)> {
    let suite = suite(name)?;
    let args =
        args::Verify { suite: Some(name.into()), packing: packing.map(Path::to_path_buf), json: false, brief: false };
    // A suite that is named is not skipped.
    Ok((suite.document, (suite.findings)(&args)?.unwrap_or_default()))
}

pub fn run(args: &args::Verify) -> Result<Ending> {
    let chosen: Vec<&Suite> = match &args.suite {
        None => SUITES.iter().collect(),
        Some(name) => vec![suite(name)?],
    };
    let mut deviates = false;
    let mut documents = Vec::new();
    let mut out = String::new();
    for suite in chosen {
        let Some(findings) = (suite.findings)(args)? else { continue };
        let count = |v: Verdict| findings.iter().filter(|f| f.verdict() == v).count();
        deviates |= count(Verdict::Deviates) > 0;
        if args.json {
            let all: Vec<_> = findings.iter().map(|f| json!({"verdict": f.verdict(), "finding": f})).collect();
            documents.push(json!({
                "suite": suite.name, "document": suite.document, "errata": suite.errata, "values": findings.len(), "agree": count(Verdict::Agrees),
                "unprinted": count(Verdict::Unprinted), "published_wrong": count(Verdict::PublishedWrong),
                "deviate": count(Verdict::Deviates), "findings": all,
            }));
            continue;
        }
        out += &format!("{}\n\n{}", suite.document, table(&findings, args.brief));
        out += &format!(
            "\n{} values: {} as printed, {} printed wrong (reasons above), {} not printed, {} of ours deviate\n",
            findings.len(),
            count(Verdict::Agrees),
            count(Verdict::PublishedWrong),
            count(Verdict::Unprinted),
            count(Verdict::Deviates)
        );
        if !suite.errata.is_empty() {
            out += "\nmisprints in its formulas\n";
        }
        suite.errata.iter().for_each(|e| out += &format!("  - {e}\n"));
        out += "\n";
    }
    if args.json {
        text::print_json(&json!({ "passed": !deviates, "suites": documents }))?;
    } else {
        text::print(&out)?;
    }
    Ok(if deviates { Ending::Deviates } else { Ending::Done })
}

/// Findings as a table; in brief, only what is wrong.
pub fn table(findings: &[Finding], brief: bool) -> String {
    let shown = |f: &&Finding| !brief || matches!(f.verdict(), Verdict::PublishedWrong | Verdict::Deviates);
    let width = findings.iter().map(|f| f.quantity.chars().count()).max().unwrap_or(0);
    let pad = |text: &str| format!("{text}{}", " ".repeat(width.saturating_sub(text.chars().count())));
    let mut out =
        format!("{:14} {} {:>12} {:>16} {:>16}\n", "place", pad("quantity"), "published", "reference", "ours");
    for f in findings.iter().filter(shown) {
        let published = if f.published.is_empty() { "–" } else { &f.published };
        let mark = match f.verdict() {
            Verdict::Agrees | Verdict::Unprinted => "",
            Verdict::PublishedWrong => "  printed wrong",
            Verdict::Deviates => "  DEVIATES",
        };
        // Rounding is not a value: what is zero within the tolerance is printed as it is meant.
        let ours = if f.reference == 0.0 && f.ours.abs() <= f.tolerance { 0.0 } else { f.ours };
        out += &format!(
            "{:14} {} {published:>12} {:>16} {:>16}{mark}\n",
            f.place,
            pad(&f.quantity),
            digits(f.reference),
            digits(ours)
        );
        if f.verdict() == Verdict::PublishedWrong {
            out += &format!("{:14}   ↳ {}\n", "", f.note);
        }
    }
    out
}

/// Nine significant digits.
fn digits(x: f64) -> String {
    if x == 0.0 || x.abs() < 1e-12 {
        return "0".into();
    }
    let decimals = (8 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
