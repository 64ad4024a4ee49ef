//! What a command does, without a command line: the case language, runs, sweeps, exports, reports and pages.

pub mod claim;
pub mod report;
pub mod lattice_report;
pub mod grid_report;
pub mod hybrid_report;
pub mod advice_report;
pub mod micropolar_report;
pub mod model_report;
pub mod journal;
pub mod calibrate_table;
pub mod rows;
pub mod rank;
pub mod folder;
pub mod run;
pub mod sweep;
pub mod element_sweep;
pub mod case;
pub mod export;
pub mod page;

pub use advice_report::AdviceReport;
pub use calibrate_table::{TableResults, calibrate_table, table_journal};
pub use case::{
    CaseFile, CasePlan, ConditionPlan, LatticeKind, PackingPlan, RegionPlan, calibrated_case, read_case, starter_case,
};
pub use claim::{FolderLock, refuse_other_kind, remove_results, write_files};
pub use export::{BondedCell, Engine, Export, ExportFile, export};
pub use folder::{Files, calibration_files, lattice_files};
pub use grid_report::{CellReport, CellStability, GridTestReport};
pub use hybrid_report::HybridReport;
pub use journal::Journal;
pub use lattice_report::{ElementTestReport, LatticeReport};
pub use micropolar_report::{MicropolarInfeasibilityReport, MicropolarReport};
pub use model_report::ModelReport;
pub use page::{calibration_page, calibration_page_data, rank_page, report_page, studio_page};
pub use rank::{RankSettings, Ranking, rank};
pub use report::{CalibrationReport, NeighbourhoodReport, TensorReport};
pub use rows::each_row;
