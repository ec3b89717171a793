//! Touched objects in memory.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

/// First line of every file.
const HEADER: &str = "x_mm,y_mm,z_mm,level";
/// Ending of the files.
const EXTENSION: &str = "csv";
/// Metres in a millimetre.
const M_PER_MM: f64 = 1e-3;

/// One touch of an object's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Where, in the object's own frame \[m\].
    pub position_m: Point3<f64>,
    /// What was felt there, in the unit of the file.
    pub level: f64,
}

/// One object and all its touches.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchedObject {
    /// Name of its file, without the ending.
    pub name: String,
    /// The touches, in the order of the file; at least one.
    pub touches: Vec<Touch>,
}

/// A data set.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchSet {
    objects: Vec<TouchedObject>,
}

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TouchError {
    /// A file cannot be read.
    #[error("read {}", file.display())]
    Io {
        /// The file or directory.
        file: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// There is no file with touches.
    #[error("there is no file *.{EXTENSION} with the columns {HEADER} in {}", .0.display())]
    Empty(PathBuf),
    /// A line makes no sense.
    #[error("{name}, line {line}: {reason}")]
    Line {
        /// Name of the object.
        name: String,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: TouchReason,
    },
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TouchReason {
    /// The first line does not name the columns.
    #[error("expected the header {HEADER}")]
    Header,
    /// Not four columns.
    #[error("expected 4 columns, found {0}")]
    Columns(usize),
    /// A column is not a finite number.
    #[error("column {0} is not a finite number")]
    NotANumber(usize),
    /// Nothing follows the header.
    #[error("there is no touch")]
    NoTouch,
}

impl TouchSet {
    /// Reads all files of a directory that begin with the header, in the order of their names.
    ///
    /// # Errors
    /// A file cannot be read or is not of the format, or there is none.
    pub fn load(directory: &Path) -> Result<Self, TouchError> {
        let failed = |file: &Path| {
            let file = file.to_owned();
            move |source| TouchError::Io { file, source }
        };
        let mut files = Vec::new();
        for entry in fs::read_dir(directory).map_err(failed(directory))? {
            let path = entry.map_err(failed(directory))?.path();
            if path.extension().is_some_and(|found| found == EXTENSION) {
                files.push(path);
            }
        }
        files.sort();
        let mut objects = Vec::new();
        for file in files {
            let text = fs::read_to_string(&file).map_err(failed(&file))?;
            if text.lines().next().is_none_or(|line| line.trim() != HEADER) {
                continue;
            }
            let name = file.file_stem().unwrap_or_default().to_string_lossy();
            objects.push(TouchedObject::read(&name, &text)?);
        }
        if objects.is_empty() {
            return Err(TouchError::Empty(directory.to_owned()));
        }
        Ok(Self { objects })
    }

    /// Of objects that are known already.
    pub fn of(objects: Vec<TouchedObject>) -> Self {
        Self { objects }
    }

    /// The objects, in the order of their names when they were loaded.
    pub fn objects(&self) -> &[TouchedObject] {
        &self.objects
    }
}

impl TouchedObject {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// A line makes no sense, or there is no touch.
    pub fn read(name: &str, text: &str) -> Result<Self, TouchError> {
        let wrong = |line, reason| TouchError::Line {
            name: name.to_owned(),
            line,
            reason,
        };
        let mut lines = text.lines().enumerate();
        if lines.next().is_none_or(|(_, line)| line.trim() != HEADER) {
            return Err(wrong(1, TouchReason::Header));
        }
        let touches = lines
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(index, line)| Touch::read(line).map_err(|reason| wrong(index + 1, reason)))
            .collect::<Result<Vec<_>, _>>()?;
        if touches.is_empty() {
            return Err(wrong(1, TouchReason::NoTouch));
        }
        Ok(Self {
            name: name.to_owned(),
            touches,
        })
    }
}

impl Touch {
    fn read(line: &str) -> Result<Self, TouchReason> {
        let columns: Vec<&str> = line.split(',').map(str::trim).collect();
        let [x, y, z, level] = columns[..] else {
            return Err(TouchReason::Columns(columns.len()));
        };
        let number = |column: usize, text: &str| {
            let parsed = text.parse::<f64>().ok().filter(|number| number.is_finite());
            parsed.ok_or(TouchReason::NotANumber(column))
        };
        let position_mm = Point3::new(number(1, x)?, number(2, y)?, number(3, z)?);
        Ok(Self {
            position_m: position_mm * M_PER_MM,
            level: number(4, level)?,
        })
    }
}
