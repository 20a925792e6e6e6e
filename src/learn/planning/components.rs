//! Strongly connected components (Tarjan 1972).

/// A directed graph's strongly connected components, those that others lead to first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// The nodes, component by component; within one, those that a depth-first search leaves first
    /// stand first.
    nodes: Vec<u32>,
    /// Where each component starts in `nodes`, and the end.
    offsets: Vec<u32>,
    /// The component of each node.
    of: Vec<u32>,
}

/// Not yet seen by the search, or not yet in a component.
const NONE: u32 = u32::MAX;

impl Components {
    /// Of the graph with nodes `0..n` and an edge from each to its `successors`.
    pub fn new<'a>(n: usize, successors: impl Fn(usize) -> &'a [u32]) -> Self {
        let mut search = Search {
            entered: vec![NONE; n],
            low: vec![0; n],
            left: vec![0; n],
            stack: Vec::new(),
            found: Self { nodes: Vec::with_capacity(n), offsets: vec![0], of: vec![NONE; n] },
        };
        let (mut clock, mut leavings) = (0, 0);
        // The path of the search: a node, and how many of its edges were followed.
        let mut path: Vec<(u32, u32)> = Vec::new();
        for root in 0..n as u32 {
            if search.entered[root as usize] == NONE {
                path.push((root, 0));
                search.enter(root, &mut clock);
            }
            while let Some((node, followed)) = path.last_mut() {
                let (from, edges) = (*node, successors(*node as usize));
                if let Some(&to) = edges.get(*followed as usize) {
                    *followed += 1;
                    if search.entered[to as usize] == NONE {
                        path.push((to, 0));
                        search.enter(to, &mut clock);
                    } else if search.found.of[to as usize] == NONE {
                        search.reaches(from, search.entered[to as usize]);
                    }
                } else {
                    path.pop();
                    search.left[from as usize] = leavings;
                    leavings += 1;
                    let low = search.low[from as usize];
                    if low == search.entered[from as usize] {
                        search.close(from);
                    }
                    if let Some(&(parent, _)) = path.last() {
                        search.reaches(parent, low);
                    }
                }
            }
        }
        search.found
    }

    /// Number of components.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there is none: the graph has no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The nodes of component `c`.
    pub fn nodes(&self, c: usize) -> &[u32] {
        &self.nodes[self.offsets[c] as usize..self.offsets[c + 1] as usize]
    }

    /// The component of `node`. No edge leads to one with a larger number.
    #[inline]
    pub fn of(&self, node: usize) -> usize {
        self.of[node] as usize
    }

    /// Every component in turn: one that others lead to before those.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|c| self.nodes(c))
    }
}

struct Search {
    entered: Vec<u32>,
    low: Vec<u32>,
    left: Vec<u32>,
    stack: Vec<u32>,
    found: Components,
}

impl Search {
    fn enter(&mut self, node: u32, clock: &mut u32) {
        self.entered[node as usize] = *clock;
        self.low[node as usize] = *clock;
        *clock += 1;
        self.stack.push(node);
    }

    fn reaches(&mut self, node: u32, entered: u32) {
        let low = &mut self.low[node as usize];
        *low = entered.min(*low);
    }

    /// The nodes above `root` on the stack, and itself, are a component.
    fn close(&mut self, root: u32) {
        let c = self.found.len() as u32;
        let first = self.found.nodes.len();
        loop {
            let node = self.stack.pop().expect("the root is on the stack");
            self.found.of[node as usize] = c;
            self.found.nodes.push(node);
            if node == root {
                break;
            }
        }
        let left = &self.left;
        self.found.nodes[first..].sort_unstable_by_key(|&node| left[node as usize]);
        self.found.offsets.push(self.found.nodes.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn components(edges: &[&[u32]]) -> Vec<Vec<u32>> {
        let found = Components::new(edges.len(), |node| edges[node]);
        let mut all: Vec<Vec<u32>> = found.iter().map(<[u32]>::to_vec).collect();
        for (c, nodes) in all.iter_mut().enumerate() {
            for &node in nodes.iter() {
                assert_eq!(found.of(node as usize), c);
                for &to in edges[node as usize] {
                    assert!(found.of(to as usize) <= c, "{node} -> {to} goes forward");
                }
            }
            nodes.sort_unstable();
        }
        all
    }

    /// The example of Tarjan's paper (figure 3), its vertices from 0.
    #[test]
    fn tarjans_own_graph() {
        let edges: [&[u32]; 8] = [&[1], &[2, 7], &[3, 6], &[4], &[2, 5], &[], &[3, 5], &[0, 6]];
        assert_eq!(components(&edges), [vec![5], vec![2, 3, 4, 6], vec![0, 1, 7]]);
    }

    #[test]
    fn a_chain_and_loops() {
        assert_eq!(components(&[&[1], &[2], &[]]), [[2], [1], [0]]);
        assert_eq!(components(&[&[0], &[1, 0]]), [[0], [1]]);
        assert_eq!(components(&[&[1], &[2], &[0]]), [[0, 1, 2]]);
    }
}
