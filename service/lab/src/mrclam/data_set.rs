//! The tables of a data set in memory.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;

use super::error::{MrclamError, RowReason};
use super::robot::{Command, Measurement, PlanarPose, RobotLog};
use super::table::rows;
use trajectory::Span;

/// First subject number that is a landmark; those below are robots.
pub(super) const FIRST_LANDMARK: u32 = 6;

/// A data set: the robots which have both odometry and truth, and the surveyed landmarks.
#[derive(Clone, Debug, PartialEq)]
pub struct Mrclam {
    robots: BTreeMap<u32, RobotLog>,
    landmarks: BTreeMap<u32, [f64; 2]>,
    n_unknown_barcodes: usize,
    span: Span,
}

impl Mrclam {
    /// Reads a directory.
    ///
    /// # Errors
    /// A file cannot be read, or as [`Mrclam::read`].
    pub fn load(directory: &Path) -> Result<Self, MrclamError> {
        Self::read(|file| match fs::read_to_string(directory.join(file)) {
            Ok(text) => Ok(Some(text)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        })
    }

    /// Reads the tables from wherever `text_of` finds them; `None` stands for an absent file.
    ///
    /// # Errors
    /// `Barcodes.dat` is absent, a line is no row of its table, no robot has both odometry and
    /// truth, one of these tables is empty, or they have no time in common.
    pub fn read(text_of: impl Fn(&str) -> io::Result<Option<String>>) -> Result<Self, MrclamError> {
        let text_of = |file: &str| {
            text_of(file).map_err(|source| MrclamError::Io {
                file: file.to_owned(),
                source,
            })
        };
        let subjects = barcodes(&text_of)?;
        let landmarks = landmarks(&text_of)?;
        let mut robots = BTreeMap::new();
        let mut n_unknown_barcodes = 0;
        for robot in 1..FIRST_LANDMARK {
            if let Some((log, n_unknown)) = robot_log(robot, &subjects, &text_of)? {
                n_unknown_barcodes += n_unknown;
                robots.insert(robot, log);
            }
        }
        if robots.is_empty() {
            return Err(MrclamError::NoRobot);
        }
        let spans = robots.values().flat_map(RobotLog::spans);
        let span = Span::common(spans).ok_or(MrclamError::NoCommonSpan)?;
        Ok(Self {
            robots,
            landmarks,
            n_unknown_barcodes,
            span,
        })
    }

    /// The robots by number.
    pub fn robots(&self) -> &BTreeMap<u32, RobotLog> {
        &self.robots
    }

    /// The same, to be changed.
    pub(super) fn robots_mut(&mut self) -> &mut BTreeMap<u32, RobotLog> {
        &mut self.robots
    }

    /// Surveyed positions of the landmarks by subject number \[m\]. For scoring only: a map that is
    /// given them has nothing left to learn.
    pub fn landmarks(&self) -> &BTreeMap<u32, [f64; 2]> {
        &self.landmarks
    }

    /// How many measurements carried a barcode that is in no table (misreads) and were dropped.
    pub fn n_unknown_barcodes(&self) -> usize {
        self.n_unknown_barcodes
    }

    /// The time which the odometry and the truth of all robots cover.
    pub fn span(&self) -> Span {
        self.span
    }
}

/// Rows in order of time; rows of one time stay in the order of the file.
fn sorted<T>(mut rows: Vec<T>, stamp_ns: impl Fn(&T) -> i64) -> Vec<T> {
    rows.sort_by_key(stamp_ns);
    rows
}

/// What a robot recorded, and how many of its sightings are of unknown barcodes; none where its
/// odometry or its truth is not there.
fn robot_log(
    robot: u32,
    subjects: &BTreeMap<u32, u32>,
    text_of: &impl Fn(&str) -> Result<Option<String>, MrclamError>,
) -> Result<Option<(RobotLog, usize)>, MrclamError> {
    let odometry_file = format!("Robot{robot}_Odometry.dat");
    let truth_file = format!("Robot{robot}_Groundtruth.dat");
    let (Some(odometry), Some(truth)) = (text_of(&odometry_file)?, text_of(&truth_file)?) else {
        return Ok(None);
    };
    let odometry = sorted(odometry_rows(&odometry_file, &odometry)?, |row| {
        row.stamp_ns
    });
    let truth = sorted(truth_rows(&truth_file, &truth)?, |row| row.stamp_ns);
    for (file, is_empty) in [
        (odometry_file, odometry.is_empty()),
        (truth_file, truth.is_empty()),
    ] {
        if is_empty {
            return Err(MrclamError::Empty { file });
        }
    }
    let file = format!("Robot{robot}_Measurement.dat");
    let seen = measurement_rows(&file, &text_of(&file)?.unwrap_or_default(), subjects)?;
    let n_rows = seen.len();
    let known: Vec<Measurement> = seen.into_iter().flatten().collect();
    let n_unknown = n_rows - known.len();
    let log = RobotLog {
        odometry,
        measurements: sorted(known, |row| row.stamp_ns),
        truth,
    };
    Ok(Some((log, n_unknown)))
}

impl RobotLog {
    /// Times over which the odometry and the truth reach.
    fn spans(&self) -> [Span; 2] {
        let (o, g) = (&self.odometry, &self.truth);
        [
            Span {
                start_ns: o[0].stamp_ns,
                end_ns: o[o.len() - 1].stamp_ns,
            },
            Span {
                start_ns: g[0].stamp_ns,
                end_ns: g[g.len() - 1].stamp_ns,
            },
        ]
    }
}

/// The subject of each barcode.
fn barcodes(
    text_of: &impl Fn(&str) -> Result<Option<String>, MrclamError>,
) -> Result<BTreeMap<u32, u32>, MrclamError> {
    let file = "Barcodes.dat";
    let text = text_of(file)?.ok_or_else(|| MrclamError::Absent {
        file: file.to_owned(),
    })?;
    let mut subjects = BTreeMap::new();
    rows::<2, ()>(file, &text, |row| {
        let (subject, barcode) = (row.count(0)?, row.count(1)?);
        match subjects.insert(barcode, subject) {
            Some(other) if other != subject => Err(RowReason::SharedBarcode),
            _ => Ok(()),
        }
    })?;
    Ok(subjects)
}

/// The surveyed position of each landmark.
fn landmarks(
    text_of: &impl Fn(&str) -> Result<Option<String>, MrclamError>,
) -> Result<BTreeMap<u32, [f64; 2]>, MrclamError> {
    let file = "Landmark_Groundtruth.dat";
    let text = text_of(file)?.unwrap_or_default();
    let table = rows::<5, _>(file, &text, |row| {
        Ok((row.count(0)?, [row.number(1)?, row.number(2)?]))
    })?;
    Ok(table.into_iter().collect())
}

fn odometry_rows(file: &str, text: &str) -> Result<Vec<Command>, MrclamError> {
    rows::<3, _>(file, text, |row| {
        Ok(Command {
            stamp_ns: row.stamp_ns()?,
            forward_m_s: row.number(1)?,
            turn_rad_s: row.number(2)?,
        })
    })
}

fn truth_rows(file: &str, text: &str) -> Result<Vec<PlanarPose>, MrclamError> {
    rows::<4, _>(file, text, |row| {
        Ok(PlanarPose {
            stamp_ns: row.stamp_ns()?,
            x_m: row.number(1)?,
            y_m: row.number(2)?,
            heading_rad: row.number(3)?,
        })
    })
}

/// Measurements; `None` where the barcode is in no table.
fn measurement_rows(
    file: &str,
    text: &str,
    subjects: &BTreeMap<u32, u32>,
) -> Result<Vec<Option<Measurement>>, MrclamError> {
    rows::<4, _>(file, text, |row| {
        let (stamp_ns, barcode) = (row.stamp_ns()?, row.count(1)?);
        let (range_m, bearing_rad) = (row.number(2)?, row.number(3)?);
        if range_m < 0.0 {
            return Err(RowReason::NegativeRange);
        }
        let measurement = |&subject| Measurement {
            stamp_ns,
            subject,
            range_m,
            bearing_rad,
        };
        Ok(subjects.get(&barcode).map(measurement))
    })
}
