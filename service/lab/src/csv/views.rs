//! Views, a row each, in the format of `numpy.save`.

/// Views of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    width: usize,
    numbers: Vec<f64>,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug)]
enum Precision {
    Half,
    Single,
    Double,
}

impl Precision {
    fn of(header: &str) -> Option<Self> {
        [
            ("'<f2'", Self::Half),
            ("'<f4'", Self::Single),
            ("'<f8'", Self::Double),
        ]
        .into_iter()
        .find_map(|(name, precision)| header.contains(name).then_some(precision))
    }

    fn bytes(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Single => 4,
            Self::Double => 8,
        }
    }

    fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::Half => half(u16::from_le_bytes(bytes.try_into().ok()?)),
            Self::Single => f32::from_le_bytes(bytes.try_into().ok()?).into(),
            Self::Double => f64::from_le_bytes(bytes.try_into().ok()?),
        })
    }
}

impl Views {
    /// Reads a file (numpy/lib/format.py): a magic word, a version, the length of a header, the
    /// header as a Python dictionary, and the numbers, row by row. `None` if it is not one of a
    /// matrix of floating-point numbers.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(b"\x93NUMPY")?;
        let (version, rest) = rest.split_first_chunk::<2>()?;
        let (length, rest) = if version[0] == 1 {
            let (length, rest) = rest.split_first_chunk::<2>()?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        } else {
            let (length, rest) = rest.split_first_chunk::<4>()?;
            (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
        };
        let (header, numbers) = rest.split_at_checked(length)?;
        let header = std::str::from_utf8(header).ok()?;
        if !header.contains("'fortran_order': False") {
            return None;
        }
        let precision = Precision::of(header)?;
        let shape = header.split("'shape': (").nth(1)?.split(')').next()?;
        let shape: Vec<usize> = shape
            .split(',')
            .map(|n| n.trim().parse().ok())
            .collect::<Option<_>>()?;
        let [rows, width] = shape[..] else {
            return None;
        };
        let expected = rows.checked_mul(width)?.checked_mul(precision.bytes())?;
        if numbers.len() != expected {
            return None;
        }
        let numbers = numbers.chunks_exact(precision.bytes());
        let numbers = numbers
            .map(|bytes| precision.read(bytes))
            .collect::<Option<_>>()?;
        Some(Self { width, numbers })
    }

    /// A view.
    pub fn row(&self, row: usize) -> Option<&[f64]> {
        let start = row.checked_mul(self.width)?;
        self.numbers.get(start..start.checked_add(self.width)?)
    }
}

/// A number of half precision (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2.0_f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2.0_f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn halves_are_read_as_the_standard_says() {
        for (bits, number) in [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x3555, 0.333_251_953_125),
        ] {
            assert!((half(bits) - number).abs() < 1e-15, "{bits:x}");
        }
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }
}
