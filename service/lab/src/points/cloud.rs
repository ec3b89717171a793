//! One object's surface as oriented points.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Unit, Vector3};

/// First line of a file.
const HEADER: &str = "x,y,z,nx,ny,nz";

/// A point \[m\] and the outward unit normal there.
pub type Oriented = (Point3<f64>, Unit<Vector3<f64>>);

/// Oriented points of one object's surface.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Name: the file's, without `.csv`.
    pub name: String,
    /// Points \[m\] and outward unit normals, in the object's own frame.
    pub points: Vec<Oriented>,
}

/// Why clouds cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum InvalidCloud {
    /// A file or folder cannot be read.
    #[error("read {path}")]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line is not six numbers, or the normal is none.
    #[error("{path}, line {line}: not `{HEADER}` with a normal")]
    Line {
        /// File.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
    },
    /// No file of the folder begins as these do.
    #[error("{0} holds no file that begins with `{HEADER}`")]
    Empty(PathBuf),
}

impl Cloud {
    /// All clouds of a folder, by name. Files with another header are left alone.
    ///
    /// # Errors
    /// A file cannot be read, or a line of a cloud is wrong, or there is none.
    pub fn load(folder: &Path) -> Result<Vec<Self>, InvalidCloud> {
        let io = |path: &Path| {
            let path = path.to_path_buf();
            move |source| InvalidCloud::Io { path, source }
        };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(io(folder))? {
            let path = entry.map_err(io(folder))?.path();
            if path.extension().is_some_and(|extension| extension == "csv") {
                paths.push(path);
            }
        }
        paths.sort();
        let mut clouds = Vec::new();
        for path in paths {
            let text = std::fs::read_to_string(&path).map_err(io(&path))?;
            if text.lines().next().map(str::trim) == Some(HEADER) {
                let name = path
                    .file_stem()
                    .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
                let points = parse(&text).map_err(|line| InvalidCloud::Line { path, line })?;
                clouds.push(Self { name, points });
            }
        }
        if clouds.is_empty() {
            return Err(InvalidCloud::Empty(folder.to_path_buf()));
        }
        Ok(clouds)
    }
}

/// The points, or the number of the line that is wrong.
fn parse(text: &str) -> Result<Vec<Oriented>, usize> {
    let mut points = Vec::new();
    for (number, line) in text.lines().enumerate().skip(1) {
        if line.trim().is_empty() {
            continue;
        }
        let numbers: Vec<f64> = line
            .split(',')
            .map_while(|field| field.trim().parse().ok())
            .collect();
        let [x, y, z, nx, ny, nz] = numbers[..] else {
            return Err(number + 1);
        };
        let normal = Unit::try_new(Vector3::new(nx, ny, nz), 0.5).ok_or(number + 1)?;
        if !(x + y + z).is_finite() {
            return Err(number + 1);
        }
        points.push((Point3::new(x, y, z), normal));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_line_is_named() {
        let good = "x,y,z,nx,ny,nz\n1,-2,3e-3,0,0,-1\n\n";
        assert_eq!(parse(good).unwrap()[0].0, Point3::new(1.0, -2.0, 0.003));
        assert_eq!(parse("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n1,2,3,0,0\n"), Err(3));
        assert_eq!(parse("x,y,z,nx,ny,nz\n1,2,3,0,0,0\n"), Err(2));
        assert_eq!(parse("x,y,z,nx,ny,nz\nnan,2,3,0,0,1\n"), Err(2));
    }
}
