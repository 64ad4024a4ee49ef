//! The same calibration by a general conic solver: the independent opinion, for tests and benches.

use anisobond::lattice::Neighbourhood;
use anisobond::tensor::{Quartic, Stiffness, cauchy_coordinates, quartic_of};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT,
};

/// Columns of X, in the solver's units (largest share 1), and that largest share (m⁴).
pub fn columns(neighbourhood: &Neighbourhood) -> (Vec<Quartic>, f64) {
    let share: Vec<f64> = neighbourhood.bonds().iter().map(|b| neighbourhood.stiffness_share(b)).collect();
    let unit = share.iter().copied().fold(0.0, f64::max);
    let column = |(bond, s): (&anisobond::lattice::Bond, f64)| s / unit * quartic_of(&bond.xi.normalize());
    (neighbourhood.bonds().iter().zip(share).map(column).collect(), unit)
}

/// minimise ½‖c‖² subject to X c = S, c ≥ l (P eqs 41-43) by clarabel, with its default settings or, `tight`, close to
/// rounding. Returns its status, c (N/m⁶) and ‖Xc − S‖/‖S‖.
pub fn calibrate(
    columns: &[Quartic],
    unit: f64,
    target: &Stiffness,
    lower_bound: f64,
    tight: bool,
) -> (SolverStatus, Vec<f64>, f64) {
    let bonds = columns.len();
    let s = cauchy_coordinates(target);
    let scale = s.norm();
    let mut rows = Vec::with_capacity(16 * bonds);
    let mut values = Vec::with_capacity(16 * bonds);
    let mut starts = vec![0];
    for (i, column) in columns.iter().enumerate() {
        for k in 0..15 {
            if column[k] != 0.0 {
                rows.push(k);
                values.push(column[k]);
            }
        }
        rows.push(15 + i);
        values.push(-1.0);
        starts.push(rows.len());
    }
    let a = CscMatrix::new(15 + bonds, bonds, starts, rows, values);
    let mut b: Vec<f64> = (s / scale).iter().copied().collect();
    b.resize(15 + bonds, -lower_bound * unit / scale);
    let cones: [SupportedConeT<f64>; 2] = [ZeroConeT(15), NonnegativeConeT(bonds)];
    let mut settings = DefaultSettings { verbose: false, ..Default::default() };
    if tight {
        settings.tol_gap_abs = 1e-14;
        settings.tol_gap_rel = 1e-14;
        settings.tol_feas = 1e-14;
    }
    let p = CscMatrix::identity(bonds);
    let mut solver =
        DefaultSolver::new(&p, &vec![0.0; bonds], &a, &b, &cones, settings).expect("the problem has consistent sizes");
    solver.solve();
    let c = solver.solution.x.clone();
    let reached = columns.iter().zip(&c).fold(Quartic::zeros(), |sum, (v, c)| sum + *c * v);
    let residual = (reached - s / scale).norm();
    (solver.solution.status, c.iter().map(|c| c * scale / unit).collect(), residual)
}
