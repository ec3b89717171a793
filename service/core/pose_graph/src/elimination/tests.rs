//! Elimination against dense linear algebra, on random graphs.

use nalgebra::{DMatrix, DVector, Matrix6};
use proptest::prelude::*;

use super::{CliqueTree, Equations, Front, slot};

const AXES: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Variables of up to six unknowns with links between them.
#[derive(Clone, Debug)]
struct Graph {
    dimensions: Vec<usize>,
    links: Vec<(u32, u32)>,
    links_of: Vec<Vec<(u32, [u32; 2])>>,
}

impl Graph {
    fn new(dimensions: Vec<usize>, pairs: &[(usize, usize)]) -> Self {
        let n = dimensions.len();
        let links_of = vec![Vec::new(); n];
        let mut graph = Self {
            dimensions,
            links: Vec::new(),
            links_of,
        };
        for (a, b) in (0..n)
            .map(|k| (k, k))
            .chain(pairs.iter().map(|&(a, b)| (a % n, b % n)))
        {
            graph.link(u32::try_from(a).unwrap(), u32::try_from(b).unwrap());
        }
        graph
    }

    fn link(&mut self, a: u32, b: u32) {
        let id = u32::try_from(self.links.len()).unwrap();
        self.links.push((a, b));
        self.links_of[a as usize].push((id, [b; 2]));
        if a != b {
            self.links_of[b as usize].push((id, [a; 2]));
        }
    }

    /// An entry of a link's matrix: some number.
    fn entry(link: u32, row: usize, column: usize) -> f64 {
        ((f64::from(link) + 1.7) * (row as f64 + 2.3) * (column as f64 + 0.9)).sin()
    }

    /// The link's blocks (a, a), (b, a), (b, b): J Jᵀ of a random J, and more on the diagonal.
    fn blocks(link: u32) -> [Matrix6<f64>; 3] {
        let a = Matrix6::from_fn(|r, c| Self::entry(link, r, c));
        let b = Matrix6::from_fn(|r, c| Self::entry(link, r + 6, c));
        let more = Matrix6::identity() * 0.5;
        [
            a * a.transpose() + more,
            b * a.transpose(),
            b * b.transpose() + more,
        ]
    }

    fn axes(&self, variable: u32) -> &'static [usize] {
        &AXES[..self.dimensions[variable as usize]]
    }

    /// The same equations as one dense matrix, with the unknowns in the order of the variables.
    fn dense(&self) -> (DMatrix<f64>, DVector<f64>, Vec<usize>) {
        let mut starts = vec![0];
        for dimension in &self.dimensions {
            starts.push(starts.last().unwrap() + dimension);
        }
        let n = *starts.last().unwrap();
        let (mut matrix, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (id, &(a, b)) in (0..).zip(&self.links) {
            let [aa, ba, bb] = Self::blocks(id);
            let mut add = |row: u32, column: u32, block: &Matrix6<f64>| {
                for r in 0..self.dimensions[row as usize] {
                    for c in 0..self.dimensions[column as usize] {
                        let (r_at, c_at) = (starts[row as usize] + r, starts[column as usize] + c);
                        matrix[(r_at, c_at)] += block[(r, c)];
                    }
                }
            };
            add(a, a, &aa);
            if a != b {
                add(b, b, &bb);
                add(b, a, &ba);
                add(a, b, &ba.transpose());
            }
            for r in 0..self.dimensions[a as usize] {
                right[starts[a as usize] + r] += Self::entry(id, r, 7);
            }
        }
        (matrix, right, starts)
    }

    /// How far the tree's solution is from that of the dense equations.
    fn error(&self, tree: &CliqueTree) -> f64 {
        let (matrix, right, starts) = self.dense();
        let expected = matrix.cholesky().expect("positive").solve(&right);
        let solution = tree.solve();
        let mut error = 0.0_f64;
        for (variable, &dimension) in self.dimensions.iter().enumerate() {
            for k in 0..dimension {
                let found = solution[slot(variable, 0, 1) + k];
                error = error.max((found - expected[starts[variable] + k]).abs());
            }
        }
        error
    }
}

impl Equations for Graph {
    const N_RIGHT: usize = 1;

    fn dimension(&self, variable: u32) -> usize {
        self.dimensions[variable as usize]
    }

    fn links(&self, variable: u32) -> &[(u32, [u32; 2])] {
        &self.links_of[variable as usize]
    }

    fn add(&self, link: u32, front: &mut Front<'_>) {
        let (a, b) = self.links[link as usize];
        let [aa, ba, bb] = Self::blocks(link);
        let (a, b) = ((a, self.axes(a)), (b, self.axes(b)));
        front.add(a, a, &aa);
        if a.0 != b.0 {
            front.add(b, a, &ba);
            front.add(b, b, &bb);
        }
        let right: Vec<f64> = (0..6).map(|r| Self::entry(link, r, 7)).collect();
        front.add_right(a.0, a.1, 0, &right);
    }
}

fn graph() -> impl Strategy<Value = Graph> {
    let pairs = prop::collection::vec((0..60_usize, 0..60_usize), 0..150);
    (prop::collection::vec(0..=6_usize, 1..60), pairs)
        .prop_map(|(dimensions, pairs)| Graph::new(dimensions, &pairs))
}

proptest! {
    // Dense algebra on some hundred unknowns is slow without optimisation.
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn solutions_are_those_of_dense_algebra(graph in graph()) {
        let mut tree = CliqueTree::structured(&graph, graph.dimensions.len());
        prop_assert_eq!(tree.refactor(&graph, &tree.all()), 0);
        prop_assert!(graph.error(&tree) < 1e-9, "{}", graph.error(&tree));
    }

    #[test]
    fn marginals_are_blocks_of_the_inverse(graph in graph(), pair in (0..60_usize, 0..60_usize)) {
        let n = graph.dimensions.len();
        let mut tree = CliqueTree::structured(&graph, n);
        tree.refactor(&graph, &tree.all());
        let (matrix, _, starts) = graph.dense();
        let inverse = matrix.try_inverse().expect("positive");
        let (a, b) = (pair.0 % n, pair.1 % n);
        let half = |of: usize| {
            let variable = u32::try_from(of).unwrap();
            tree.half_solution(variable, graph.dimensions[of]).expect("determined")
        };
        let block = half(a).product(&half(b));
        for r in 0..graph.dimensions[a] {
            for c in 0..graph.dimensions[b] {
                let expected = inverse[(starts[a] + r, starts[b] + c)];
                prop_assert!((block[(r, c)] - expected).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn a_large_front_is_factored_as_a_small_one() {
    // Everything linked with everything: one dense front with a remainder in every blocking.
    for n in [3, 9, 23] {
        let pairs: Vec<_> = (0..n).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
        let graph = Graph::new((0..n).map(|k| 1 + k % 6).collect(), &pairs);
        let mut tree = CliqueTree::structured(&graph, n);
        tree.refactor(&graph, &tree.all());
        assert!(graph.error(&tree) < 1e-9);
    }
}
