//! The README's examples are messages, and its limits are those of the code.

use std::collections::BTreeSet;

use cogmap_proto::{Codec, Estimate, SampleBatch, SampleBody, Watermark, limits};

const README: &str = include_str!("../README.md");

/// The fenced examples, in order, without their comments.
fn examples() -> Vec<String> {
    let fences = README.split("```jsonc\n").skip(1);
    fences
        .map(|fence| without_comments(fence.split("```").next().unwrap_or_default()))
        .collect()
}

/// No text of the examples holds `//`, so all that follows one on a line is a comment.
fn without_comments(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_examples_are_messages() {
    let [batch, estimate, watermark] = <[String; 3]>::try_from(examples()).unwrap();
    let batch: SampleBatch = Codec::Json.decode_batch(batch.as_bytes()).unwrap();
    let kinds: BTreeSet<&str> = batch
        .samples
        .iter()
        .map(|sample| match sample.body {
            SampleBody::Increment(_) => "increment",
            SampleBody::Velocity(_) => "velocity",
            SampleBody::Level(_) => "level",
            SampleBody::Descriptor(_) => "descriptor",
            SampleBody::Sighting(_) => "sighting",
            SampleBody::StartPose(_) => "start_pose",
            SampleBody::Marker(_) => "marker",
            SampleBody::Object(_) => "object",
            SampleBody::SessionEnd {} => "session_end",
        })
        .collect();
    assert_eq!(
        kinds.len(),
        9,
        "every kind of sample has an example: {kinds:?}"
    );
    let estimate: Estimate = Codec::Json.decode(estimate.as_bytes()).unwrap();
    assert_eq!(
        estimate.seq,
        batch.first_seq + batch.samples.len() as u64 - 1
    );
    let _: Watermark = Codec::Json.decode(watermark.as_bytes()).unwrap();
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table: a row for each limit")]
fn the_limits_are_those_of_the_code() {
    let rows = [
        (
            "MESSAGE_BYTES_MAX",
            format!("| {} bytes |", limits::MESSAGE_BYTES_MAX),
        ),
        (
            "BATCH_SAMPLES_MAX",
            format!("| 1 to {} |", limits::BATCH_SAMPLES_MAX),
        ),
        (
            "DESCRIPTOR_LEN_MIN",
            format!(
                "| {} to {} |",
                limits::DESCRIPTOR_LEN_MIN,
                limits::DESCRIPTOR_LEN_MAX
            ),
        ),
        (
            "NAME_BYTES_MAX",
            format!("| {} bytes |", limits::NAME_BYTES_MAX),
        ),
        (
            "LABEL_BYTES_MAX",
            format!("| {} bytes |", limits::LABEL_BYTES_MAX),
        ),
        ("METRES_MAX", format!("| {:e} m, m/s |", limits::METRES_MAX)),
        (
            "RADIANS_PER_SECOND_MAX",
            format!("| {:e} rad/s |", limits::RADIANS_PER_SECOND_MAX),
        ),
        (
            "DURATION_S_MAX",
            format!("| {} s |", limits::DURATION_S_MAX),
        ),
        (
            "QUATERNION_NORM_TOLERANCE",
            format!("| {:e} |", limits::QUATERNION_NORM_TOLERANCE),
        ),
        (
            "PAGE_ITEMS_MAX",
            format!(
                "| {}, {} without",
                limits::PAGE_ITEMS_MAX,
                limits::PAGE_ITEMS_DEFAULT
            ),
        ),
        (
            "GRID_MODULES_MAX",
            format!("| {} |", limits::GRID_MODULES_MAX),
        ),
        (
            "LOCALIZE_SAMPLES_MAX",
            format!("| 1 to {} |", limits::LOCALIZE_SAMPLES_MAX),
        ),
        (
            "WATERMARK_REJECTIONS_MAX",
            format!("| {} |", limits::WATERMARK_REJECTIONS_MAX),
        ),
        (
            "SEQUENCE_LEAP_MAX",
            format!("| {} |", limits::SEQUENCE_LEAP_MAX),
        ),
    ];
    for (name, value) in rows {
        let row = README
            .lines()
            .find(|line| line.starts_with(&format!("| `{name}`")));
        assert!(
            row.is_some_and(|row| row.contains(&value)),
            "{name} is {value}, not {row:?}"
        );
    }
}
