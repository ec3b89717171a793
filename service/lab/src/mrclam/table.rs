//! One text table: white space between columns, `#` before comments.

use super::error::{MrclamError, RowReason};
use trajectory::parse_seconds;

/// The columns of one line.
pub(super) struct Row<'a, const N: usize>([&'a str; N]);

impl<const N: usize> Row<'_, N> {
    /// The time in the first column \[ns\].
    pub(super) fn stamp_ns(&self) -> Result<i64, RowReason> {
        Ok(parse_seconds(self.0[0])?)
    }

    /// A finite number; columns count from 0 here.
    pub(super) fn number(&self, column: usize) -> Result<f64, RowReason> {
        let number = self.0[column]
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        number.ok_or(RowReason::NotANumber { column: column + 1 })
    }

    /// A whole number, which may be written as `14` or as `14.0`.
    pub(super) fn count(&self, column: usize) -> Result<u32, RowReason> {
        let number = self.number(column)?;
        if number.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&number) {
            return Err(RowReason::NotACount { column: column + 1 });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked above"
        )]
        Ok(number as u32)
    }
}

/// Parses every row of a table with `N` columns.
pub(super) fn rows<const N: usize, T>(
    file: &str,
    text: &str,
    mut parse: impl FnMut(Row<'_, N>) -> Result<T, RowReason>,
) -> Result<Vec<T>, MrclamError> {
    let mut parsed = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let columns: Vec<&str> = content.split_whitespace().collect();
        if columns.is_empty() {
            continue;
        }
        let found = columns.len();
        let row = <[&str; N]>::try_from(columns)
            .map_err(|_| RowReason::Columns { expected: N, found })
            .and_then(|columns| parse(Row(columns)));
        parsed.push(row.map_err(|reason| MrclamError::Row {
            file: file.to_owned(),
            line: index + 1,
            reason,
        })?);
    }
    Ok(parsed)
}
