//! A picture as SVG.

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Its name, fit for a file.
    pub name: &'static str,
    /// The picture as SVG.
    pub svg: String,
}

/// A figure could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("draw {figure}: {reason}")]
pub struct FigureError {
    /// Its name.
    pub figure: &'static str,
    /// Why.
    pub reason: String,
}
