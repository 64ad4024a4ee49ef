//! Parts of a graph: which nodes hang together.

/// The part of each of `nodes` nodes joined by edges, parts numbered by their smallest node; a node without edges is a
/// part of its own.
pub fn parts(nodes: usize, edges: impl IntoIterator<Item = (u32, u32)>) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..nodes as u32).collect();
    for (a, b) in edges {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b) as usize] = a.min(b);
    }
    (0..nodes as u32).map(|i| root(&mut parent, i)).collect()
}

/// The root of a node's part, shortening the path to it.
fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}
