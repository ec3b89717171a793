//! Stamps as text: seconds in decimal, nanoseconds as integers, nothing lost between them.

/// Decimal places of a nanosecond in seconds.
const PLACES: i64 = 9;
/// Largest decimal exponent that is read; any larger one is beyond an `i64` anyway.
const EXPONENT_MAX: i64 = 1000;

/// Why a text is no stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidStamp {
    /// The text is not a decimal number.
    #[error("the time is not a decimal number")]
    NotDecimal,
    /// The time does not fit 64 bits of nanoseconds.
    #[error("the time does not fit 64 bits of nanoseconds")]
    OutOfRange,
}

/// Nanoseconds from seconds in decimal, such as `1248444187.156` or `1.248444187156e9`.
///
/// The digits are shifted as text: a Unix time in an `f64` is good to 200 ns only. Digits beyond
/// the ninth place are rounded to the nearest nanosecond, ties to even.
///
/// # Errors
/// The text is not a decimal number, or the time does not fit.
pub fn parse_seconds(text: &str) -> Result<i64, InvalidStamp> {
    let (negative, unsigned) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (
            mantissa,
            exponent
                .parse::<i64>()
                .map_err(|_| InvalidStamp::NotDecimal)?,
        ),
        None => (unsigned, 0),
    };
    if exponent.abs() > EXPONENT_MAX {
        return Err(InvalidStamp::OutOfRange);
    }
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{fraction}");
    if digits.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return Err(InvalidStamp::NotDecimal);
    }
    let places = i64::try_from(fraction.len()).map_err(|_| InvalidStamp::OutOfRange)?;
    let magnitude = shifted(&digits, exponent + PLACES - places)?;
    let signed = if negative { -magnitude } else { magnitude };
    i64::try_from(signed).map_err(|_| InvalidStamp::OutOfRange)
}

/// Seconds with nine decimal places, the exact opposite of [`parse_seconds`].
pub fn format_seconds(stamp_ns: i64) -> String {
    let sign = if stamp_ns < 0 { "-" } else { "" };
    let magnitude = stamp_ns.unsigned_abs();
    format!(
        "{sign}{}.{:09}",
        magnitude / 1_000_000_000,
        magnitude % 1_000_000_000
    )
}

/// `digits · 10^shift`, rounded to the nearest whole number, ties to even.
fn shifted(digits: &str, shift: i64) -> Result<i128, InvalidStamp> {
    let digits = digits.trim_start_matches('0');
    if digits.is_empty() {
        return Ok(0);
    }
    let length = i64::try_from(digits.len()).map_err(|_| InvalidStamp::OutOfRange)?;
    // An i64 has at most 19 digits; longer numbers need not be computed to be refused.
    if length + shift > 19 {
        return Err(InvalidStamp::OutOfRange);
    }
    if shift >= 0 {
        let power = u32::try_from(shift).map_err(|_| InvalidStamp::OutOfRange)?;
        return Ok(number(digits)? * 10_i128.pow(power));
    }
    let Ok(kept) = usize::try_from(length + shift) else {
        return Ok(0); // less than a tenth of a nanosecond
    };
    let (head, tail) = digits.split_at(kept);
    let head = if head.is_empty() { 0 } else { number(head)? };
    let (first, rest) = tail.split_at(1);
    let above_half = first > "5" || (first == "5" && rest.bytes().any(|digit| digit != b'0'));
    let tie = first == "5" && !above_half;
    Ok(head + i128::from(above_half || (tie && head % 2 == 1)))
}

/// The value of at most 19 digits.
fn number(digits: &str) -> Result<i128, InvalidStamp> {
    digits.parse().map_err(|_| InvalidStamp::OutOfRange)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn unix_times_keep_every_nanosecond() {
        assert_eq!(
            parse_seconds("1248444187.156"),
            Ok(1_248_444_187_156_000_000)
        );
        assert_eq!(
            parse_seconds("1403715278.762142976"),
            Ok(1_403_715_278_762_142_976)
        );
        assert_eq!(
            parse_seconds("1.248444187156000000e+09"),
            Ok(1_248_444_187_156_000_000)
        );
        assert_eq!(parse_seconds("-0.000000001"), Ok(-1));
        assert_eq!(parse_seconds("+7"), Ok(7_000_000_000));
        assert_eq!(parse_seconds(".5"), Ok(500_000_000));
        assert_eq!(parse_seconds("5."), Ok(5_000_000_000));
        assert_eq!(parse_seconds("0e5"), Ok(0));
    }

    #[test]
    fn digits_beyond_a_nanosecond_round_to_even() {
        assert_eq!(parse_seconds("0.0000000005"), Ok(0));
        assert_eq!(parse_seconds("0.0000000015"), Ok(2));
        assert_eq!(parse_seconds("0.0000000025"), Ok(2));
        assert_eq!(parse_seconds("0.00000000250000001"), Ok(3));
        assert_eq!(parse_seconds("-0.0000000015"), Ok(-2));
        assert_eq!(parse_seconds("1e-300"), Ok(0));
        assert_eq!(
            parse_seconds("2.000000000999999999999999999999999"),
            Ok(2_000_000_001)
        );
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "", ".", "-", "nan", "inf", "1.2.3", "1,5", "0x10", "1e", "--1", "١",
        ] {
            assert_eq!(parse_seconds(text), Err(InvalidStamp::NotDecimal), "{text}");
        }
        for text in ["9223372036.854775808", "1e11", "1e999", "1e99999"] {
            assert_eq!(parse_seconds(text), Err(InvalidStamp::OutOfRange), "{text}");
        }
    }

    proptest! {
        #[test]
        fn text_and_number_are_one(stamp_ns: i64) {
            prop_assert_eq!(parse_seconds(&format_seconds(stamp_ns)), Ok(stamp_ns));
        }

        #[test]
        fn any_text_is_answered(text in "[-+0-9.eE]{0,30}") {
            let _ = parse_seconds(&text);
        }
    }
}
