//! Conjugate gradients on dense matrices: against Cholesky's factors, and every way in which a solve ends.

use std::cell::Cell;

use anisobond::solver::{
    Ending, LinearOperator, Preconditioner, Progress, Rule, Semidefinite, SolverReport, Stopping, System, TrueResidual,
    VectorSpace, Watch,
};
use nalgebra::{DMatrix, DVector};

/// Columns of n numbers, one of each right-hand side.
struct Columns(usize);

impl<const L: usize> VectorSpace<L> for Columns {
    type Vector = DMatrix<f64>;

    fn zeros(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.0, L)
    }
    fn dot(&self, a: &DMatrix<f64>, b: &DMatrix<f64>) -> [f64; L] {
        std::array::from_fn(|l| a.column(l).dot(&b.column(l)))
    }
    fn add(&self, y: &mut DMatrix<f64>, s: &[f64; L], x: &DMatrix<f64>) {
        (0..L).for_each(|l| y.column_mut(l).axpy(s[l], &x.column(l), 1.0));
    }
    fn turn(&self, y: &mut DMatrix<f64>, s: &[f64; L], x: &DMatrix<f64>) {
        (0..L).for_each(|l| y.column_mut(l).axpy(1.0, &x.column(l), s[l]));
    }
    fn not_finite(&self, a: &DMatrix<f64>) -> Option<usize> {
        (0..self.0).find(|&row| !a.row(row).iter().all(|x| x.is_finite()))
    }
}

/// A matrix.
struct Dense(DMatrix<f64>);

impl LinearOperator<DMatrix<f64>> for Dense {
    fn apply(&self, x: &DMatrix<f64>, y: &mut DMatrix<f64>) {
        y.copy_from(&(&self.0 * x));
    }
}

/// The inverse of a diagonal.
struct Diagonal(DVector<f64>);

impl<const L: usize> Preconditioner<DMatrix<f64>, L> for Diagonal {
    fn apply(&self, _: &dyn LinearOperator<DMatrix<f64>>, r: &DMatrix<f64>, z: &mut DMatrix<f64>) -> usize {
        z.copy_from(r);
        z.column_iter_mut().for_each(|mut z| z.component_mul_assign(&self.0));
        0
    }
}

const N: usize = 40;

/// A repeatable number in (−1, 1).
fn noise(i: usize, j: usize) -> f64 {
    ((i * 7919 + j * 104_729 + 13) % 10_007) as f64 / 5003.5 - 1.0
}

fn positive() -> DMatrix<f64> {
    let a = DMatrix::from_fn(N, N, noise);
    &a * a.transpose() + DMatrix::from_diagonal(&DVector::from_fn(N, |i, _| 1.0 + i as f64))
}

fn load<const L: usize>() -> DMatrix<f64> {
    DMatrix::from_fn(N, L, |i, l| noise(i, 50 + l))
}

fn solved<const L: usize>(
    k: &DMatrix<f64>,
    b: &DMatrix<f64>,
    rule: &mut impl Rule<L, DMatrix<f64>>,
) -> (DMatrix<f64>, SolverReport) {
    let (space, operator) = (Columns(N), Dense(k.clone()));
    let preconditioner = Diagonal(k.diagonal().map(|d| 1.0 / d.abs()));
    let (mut x, mut r, mut report) = (DMatrix::zeros(N, L), b.clone(), SolverReport::begun(0));
    let system = System { space: &space, operator: &operator, preconditioner: &preconditioner };
    system.solve(rule, &mut x, &mut r, &mut report);
    (x, report)
}

/// By the residual computed anew.
fn by_residual(
    k: &DMatrix<f64>,
    b: &DMatrix<f64>,
    stopping: &Stopping,
    look: &dyn Fn(usize, f64) -> bool,
) -> (DMatrix<f64>, SolverReport) {
    let residual = |x: &DMatrix<f64>, r: &mut DMatrix<f64>| r.copy_from(&(b - k * x));
    let progress = Progress::new((stopping, look), b.norm(), 3 * N);
    solved::<1>(k, b, &mut TrueResidual { space: &Columns(N), residual, progress })
}

fn tight() -> Stopping {
    Stopping { tolerance: 1e-11, most_iterations: 500 }
}

const ON: &dyn Fn(usize, f64) -> bool = &|_, _| true;

#[test]
fn both_rules_agree_with_cholesky() {
    let (k, b) = (positive(), load::<3>());
    let exact = k.clone().cholesky().unwrap().solve(&b);
    let (x, report) = solved::<3>(&k, &b, &mut Semidefinite::new((&tight(), ON), &[0.0; 3], None));
    assert!(report.converged() && (&x - &exact).norm() < 1e-8 * exact.norm(), "{report:?}");
    assert_eq!(report.applications, report.iterations);
    for l in 0..3 {
        let own = b.columns(l, 1).into_owned();
        let (alone, report) = by_residual(&k, &own, &tight(), ON);
        assert!(report.converged() && report.residual <= 1e-11, "{report:?}");
        assert!((alone.column(0) - exact.column(l)).norm() < 1e-8 * exact.norm());
        // Together with others a right-hand side has the bits that it has alone.
        let (lone, _) = solved::<1>(&k, &own, &mut Semidefinite::new((&tight(), ON), &[0.0], None));
        assert_eq!(lone.column(0), x.column(l));
    }
}

