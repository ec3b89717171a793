//! The lines of a data set in memory.

use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Vector3, Vector6};

use super::error::{TucError, TucReason};
use trajectory::{StampedPosition, Trajectory, parse_seconds};

/// One step of odometry.
#[derive(Clone, Debug, PartialEq)]
pub struct OdometryStep {
    /// When it ended.
    pub stamp_ns: i64,
    /// The motion since the step before, in the frame of the body at that moment.
    pub motion: Isometry3<f64>,
    /// Its velocity \[m/s\] and angular velocity \[rad/s\] …
    pub velocity: [Vector3<f64>; 2],
    /// … and how long it was held \[s\].
    pub duration_s: f64,
    /// Standard deviations of its errors \[m, m, m, rad, rad, rad\], zero across the plane.
    pub noise_sd: Vector6<f64>,
}

/// Two moments at which the robot was taken to be at the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// The later moment.
    pub later_ns: i64,
    /// The earlier moment.
    pub earlier_ns: i64,
    /// How alike they looked, from 0 to 1.
    pub score: f64,
}

/// A data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuc {
    steps: Vec<OdometryStep>,
    matches: Vec<Match>,
    truth: Trajectory,
    start: Isometry3<f64>,
}

impl Tuc {
    /// Reads the files `*_Input.txt` and `*_GT.txt` of a directory.
    ///
    /// # Errors
    /// A file is absent or cannot be read, or as [`Tuc::read`].
    pub fn load(directory: &Path) -> Result<Self, TucError> {
        let (input_file, input) = text_of(directory, "_Input.txt")?;
        let (truth_file, truth) = text_of(directory, "_GT.txt")?;
        let in_file = |file: &str| {
            let file = file.to_owned();
            |source| TucError::Text {
                file,
                source: Box::new(source),
            }
        };
        let (steps, matches) = read_input(&input).map_err(in_file(&input_file))?;
        let begin_ns = steps[0].stamp_ns;
        let (truth, start) = read_truth(&truth, begin_ns).map_err(in_file(&truth_file))?;
        Ok(Self {
            steps,
            matches,
            truth,
            start,
        })
    }

    /// Reads the two texts.
    ///
    /// # Errors
    /// A line makes no sense, or there is no odometry or no truth.
    pub fn read(input: &str, truth: &str) -> Result<Self, TucError> {
        let (steps, matches) = read_input(input)?;
        let (truth, start) = read_truth(truth, steps[0].stamp_ns)?;
        Ok(Self {
            steps,
            matches,
            truth,
            start,
        })
    }

    /// Odometry in order of time. The first step has no motion: it says where the robot's clock
    /// began.
    pub fn steps(&self) -> &[OdometryStep] {
        &self.steps
    }

    /// The step that ended next to a moment; of two equally near ones the earlier.
    ///
    /// # Panics
    /// The set has no odometry, which reading refuses.
    pub fn step_at(&self, stamp_ns: i64) -> usize {
        let after = self.steps.partition_point(|step| step.stamp_ns < stamp_ns);
        let candidates = after.saturating_sub(1)..(after + 1).min(self.steps.len());
        let nearest = candidates.min_by_key(|&step| self.steps[step].stamp_ns.abs_diff(stamp_ns));
        nearest.expect("a set has odometry")
    }

    /// Place matches in the order of the file.
    pub fn matches(&self) -> &[Match] {
        &self.matches
    }

    /// The robot's true pose at the first step.
    pub fn start(&self) -> &Isometry3<f64> {
        &self.start
    }

    /// Where the robot was.
    pub fn truth(&self) -> &Trajectory {
        &self.truth
    }
}

/// Odometry, at least one step of it, and matches.
fn read_input(text: &str) -> Result<(Vec<OdometryStep>, Vec<Match>), TucError> {
    let mut steps: Vec<OdometryStep> = Vec::new();
    let mut matches = Vec::new();
    for_each_line(text, |columns| {
        match columns[0] {
            "odom2" => steps.push(step(columns, steps.last().map(|step| step.stamp_ns))?),
            "loop" => matches.push(place_match(columns)?),
            _ => {}
        }
        Ok(())
    })?;
    if steps.is_empty() {
        return Err(TucError::NoOdometry);
    }
    Ok((steps, matches))
}

