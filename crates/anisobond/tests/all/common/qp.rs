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

/// Rows, values and starts of the columns of X c = S (15 rows) above −c ≤ −l (one row per bond).
fn constraints(columns: &[Quartic]) -> (Vec<usize>, Vec<f64>, Vec<usize>) {
    let (mut rows, mut values, mut starts) = (Vec::new(), Vec::new(), vec![0]);
    for (i, column) in columns.iter().enumerate() {
        for k in (0..15).filter(|&k| column[k] != 0.0) {
            rows.push(k);
            values.push(column[k]);
        }
        rows.push(15 + i);
        values.push(-1.0);
        starts.push(rows.len());
    }
    (rows, values, starts)
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
    let (rows, values, starts) = constraints(columns);
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

/// min ‖Xc − S‖/‖S‖ over c ≥ l by clarabel: the distance of a target from the reachable tensors.
pub fn distance(columns: &[Quartic], unit: f64, target: &Stiffness, lower_bound: f64) -> f64 {
    let bonds = columns.len();
    let s = cauchy_coordinates(target);
    let scale = s.norm();
    // Variables (c, r): minimise ½‖r‖² subject to X c + r = S, c ≥ l.
    let (mut rows, mut values, mut starts) = constraints(columns);
    let (mut p_rows, mut p_starts) = (Vec::new(), vec![0; bonds + 1]);
    for k in 0..15 {
        rows.push(k);
        values.push(1.0);
        starts.push(rows.len());
        p_rows.push(bonds + k);
        p_starts.push(k + 1);
    }
    let a = CscMatrix::new(15 + bonds, bonds + 15, starts, rows, values);
    let p = CscMatrix::new(bonds + 15, bonds + 15, p_starts, p_rows, vec![1.0; 15]);
    let mut b: Vec<f64> = (s / scale).iter().copied().collect();
    b.resize(15 + bonds, -lower_bound * unit / scale);
    let cones: [SupportedConeT<f64>; 2] = [ZeroConeT(15), NonnegativeConeT(bonds)];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-13,
        tol_gap_rel: 1e-13,
        tol_feas: 1e-13,
        ..Default::default()
    };
    let mut solver = DefaultSolver::new(&p, &vec![0.0; bonds + 15], &a, &b, &cones, settings)
        .expect("the problem has consistent sizes");
    solver.solve();
    solver.solution.x[bonds..].iter().map(|r| r * r).sum::<f64>().sqrt()
}

/// The largest t with Xc = S, c ≥ t (N/m⁶), as a linear program by clarabel.
pub fn largest_bound(columns: &[Quartic], unit: f64, target: &Stiffness) -> f64 {
    let bonds = columns.len();
    let s = cauchy_coordinates(target);
    let scale = s.norm();
    // Variables (d, t): maximise t subject to X d + t X1 = S, d ≥ 0.
    let (mut rows, mut values, mut starts) = constraints(columns);
    let ones = columns.iter().fold(Quartic::zeros(), |sum, v| sum + v);
    rows.extend(0..15);
    values.extend(ones.iter());
    starts.push(rows.len());
    let a = CscMatrix::new(15 + bonds, bonds + 1, starts, rows, values);
    let p = CscMatrix::<f64>::zeros((bonds + 1, bonds + 1));
    let mut q = vec![0.0; bonds + 1];
    q[bonds] = -1.0;
    let mut b: Vec<f64> = (s / scale).iter().copied().collect();
    b.resize(15 + bonds, 0.0);
    let cones: [SupportedConeT<f64>; 2] = [ZeroConeT(15), NonnegativeConeT(bonds)];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-12,
        tol_gap_rel: 1e-12,
        tol_feas: 1e-12,
        ..Default::default()
    };
    let mut solver = DefaultSolver::new(&p, &q, &a, &b, &cones, settings).expect("the problem has consistent sizes");
    solver.solve();
    solver.solution.x[bonds] * scale / unit
}
