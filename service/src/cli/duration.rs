//! Durations on the command line.

/// Longest duration \[s\]: eleven days.
const SECONDS_MAX: f64 = 1e6;

/// Reads a duration: a number of seconds, or numbers with their units such as `20s`, `1.5s`,
/// `1m30s`.
///
/// # Errors
/// Says what is wrong with the text.
pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = match text.parse::<f64>() {
        Ok(seconds) => seconds,
        Err(_) => humantime::parse_duration(text)
            .map_err(|error| format!("{error}; a duration is 20, 20s or 1m30s"))?
            .as_secs_f64(),
    };
    // A comparison with NaN is false.
    if seconds > 0.0 && seconds <= SECONDS_MAX {
        Ok(seconds)
    } else {
        Err(format!(
            "a duration is more than 0 s and at most {SECONDS_MAX} s"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::seconds;

    #[test]
    fn a_duration_is_seconds_or_has_units() {
        for (text, expected) in [
            ("20", 20.0),
            ("0.25", 0.25),
            ("20s", 20.0),
            ("1.5s", 1.5),
            ("250ms", 0.25),
            ("1m30s", 90.0),
            ("1m 30s", 90.0),
            ("2h", 7200.0),
        ] {
            let read = seconds(text).expect("a duration");
            assert!((read - expected).abs() < 1e-9, "{text}: {read}");
        }
    }

    #[test]
    fn what_is_no_duration_is_refused() {
        for text in [
            "",
            "soon",
            "20 parsecs",
            "0",
            "0s",
            "-1",
            "-5s",
            "NaN",
            "inf",
            "1e9",
            "12d",
        ] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