/// The true positions, and the true pose at a moment.
fn read_truth(text: &str, begin_ns: i64) -> Result<(Trajectory, Isometry3<f64>), TucError> {
    let mut positions = Vec::new();
    // The heading next to the moment; of two equally near ones the earlier.
    let mut heading: Option<(u64, f64)> = None;
    for_each_line(text, |columns| {
        if columns[0] == "point2" {
            require(columns, 4)?;
            let position_m = Vector3::new(number(columns, 2)?, number(columns, 3)?, 0.0);
            positions.push(StampedPosition {
                stamp_ns: parse_seconds(columns[1])?,
                position_m,
            });
        }
        if columns[0] == "angle" {
            require(columns, 3)?;
            let apart = parse_seconds(columns[1])?.abs_diff(begin_ns);
            if heading.is_none_or(|(nearest, _)| apart < nearest) {
                heading = Some((apart, number(columns, 2)?));
            }
        }
        Ok(())
    })?;
    let truth = Trajectory::new(positions)?;
    let position = truth.at(begin_ns);
    let position = position.unwrap_or_else(|| truth.positions()[0].position_m);
    let turn = heading.map_or(0.0, |(_, heading)| heading);
    let start = Isometry3::new(position, Vector3::z() * turn);
    Ok((truth, start))
}

/// Name and text of the first file with an ending, in the order of their names.
fn text_of(directory: &Path, ending: &'static str) -> Result<(String, String), TucError> {
    let io_error = |source| TucError::Io {
        file: directory.display().to_string(),
        source,
    };
    let entries = fs::read_dir(directory).map_err(io_error)?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(io_error)?.path();
        if path.to_string_lossy().ends_with(ending) {
            paths.push(path);
        }
    }
    paths.sort();
    let path = paths.first().ok_or(TucError::Absent(ending))?;
    let file = path.display().to_string();
    match fs::read_to_string(path) {
        Ok(text) => Ok((file, text)),
        Err(source) => Err(TucError::Io { file, source }),
    }
}

/// Hands out the columns of each line that has any.
fn for_each_line(
    text: &str,
    mut each: impl FnMut(&[&str]) -> Result<(), TucReason>,
) -> Result<(), TucError> {
    for (index, line) in text.lines().enumerate() {
        let columns: Vec<&str> = line.split_whitespace().collect();
        if !columns.is_empty() {
            each(&columns).map_err(|reason| TucError::Line {
                line: index + 1,
                reason,
            })?;
        }
    }
    Ok(())
}

fn step(columns: &[&str], before_ns: Option<i64>) -> Result<OdometryStep, TucReason> {
    require(columns, 8)?;
    let stamp_ns = parse_seconds(columns[1])?;
    if before_ns.is_some_and(|before_ns| stamp_ns <= before_ns) {
        return Err(TucReason::NotLater);
    }
    let mut numbers = [0.0; 6];
    for (k, number_k) in numbers.iter_mut().enumerate() {
        *number_k = number(columns, k + 2)?;
    }
    let [forward, left, turn, variances @ ..] = numbers;
    if variances.iter().any(|variance| *variance < 0.0) {
        return Err(TucReason::NegativeVariance);
    }
    let duration_s = before_ns.map_or(0.0, |before_ns| (stamp_ns - before_ns) as f64 * 1e-9);
    let linear = Vector3::new(forward, left, 0.0);
    let angular = Vector3::new(0.0, 0.0, turn);
    let sd = variances.map(|variance: f64| variance.sqrt() * duration_s);
    Ok(OdometryStep {
        stamp_ns,
        motion: geometry::se3::exp(&(linear * duration_s), &(angular * duration_s)),
        velocity: [linear, angular],
        duration_s,
        noise_sd: Vector6::new(sd[0], sd[1], 0.0, 0.0, 0.0, sd[2]),
    })
}

fn place_match(columns: &[&str]) -> Result<Match, TucReason> {
    require(columns, 4)?;
    let (a, b) = (parse_seconds(columns[1])?, parse_seconds(columns[2])?);
    Ok(Match {
        later_ns: a.max(b),
        earlier_ns: a.min(b),
        score: number(columns, 3)?,
    })
}

fn require(columns: &[&str], expected: usize) -> Result<(), TucReason> {
    if columns.len() < expected {
        return Err(TucReason::Columns {
            expected,
            found: columns.len(),
        });
    }
    Ok(())
}

fn number(columns: &[&str], column: usize) -> Result<f64, TucReason> {
    let number = columns[column]
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite());
    number.ok_or(TucReason::NotANumber { column: column + 1 })
}
