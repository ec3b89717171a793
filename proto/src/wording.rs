//! What serde says of a message that it refuses, in the words of JSON: whoever sends one knows no
//! `f64`, no `map` and no `variant`.

/// The text for people; one that is not known stays as it is.
pub(crate) fn plain(text: &str) -> String {
    const OF_CONTENT: [&str; 7] = [
        "invalid type: ",
        "invalid value: ",
        "invalid length ",
        "unknown variant ",
        "unknown field ",
        "missing field ",
        "duplicate field ",
    ];
    if !OF_CONTENT.iter().any(|begin| text.starts_with(begin)) {
        return text.to_owned();
    }
    let text = without_position(text);
    let Some((found, expected)) = text.rsplit_once(", expected ") else {
        return text.to_owned();
    };
    if let Some(name) = found.strip_prefix("unknown variant ") {
        return format!("expected {expected}, not {name}");
    }
    if expected == "map with a single key" {
        return "expected an object with exactly one entry".to_owned();
    }
    if let Some(length) = found.strip_prefix("invalid length ") {
        return match kind(expected).as_str() {
            "an object" => format!("expected an object, not a list of {length}"),
            "fewer elements in array" => format!("expected a shorter list, not one of {length}"),
            kind => format!("expected {kind}, not {length} of them"),
        };
    }
    let found = found
        .strip_prefix("invalid type: ")
        .or_else(|| found.strip_prefix("invalid value: "));
    found.map_or_else(
        || text.to_owned(),
        |found| format!("expected {}, not {}", kind(expected), value(found)),
    )
}

/// Whether a name stands alone where what it names has to be given, too.
pub(crate) fn is_bare_name(text: &str) -> bool {
    let text = without_position(text);
    text.starts_with("invalid type: unit variant, expected ")
}

/// A refusal without line and column, or byte: the field says where.
fn without_position(text: &str) -> &str {
    for mark in [" at line ", " at byte "] {
        if let Some((before, position)) = text.rsplit_once(mark)
            && position.starts_with(|c: char| c.is_ascii_digit())
            && !position.contains(['"', '`'])
        {
            return before;
        }
    }
    text
}

/// What was expected.
fn kind(expected: &str) -> String {
    let whole = |most: u64| format!("a whole number from 0 to {most}");
    let plain = match expected {
        "f64" | "f32" | "float" => "a number",
        "u64" | "usize" => return whole(u64::MAX),
        "i64" => return format!("a whole number from {} to {}", i64::MIN, i64::MAX),
        "integer" => "a whole number",
        "u32" => return whole(u32::MAX.into()),
        "u16" => return whole(u16::MAX.into()),
        "u8" => return whole(u8::MAX.into()),
        "a string" | "string" | "str" => "a text",
        "a boolean" | "bool" => "true or false",
        "a sequence" | "array" => "a list",
        "string or map" => "an object with one entry",
        "unit" => "the name alone",
        _ => "",
    };
    if !plain.is_empty() {
        return plain.to_owned();
    }
    if let Some(length) = expected.strip_prefix("an array of length ") {
        return format!("a list of {length} numbers");
    }
    let is_object = ["struct ", "a batch of samples", "a map"];
    if is_object.iter().any(|begin| expected.starts_with(begin)) {
        return "an object".to_owned();
    }
    expected.to_owned()
}

/// What was found.
fn value(found: &str) -> String {
    match found {
        "sequence" | "array" => return "a list".to_owned(),
        // CBOR tells the type alone.
        "string" => return "a text".to_owned(),
        "integer" => return "a whole number".to_owned(),
        "float" => return "a number".to_owned(),
        "map" => return "an object".to_owned(),
        "unit value" => return "null".to_owned(),
        _ => {}
    }
    for number in ["integer ", "floating point ", "boolean "] {
        if let Some(shown) = found.strip_prefix(number) {
            return shown.trim_matches('`').to_owned();
        }
    }
    found
        .strip_prefix("string ")
        .map_or_else(|| found.to_owned(), |text| format!("the text {text}"))
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn refusals_are_in_the_words_of_json() {
        for (said, told) in [
            (
                "invalid type: string \"warm\", expected f64 at line 1 column 163",
                "expected a number, not the text \"warm\"",
            ),
            (
                "invalid value: integer `-1`, expected u32",
                "expected a whole number from 0 to 4294967295, not -1",
            ),
            (
                "invalid length 2, expected an array of length 3",
                "expected a list of 3 numbers, not 2 of them",
            ),
            (
                "invalid length 0, expected struct RouteQuery with 4 elements",
                "expected an object, not a list of 0",
            ),
            (
                "invalid length 4, expected fewer elements in array",
                "expected a shorter list, not one of 4",
            ),
            (
                "unknown variant `hme`, expected `home` or `place`",
                "expected `home` or `place`, not `hme`",
            ),
            (
                "invalid type: string \"a, expected b at line 1\", expected a boolean",
                "expected true or false, not the text \"a, expected b at line 1\"",
            ),
            ("missing field `to` at byte 7", "missing field `to`"),
            (
                "expected value at line 1 column 1",
                "expected value at line 1 column 1",
            ),
        ] {
            assert_eq!(plain(said), told);
        }
    }
}
