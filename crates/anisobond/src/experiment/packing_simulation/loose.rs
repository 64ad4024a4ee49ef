//! What hangs together: spheres without bonds, and parts that nothing joins.

use super::problem::PackingProblem;

/// Spheres by the bonds that join them.
pub(super) struct Joined {
    /// Spheres without a bond.
    pub floaters: Vec<u32>,
    /// Parts of more than one sphere.
    pub parts: usize,
}

impl Joined {
    pub(super) fn new(problem: &PackingProblem) -> Self {
        let n = problem.model.packing.len();
        let mut bonded = vec![false; n];
        let mut root: Vec<u32> = (0..n as u32).collect();
        for bond in &problem.model.bonds {
            bonded[bond.a as usize] = true;
            bonded[bond.b as usize] = true;
            let (a, b) = (find(&mut root, bond.a), find(&mut root, bond.b));
            root[a.max(b) as usize] = a.min(b);
        }
        let floaters = (0..n as u32).filter(|&i| !bonded[i as usize]).collect();
        let parts = (0..n as u32).filter(|&i| bonded[i as usize] && find(&mut root, i) == i).count();
        Joined { floaters, parts }
    }

    pub(super) fn warnings(&self, problem: &PackingProblem) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some(&first) = self.floaters.first() {
            let x = problem.position(first as usize);
            warnings.push(format!(
                "{} of {} spheres have no bond and carry nothing; the first is sphere {} at ({:.4e}, {:.4e}, {:.4e}) m",
                self.floaters.len(),
                problem.model.packing.len(),
                first + 1,
                x.x,
                x.y,
                x.z
            ));
        }
        if self.parts > 1 {
            warnings.push(format!("the bonds join the spheres into {} parts, not one", self.parts));
        }
        warnings
    }
}

/// The first sphere of a part, the way there shortened.
fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        root[i as usize] = root[root[i as usize] as usize];
        i = root[i as usize];
    }
    i
}
