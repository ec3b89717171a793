//! The lines of a set in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use super::error::{FILE, ORIGINAL, VictoriaError, VictoriaReason};

/// Motion from one pose to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Odometry {
    /// Number of the pose before.
    pub from: u64,
    /// Number of the pose behind.
    pub to: u64,
    /// The second in the frame of the first.
    pub motion: Isometry3<f64>,
    /// Covariance of x, y and heading in the axes of the second \[m, m, rad\].
    pub covariance: Matrix3<f64>,
}

/// A tree that was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Number of the pose that saw it.
    pub pose: u64,
    /// Number of the tree.
    pub landmark: u64,
    /// Where, in the plane of the pose \[m\].
    pub position: Vector2<f64>,
    /// Covariance in the axes of the pose \[m²\].
    pub covariance: Matrix2<f64>,
}

/// A set.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Victoria {
    pub(super) odometry: Vec<Odometry>,
    pub(super) sightings: Vec<Sighting>,
}

impl Victoria {
    /// Reads a file, or `victoria_park.txt` of a directory.
    ///
    /// # Errors
    /// The file cannot be read or is not of the format.
    pub fn load(path: &Path) -> Result<Self, VictoriaError> {
        let mut file = path.to_owned();
        if path.is_dir() {
            file.push(FILE);
            if !file.exists() && path.join(ORIGINAL).exists() {
                return Err(VictoriaError::Original(path.to_owned()));
            }
        }
        match fs::read_to_string(&file) {
            Ok(text) => Self::read(&text).map_err(|error| VictoriaError::Text {
                file,
                source: Box::new(error),
            }),
            Err(source) => Err(VictoriaError::Io { file, source }),
        }
    }

    /// Reads a text.
    ///
    /// # Errors
    /// A line makes no sense, or there is no odometry.
    pub fn read(text: &str) -> Result<Self, VictoriaError> {
        let mut set = Self::default();
        let mut is_landmark = BTreeMap::new();
        for (index, line) in text.lines().enumerate() {
            let content = line.split('#').next().unwrap_or_default();
            let columns: Vec<&str> = content.split_whitespace().collect();
            if !columns.is_empty() {
                set.line(&columns, &mut is_landmark)
                    .map_err(|reason| VictoriaError::Line {
                        line: index + 1,
                        reason,
                    })?;
            }
        }
        set.check()?;
        Ok(set)
    }

    /// One way through all poses, and sightings from it.
    fn check(&self) -> Result<(), VictoriaError> {
        let first = self.odometry.first().ok_or(VictoriaError::NoOdometry)?;
        let mut reached = BTreeSet::from([first.from]);
        let mut at = first.from;
        for &Odometry { from, to, .. } in &self.odometry {
            if from != at || to <= from {
                return Err(VictoriaError::Apart { from, to });
            }
            reached.insert(to);
            at = to;
        }
        match self
            .sightings
            .iter()
            .find(|seen| !reached.contains(&seen.pose))
        {
            Some(seen) => Err(VictoriaError::Unreached(seen.pose)),
            None => Ok(()),
        }
    }

    /// Motion, in the order of the file.
    pub fn odometry(&self) -> &[Odometry] {
        &self.odometry
    }

    /// Sightings, in the order of the file.
    pub fn sightings(&self) -> &[Sighting] {
        &self.sightings
    }

    fn line(
        &mut self,
        columns: &[&str],
        is_landmark: &mut BTreeMap<u64, bool>,
    ) -> Result<(), VictoriaReason> {
        let mut node = |column, landmark| {
            let id = id(columns, column)?;
            if *is_landmark.entry(id).or_insert(landmark) == landmark {
                Ok(id)
            } else {
                Err(VictoriaReason::PoseAndLandmark(id))
            }
        };
        match columns[0] {
            "ODOMETRY" => {
                let [x, y, heading, xx, xy, xt, yy, yt, tt] = numbers::<9>(columns)?;
                let (from, to) = (node(1, false)?, node(2, false)?);
                if from == to {
                    return Err(VictoriaReason::Loop);
                }
                self.odometry.push(Odometry {
                    from,
                    to,
                    motion: Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * heading),
                    covariance: positive(Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt))?,
                });
            }
            "LANDMARK" => {
                let [x, y, xx, xy, yy] = numbers::<5>(columns)?;
                self.sightings.push(Sighting {
                    pose: node(1, false)?,
                    landmark: node(2, true)?,
                    position: Vector2::new(x, y),
                    covariance: positive(Matrix2::new(xx, xy, xy, yy))?,
                });
            }
            other => return Err(VictoriaReason::Kind(other.to_owned())),
        }
        Ok(())
    }
}

/// A covariance, if it is one.
fn positive<const N: usize>(
    covariance: SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, VictoriaReason> {
    match covariance.cholesky() {
        Some(_) => Ok(covariance),
        None => Err(VictoriaReason::Covariance),
    }
}

/// The `N` numbers behind the two nodes, which end the line.
fn numbers<const N: usize>(columns: &[&str]) -> Result<[f64; N], VictoriaReason> {
    let expected = 3 + N;
    if columns.len() != expected {
        let found = columns.len();
        return Err(VictoriaReason::Columns { expected, found });
    }
    let mut numbers = [0.0; N];
    for (k, number) in numbers.iter_mut().enumerate() {
        let parsed = columns[3 + k].parse::<f64>().ok();
        let finite = parsed.filter(|number| number.is_finite());
        *number = finite.ok_or(VictoriaReason::NotANumber { column: k + 4 })?;
    }
    Ok(numbers)
}

fn id(columns: &[&str], column: usize) -> Result<u64, VictoriaReason> {
    let id = columns.get(column).and_then(|text| text.parse().ok());
    id.ok_or(VictoriaReason::NotAnId { column: column + 1 })
}
