//! Where poses without stamps are known to lie.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// Positions by the id of the pose: a text with id, x, y and, in space, z \[m\] in columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference(BTreeMap<u64, Vector3<f64>>);

/// Why a text has no positions.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReferenceError {
    /// A line is not an id with two or three numbers.
    #[error("line {line}: expected a node's id and two or three finite coordinates")]
    Line {
        /// Number of the line, from 1.
        line: usize,
    },
    /// No pose has a position.
    #[error("it has no position of any of the poses")]
    NothingInCommon,
}

impl Reference {
    /// Reads a text. What follows a `#` is a comment.
    ///
    /// # Errors
    /// A line is not as it should be.
    pub fn read(text: &str) -> Result<Self, ReferenceError> {
        let mut positions = BTreeMap::new();
        for (index, line) in text.lines().enumerate() {
            let bad = ReferenceError::Line { line: index + 1 };
            let content = line.split('#').next().unwrap_or_default();
            let mut columns = content.split_whitespace();
            let Some(id) = columns.next() else { continue };
            let id = id.parse().map_err(|_| bad.clone())?;
            let numbers: Result<Vec<f64>, _> = columns.map(str::parse).collect();
            let numbers = numbers.map_err(|_| bad.clone())?;
            if !(2..=3).contains(&numbers.len()) || numbers.iter().any(|x| !x.is_finite()) {
                return Err(bad);
            }
            let z = numbers.get(2).copied().unwrap_or(0.0);
            positions.insert(id, Vector3::new(numbers[0], numbers[1], z));
        }
        Ok(Self(positions))
    }

    /// For each pose its position, if there is one.
    ///
    /// # Errors
    /// There is none for any.
    pub fn of(
        &self,
        poses: impl IntoIterator<Item = u64>,
    ) -> Result<Vec<Option<Vector3<f64>>>, ReferenceError> {
        let positions: Vec<_> = poses
            .into_iter()
            .map(|id| self.0.get(&id).copied())
            .collect();
        if positions.iter().all(Option::is_none) {
            return Err(ReferenceError::NothingInCommon);
        }
        Ok(positions)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::{Reference, ReferenceError};

    #[test]
    fn a_reference_is_read_by_id() {
        let reference = Reference::read("# id x y\n5 1 2\n0 0 0 3 # first\n77 1 1\n").unwrap();
        let positions = reference.of(0..6).unwrap();
        assert_eq!(positions[0], Some(Vector3::new(0.0, 0.0, 3.0)));
        assert_eq!(positions[1], None);
        assert_eq!(positions[5], Some(Vector3::new(1.0, 2.0, 0.0)));
        for bad in ["0 1", "0 1 x", "x 1 2", "0 1 2 3 4", "0 1 inf"] {
            let text = format!("# id\n{bad}\n");
            assert_eq!(
                Reference::read(&text),
                Err(ReferenceError::Line { line: 2 }),
                "{bad}"
            );
        }
        let elsewhere = Reference::read("99 0 0").unwrap();
        assert_eq!(elsewhere.of(0..6), Err(ReferenceError::NothingInCommon));
    }
}
