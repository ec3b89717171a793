//! Examples of bodies, for the page that describes the interface and whoever reads it.

use serde_json::{Value, json};

/// The example of a body, by the operation that takes it.
pub(crate) fn of(operation: &str) -> Option<Value> {
    let step =
        json!({ "increment": { "translation_m": [0.1, 0, 0], "rotation_xyzw": [0, 0, 0, 1] } });
    let touched = json!({ "level": { "channel": "touch", "value": 0.5 } });
    Some(match operation {
        "create_space" => json!({ "seed": 1, "localized_sd_m": 0.5, "trip_stillness_s": 5 }),
        // The session is one run of the agent, by convention the time of its start in nanoseconds.
        "send_samples" => {
            json!({ "session": 1_700_000_000_000_000_000_u64, "first_seq": 0, "samples": [
            { "stamp_ns": 1_700_000_000_000_000_000_i64, "body": step },
            { "stamp_ns": 1_700_000_000_100_000_000_i64, "body": touched },
        ] })
        }
        "recall" => json!({ "position_m": [1, 0, 0], "radius_m": 5, "limit": 3 }),
        "localize" => json!({ "samples": [
            { "stamp_ns": 0, "body": step },
            { "stamp_ns": 100_000_000, "body": { "sighting": {
                "target": { "landmark": "door 3" },
                "relation": { "position": { "translation_m": [2, 0, 0], "sd_m": [0.1, 0.1, 0.1] } }
            } } },
        ] }),
        "sequence" => json!({ "cue": [{ "place": 0 }, { "place": 1 }] }),
        "felt" => json!({ "position_m": [1, 0, 0], "radius_m": 0.5, "since_ns": 0 }),
        "route" => json!({ "from": { "agent": "ada" }, "to": { "place": 0 } }),
        "block" => json!({ "at_m": [2, 5, 0], "radius_m": 0.5 }),
        "follow_route" => json!({ "to": { "place": 0 }, "cost": "time" }),
        "predict" => json!({ "motion": step, "channel": "touch" }),
        "teach_object" => json!({ "spacing_m": 0.02, "contacts": [
            { "position_m": [0, 0, 0], "normal": [0, 0, 1] },
            { "position_m": [0.05, 0, 0], "normal": [1, 0, 0] },
        ] }),
        "identify" => json!({ "contacts": [{ "position_m": [0, 0, 0], "normal": [0, 0, 1] }] }),
        _ => return None,
    })
}
