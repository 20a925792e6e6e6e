//! Priorities of transitions (Schaul et al. 2016).

/// A binary tree whose leaves are priorities and whose inner nodes are the sums of what is below
/// them: a leaf is changed, or drawn in proportion to its priority, in the time of the tree's height.
#[derive(Debug, Clone)]
pub struct SumTree {
    /// The root is at 1, the children of `i` are at `2 i` and `2 i + 1`.
    nodes: Vec<f64>,
    /// Number of leaves, a power of two.
    n_leaves: usize,
    /// The largest priority there was.
    largest: f64,
}

impl SumTree {
    /// For `capacity` transitions, all of priority 0.
    pub fn new(capacity: usize) -> Self {
        let n_leaves = capacity.next_power_of_two();
        Self { nodes: vec![0.0; 2 * n_leaves], n_leaves, largest: 1.0 }
    }

    /// The sum of all priorities.
    pub fn total(&self) -> f64 {
        self.nodes[1]
    }

    /// The largest priority that was ever set, 1 at first: what a new transition is given.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// The priority of the transition at `place`.
    #[inline]
    pub fn get(&self, place: usize) -> f64 {
        self.nodes[self.n_leaves + place]
    }

    /// Sets the priority of the transition at `place`.
    #[inline]
    pub fn set(&mut self, place: usize, priority: f64) {
        self.largest = self.largest.max(priority);
        let mut i = self.n_leaves + place;
        self.nodes[i] = priority;
        // Sums are made anew, so that no error of rounding adds up.
        while i > 1 {
            i /= 2;
            self.nodes[i] = self.nodes[2 * i] + self.nodes[2 * i + 1];
        }
    }

    /// The first transition at which the running sum of priorities exceeds `mass`, which is below
    /// [`Self::total`]; the last of the `len` that there are if rounding would lead beyond it.
    #[inline]
    pub fn find(&self, mut mass: f64, len: usize) -> usize {
        let mut i = 1;
        while i < self.n_leaves {
            i *= 2;
            if mass >= self.nodes[i] && self.nodes[i + 1] > 0.0 {
                mass -= self.nodes[i];
                i += 1;
            }
        }
        (i - self.n_leaves).min(len - 1)
    }

    /// The priorities of the first `len` transitions, and the largest there was.
    pub fn state(&self, len: usize) -> (&[f64], f64) {
        (&self.nodes[self.n_leaves..][..len], self.largest)
    }

    /// As it was in [`Self::state`]; `None` if there is no room.
    pub fn restore(&mut self, priorities: &[f64], largest: f64) -> Option<()> {
        let leaves = self.nodes[self.n_leaves..].get_mut(..priorities.len())?;
        leaves.copy_from_slice(priorities);
        for i in (1..self.n_leaves).rev() {
            self.nodes[i] = self.nodes[2 * i] + self.nodes[2 * i + 1];
        }
        self.largest = largest;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let mut tree = SumTree::new(5);
        for (place, priority) in [1.0, 2.0, 0.5, 4.0, 0.25].into_iter().enumerate() {
            tree.set(place, priority);
        }
        assert_eq!((tree.total(), tree.largest(), tree.get(3)), (7.75, 4.0, 4.0));
        let found = [0.0, 0.99, 1.0, 2.99, 3.0, 3.49, 3.5, 7.49, 7.5, 7.74];
        assert_eq!(found.map(|mass| tree.find(mass, 5)), [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]);
        tree.set(3, 0.0);
        assert_eq!((tree.total(), tree.largest(), tree.find(3.6, 5)), (3.75, 4.0, 4));
    }

    #[test]
    fn a_leaf_without_priority_is_never_drawn() {
        let mut tree = SumTree::new(4);
        tree.set(1, 0.3);
        for mass in [0.0, 0.1, 0.3, 0.4] {
            assert_eq!(tree.find(mass, 4), 1);
        }
    }

    #[test]
    fn restoring_gives_the_same_sums() {
        let mut tree = SumTree::new(7);
        for place in 0..6 {
            tree.set(place, 0.1 * (place + 1) as f64);
        }
        let (priorities, largest) = tree.state(6);
        let mut other = SumTree::new(7);
        other.restore(priorities, largest).unwrap();
        assert_eq!((other.nodes, other.largest), (tree.nodes.clone(), tree.largest));
        assert!(SumTree::new(2).restore(priorities, largest).is_none());
    }
}
