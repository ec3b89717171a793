//! The lines of a set in memory.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix2, Matrix3, Matrix6, Vector3};
use pose_graph::{InvalidInformation, PoseInformation, PositionInformation};

/// Name of the file in a directory.
const FILE: &str = "victoria_park.txt";

/// A file of the original set, which is not read.
const ORIGINAL: &str = "aa3_dr.mat";

/// Motion from one pose to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Odometry {
    /// Number of the pose before.
    pub from: u64,
    /// Number of the pose behind.
    pub to: u64,
    /// The second in the frame of the first.
    pub motion: Isometry3<f64>,
    /// Information in the axes of the second.
    pub information: PoseInformation,
}

/// A tree that was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Number of the pose that saw it.
    pub pose: u64,
    /// Number of the tree.
    pub landmark: u64,
    /// Where, in the frame of the pose \[m\].
    pub position: Vector3<f64>,
    /// Information in the axes of the pose.
    pub information: PositionInformation,
}

/// A set.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Victoria {
    pub(super) odometry: Vec<Odometry>,
    pub(super) sightings: Vec<Sighting>,
}

/// Why a set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum VictoriaError {
    /// A file cannot be read.
    #[error("read {}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// Only the original form is there.
    #[error(
        "{} holds the original set ({ORIGINAL} and others), which is not read; its text form {FILE} is",
        .0.display()
    )]
    Original(PathBuf),
    /// A line makes no sense.
    #[error("line {line}: {reason}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: VictoriaReason,
    },
    /// The text is not that of a set.
    #[error("{}", file.display())]
    Text {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Box<Self>,
    },
    /// There is no motion.
    #[error("there is no odometry")]
    NoOdometry,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VictoriaReason {
    /// Another kind of line.
    #[error("lines of the kind {0:?} are not read")]
    Kind(String),
    /// Another number of columns.
    #[error("expected {expected} columns, found {found}")]
    Columns {
        /// As the format says.
        expected: usize,
        /// In the line.
        found: usize,
    },
    /// A column is not a finite number.
    #[error("column {column} is not a finite number")]
    NotANumber {
        /// Number of the column, from 1.
        column: usize,
    },
    /// A column is no number of a pose or landmark.
    #[error("column {column} is not a whole number")]
    NotAnId {
        /// Number of the column, from 1.
        column: usize,
    },
    /// Motion that ends where it begins.
    #[error("the motion joins a pose with itself")]
    Loop,
    /// A number that was a pose before is a landmark here, or the other way round.
    #[error("{0} is a pose in one line and a landmark in another")]
    PoseAndLandmark(u64),
    /// The covariance makes no sense.
    #[error(transparent)]
    Covariance(#[from] InvalidInformation),
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
        if set.odometry.is_empty() {
            return Err(VictoriaError::NoOdometry);
        }
        Ok(set)
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
                let [x, y, heading, covariance @ ..] = numbers::<9>(columns)?;
                let (from, to) = (node(1, false)?, node(2, false)?);
                if from == to {
                    return Err(VictoriaReason::Loop);
                }
                self.odometry.push(Odometry {
                    from,
                    to,
                    motion: Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * heading),
                    information: pose_information(&covariance)?,
                });
            }
            "LANDMARK" => {
                let [x, y, xx, xy, yy] = numbers::<5>(columns)?;
                self.sightings.push(Sighting {
                    pose: node(1, false)?,
                    landmark: node(2, true)?,
                    position: Vector3::new(x, y, 0.0),
                    information: position_information(&Matrix2::new(xx, xy, xy, yy))?,
                });
            }
            other => return Err(VictoriaReason::Kind(other.to_owned())),
        }
        Ok(())
    }
}

/// The inverse of a planar covariance, and nothing about the other directions.
fn pose_information(upper_triangle: &[f64; 6]) -> Result<PoseInformation, InvalidInformation> {
    let [xx, xy, xt, yy, yt, tt] = *upper_triangle;
    let inverse = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
        .cholesky()
        .ok_or(InvalidInformation::Singular)?
        .inverse();
    let mut matrix = Matrix6::zeros();
    for (r, row) in [0, 1, 5].into_iter().enumerate() {
        for (c, column) in [0, 1, 5].into_iter().enumerate() {
            matrix[(row, column)] = inverse[(r, c)];
        }
    }
    PoseInformation::new(&matrix)
}

fn position_information(
    covariance: &Matrix2<f64>,
) -> Result<PositionInformation, InvalidInformation> {
    let inverse = covariance
        .cholesky()
        .ok_or(InvalidInformation::Singular)?
        .inverse();
    let mut matrix = Matrix3::zeros();
    matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(&inverse);
    PositionInformation::new(&matrix)
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
