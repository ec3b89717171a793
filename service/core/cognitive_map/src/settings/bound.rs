//! What a number of the settings may be.

use std::fmt;

use super::InvalidSettings;

/// What a number of the settings may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// A share: 0 to 1.
    Share,
    /// A number from a least one on, or only above it, up to a largest one.
    Real {
        /// The least number.
        min: f64,
        /// Whether the least number itself is refused.
        is_open: bool,
        /// The largest number.
        max: f64,
    },
    /// A whole number from a least one on, up to a largest one if there is one.
    Whole {
        /// The least number.
        min: u32,
        /// The largest number.
        max: Option<u32>,
    },
}

impl Bound {
    /// A number from `min` to `max`.
    pub const fn from(min: f64, max: f64) -> Self {
        let is_open = false;
        Self::Real { min, is_open, max }
    }

    /// A number above `min`, up to `max`.
    pub const fn above(min: f64, max: f64) -> Self {
        let is_open = true;
        Self::Real { min, is_open, max }
    }

    /// Whether a number is within. Not a number is within none.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Share => (0.0..=1.0).contains(&value),
            Self::Real { min, is_open, max } => {
                let is_above = if is_open { value > min } else { value >= min };
                is_above && value <= max
            }
            Self::Whole { min, max } => {
                let max = max.map_or(f64::INFINITY, f64::from);
                value >= f64::from(min) && value <= max
            }
        }
    }

    /// Checks the value of a setting.
    ///
    /// # Errors
    /// Names the field and what it must be.
    pub fn check(self, field: &'static str, value: f64) -> Result<(), InvalidSettings> {
        if self.holds(value) {
            return Ok(());
        }
        let rule = self.to_string();
        Err(InvalidSettings { field, rule })
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Share => write!(f, "0 to 1"),
            Self::Real {
                min,
                is_open: true,
                max,
            } => write!(f, "above {min}, at most {max}"),
            Self::Real {
                min,
                is_open: false,
                max,
            } => write!(f, "{min} to {max}"),
            Self::Whole {
                min,
                max: Some(max),
            } => write!(f, "{min} to {max}"),
            Self::Whole { min, max: None } => write!(f, "at least {min}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_holds_what_its_text_says() {
        let positive = Bound::above(0.0, 10.0);
        assert_eq!(positive.to_string(), "above 0, at most 10");
        assert!(!positive.holds(0.0) && positive.holds(1e-9) && positive.holds(10.0));
        let spacing = Bound::from(0.5, 2.0);
        assert_eq!(spacing.to_string(), "0.5 to 2");
        assert!(!spacing.holds(0.49) && spacing.holds(0.5) && !spacing.holds(2.01));
        let many = Bound::Whole { min: 2, max: None };
        assert_eq!(many.to_string(), "at least 2");
        assert!(!many.holds(1.0) && many.holds(f64::from(u32::MAX)));
        let some = Bound::Whole {
            min: 1,
            max: Some(16),
        };
        assert_eq!(some.to_string(), "1 to 16");
        assert!(!some.holds(17.0));
        for bound in [Bound::Share, positive, spacing, many, some] {
            assert!(!bound.holds(f64::NAN), "{bound}");
        }
    }
}
