//! What a solve needs: vectors, an operator and its approximate inverse.

/// Vectors of L right-hand sides that are solved together, each with numbers of its own.
///
/// The order of its sums is the space's: whatever threads or machines do the work, the bits are the same.
pub trait VectorSpace<const L: usize> {
    /// Its vectors.
    type Vector;

    /// The zero vector.
    fn zeros(&self) -> Self::Vector;

    /// a · b of each right-hand side.
    fn dot(&self, a: &Self::Vector, b: &Self::Vector) -> [f64; L];

    /// y += s x.
    fn add(&self, y: &mut Self::Vector, s: &[f64; L], x: &Self::Vector);

    /// y = x + s y.
    fn turn(&self, y: &mut Self::Vector, s: &[f64; L], x: &Self::Vector);

    /// The first entry that is not a finite number.
    fn not_finite(&self, a: &Self::Vector) -> Option<usize>;

    /// √(a · a).
    fn norm(&self, a: &Self::Vector) -> [f64; L] {
        self.dot(a, a).map(f64::sqrt)
    }

    /// x += s p and r −= s q.
    #[inline(always)]
    fn advance(&self, s: &[f64; L], [p, q]: [&Self::Vector; 2], [x, r]: [&mut Self::Vector; 2]) {
        self.add(x, s, p);
        self.add(r, &s.map(|s| -s), q);
    }
}

/// A symmetric operator K.
pub trait LinearOperator<V> {
    /// y = K x.
    fn apply(&self, x: &V, y: &mut V);
}

/// An approximate inverse M⁻¹ of an operator: symmetric, and positive but where components are held.
pub trait Preconditioner<V, const L: usize = 1> {
    /// z = M⁻¹ r; returns how often K was applied. K may have lost bonds since the set-up: M⁻¹ is then a poorer approximation,
    /// and still symmetric and positive.
    fn apply(&self, operator: &dyn LinearOperator<V>, r: &V, z: &mut V) -> usize;

    /// The same, with r · z of each right-hand side: what acts node by node may do both in one pass, in the order of the space.
    #[inline(always)]
    fn apply_and_dot<S: VectorSpace<L, Vector = V>>(
        &self,
        space: &S,
        operator: &dyn LinearOperator<V>,
        r: &V,
        z: &mut V,
    ) -> (usize, [f64; L])
    where
        Self: Sized,
    {
        let applications = self.apply(operator, r, z);
        (applications, space.dot(r, z))
    }
}
