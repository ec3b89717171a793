//! Numbers of particles: how they are drawn, and how they are held.

use random::Seeded;

/// Two numbers of mean 0 and variance 1, nearly normal: sums of three uniform ones (Irwin & Hall
/// 1927), since logarithms and cosines would be most of the cost of a step.
pub(crate) fn pair(draws: &mut Seeded) -> [f64; 2] {
    [(); 2].map(|()| {
        let sum = draws.uniform() + draws.uniform() + draws.uniform();
        2.0 * (sum - 1.5)
    })
}

/// As a particle holds them.
#[expect(
    clippy::cast_possible_truncation,
    reason = "metres and radians, to seven digits"
)]
pub(crate) fn floats<const N: usize>(numbers: [f64; N]) -> [f32; N] {
    numbers.map(|number| number as f32)
}