#[test]
fn nothing_is_done_for_no_load() {
    let (k, b) = (positive(), DMatrix::zeros(N, 1));
    for (x, report) in
        [by_residual(&k, &b, &tight(), ON), solved::<1>(&k, &b, &mut Semidefinite::new((&tight(), ON), &[0.0], None))]
    {
        assert!(report.converged() && report.iterations == 0 && x == b, "{report:?}");
    }
}

#[test]
fn a_watch_ends_a_solve_within_an_iteration() {
    let (k, b) = (positive(), load::<1>());
    let seen = Cell::new(0);
    let (_, report) = by_residual(&k, &b, &tight(), &|done, _| {
        seen.set(done);
        done < 4
    });
    assert_eq!((report.ending, report.iterations, seen.get()), (Ending::Stopped, 4, 4));
    let watch = Watch::stopped_after(4);
    let look = watch.look();
    let (_, report) = solved::<1>(&k, &b, &mut Semidefinite::new((&tight(), &look), &[0.0], None));
    assert_eq!((report.ending, report.iterations, watch.iterations()), (Ending::Stopped, 4, 4));
    let (x, report) = solved::<1>(&k, &b, &mut Semidefinite::new((&tight(), &look), &[0.0], None));
    assert_eq!((report.ending, report.iterations, x), (Ending::Stopped, 0, DMatrix::zeros(N, 1)));
    // Seen without being ended, a solve has the bits of one that is not.
    assert_eq!(
        by_residual(&k, &b, &tight(), &|done, r| done < 1000 && r.is_finite()),
        by_residual(&k, &b, &tight(), ON)
    );
}

#[test]
fn what_is_not_positive_is_told() {
    let b = load::<1>();
    let mut k = positive();
    k[(3, 3)] -= 1e4;
    let (_, by_residual_of_k) = by_residual(&k, &b, &tight(), ON);
    let (_, semidefinite) = solved::<1>(&k, &b, &mut Semidefinite::new((&tight(), ON), &[0.0], None));
    for report in [by_residual_of_k, semidefinite] {
        assert!(matches!(report.ending, Ending::NegativeCurvature { curvature } if curvature < 0.0), "{report:?}");
    }
    // Known before, it ends the solve before its first step.
    let stopping = tight();
    let mut rule = Semidefinite::new((&stopping, ON), &[0.0], Some(-0.5));
    let report = solved::<1>(&positive(), &b, &mut rule).1;
    assert_eq!((report.ending, report.iterations), (Ending::NegativeCurvature { curvature: -0.5 }, 0));
    // A zero mode is no matter while the load does no work on it, and nothing else holds it.
    let translation = DVector::from_element(N, 1.0 / (N as f64).sqrt());
    let off = DMatrix::identity(N, N) - &translation * translation.transpose();
    let singular = &off * positive() * &off;
    let balanced = &off * load::<1>();
    let rule = || Semidefinite::new((&stopping, ON), &[0.0], None);
    let (x, report) = solved::<1>(&singular, &balanced, &mut rule());
    assert!(report.converged() && (&singular * x - &balanced).norm() < 1e-8 * balanced.norm(), "{report:?}");
    let (_, report) = solved::<1>(&singular, &DMatrix::from_element(N, 1, 1.0), &mut rule());
    assert!(!report.converged(), "{report:?}");
}

#[test]
fn limits_and_numbers_that_are_none_are_told() {
    let (k, b) = (positive(), load::<1>());
    let short = Stopping { tolerance: 1e-11, most_iterations: 3 };
    for report in
        [by_residual(&k, &b, &short, ON).1, solved::<1>(&k, &b, &mut Semidefinite::new((&short, ON), &[0.0], None)).1]
    {
        assert_eq!((report.ending, report.iterations), (Ending::MostIterations, 3));
        assert!(report.residual > 1e-11);
    }
    let (_, report) = by_residual(&k, &b, &Stopping { tolerance: 0.0, most_iterations: 100_000 }, ON);
    assert_eq!(report.ending, Ending::Stagnated, "{report:?}");
    let mut bad = b.clone();
    bad[7] = f64::NAN;
    assert_eq!(by_residual(&k, &bad, &tight(), ON).1.ending, Ending::NotFinite { node: 7 });
    let worse = SolverReport { ending: Ending::MostIterations, residual: 0.5, ..SolverReport::begun(3) };
    let negative = SolverReport { ending: Ending::NegativeCurvature { curvature: -1.0 }, ..SolverReport::begun(4) };
    let both = worse.and(negative);
    assert!(both.negative_curvature() && both.residual == 0.5 && both.applications == 4);
    assert_eq!(negative.and(worse).ending, both.ending);
    assert_eq!(SolverReport::begun(0).and(worse).ending, Ending::MostIterations);
}
