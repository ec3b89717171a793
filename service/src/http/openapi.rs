//! The description of the interface: what the handlers say of themselves, completed by what holds
//! for all of them.

use cogmap_proto::limits::{
    BATCH_SAMPLES_MAX, GRID_MODULES_MAX, IDENTIFY_CONTACTS_MAX, LESSON_CONTACTS_MAX,
    LOCALIZE_SAMPLES_MAX, METRES_MAX, NAME_BYTES_MAX, ROTATIONS_MAX,
};
use serde_json::{Map, Value, json};

use super::examples;
use super::problem::{Kind, PROBLEM_JSON};
use crate::decode::{Bound, setting_bounds};

/// Statuses that every route may answer with, whoever handles it.
const EVERYWHERE: [(&str, &str); 7] = [
    ("400", "The request is malformed"),
    ("401", "The token is missing or wrong"),
    (
        "421",
        "The request is for a host that the service is not known as: see http.hosts",
    ),
    ("405", "The path does not take this method"),
    ("500", "A fault of the service, or the store has failed"),
    (
        "503",
        "The service is busy, loading or closing; come back after Retry-After. Or the space is stopped",
    ),
    ("504", "The answer took too long"),
];
/// Statuses of routes that take a body.
const WITH_BODY: [(&str, &str); 2] = [
    ("413", "The body is too long"),
    ("415", "The body's Content-Type is not one of these"),
];

/// Statuses of routes that name an agent.
const OF_AGENT: [(&str, &str); 1] = [("410", "The agent has been removed")];
/// Statuses of routes that may change something.
const CHANGING: [(&str, &str); 1] = [("403", "The request comes from a page of another host")];

/// Lengths of arrays, by the names of the fields that hold them.
const LENGTHS: [(&str, usize); 25] = [
    ("at_m", 3),
    ("translation_m", 3),
    ("rotation_xyzw", 4),
    ("translation_sd_m", 3),
    ("rotation_sd_rad", 3),
    ("linear_m_s", 3),
    ("angular_rad_s", 3),
    ("offset_m", 3),
    ("normal", 3),
    ("sd_m", 3),
    ("position_m", 3),
    ("position_sd_m", 3),
    ("approach", 3),
    ("reference", 3),
    ("reference_m", 3),
    ("phase", 3),
    ("decoded_m", 3),
    ("interference_m", 3),
    ("covariance", 21),
    ("position_covariance_m2", 6),
    ("from_m", 3),
    ("to_m", 3),
    ("min_m", 3),
    ("max_m", 3),
    ("activation", 27),
];

/// Completes a description. With `token`, it says that a bearer token is asked for.
pub(crate) fn complete(mut openapi: Value, token: bool) -> Value {
    for (path, item) in entries(&mut openapi["paths"]) {
        for (method, operation) in entries(item) {
            if path.contains("{agent}") {
                add_all(operation, &OF_AGENT);
            }
            if method != "get" {
                add_all(operation, &CHANGING);
            }
            complete_operation(operation);
            if token && !matches!(path.as_str(), "/healthz" | "/readyz") {
                operation["security"] = json!([{ "token": [] }]);
            }
        }
    }
    if token {
        openapi["components"]["securitySchemes"] =
            json!({ "token": { "type": "http", "scheme": "bearer" } });
    }
    bound_integers(&mut openapi);
    measure_arrays(&mut openapi);
    close_variants(&mut openapi["components"]["schemas"]);
    let kinds: Vec<_> = { Kind::ALL.iter() }
        .map(|kind| format!("/problems/{}", kind.name()))
        .collect();
    openapi["components"]["schemas"]["Problem"]["properties"]["type"]["enum"] = json!(kinds);
    let creation = &mut openapi["paths"]["/v1/spaces/{space}"]["put"]["requestBody"];
    creation["required"] = json!(false);
    constrain(&mut openapi["components"]["schemas"]);
    openapi
}

fn complete_operation(operation: &mut Value) {
    let with_body = operation.get("requestBody").is_some();
    let example = operation["operationId"].as_str().and_then(examples::of);
    let json = "/requestBody/content/application~1json";
    if let (Some(example), Some(body)) = (example, operation.pointer_mut(json)) {
        body["example"] = example;
    }
    add_all(operation, &EVERYWHERE);
    if with_body {
        add_all(operation, &WITH_BODY);
    }
    for (status, response) in entries(&mut operation["responses"]) {
        if status.as_str() >= "400" && response.get("content").is_none() {
            let schema = json!({ "$ref": "#/components/schemas/Problem" });
            response["content"] = json!({ PROBLEM_JSON: { "schema": schema } });
        }
    }
}

/// Adds statuses that the operation does not describe itself.
fn add_all(operation: &mut Value, statuses: &[(&str, &str)]) {
    let responses = &mut operation["responses"];
    for (status, description) in statuses {
        if responses.get(status).is_none() {
            responses[status] = json!({ "description": description });
        }
    }
}

/// Gives integers the bounds of their type, and those without a sign a format that says so: JSON
/// has neither of its own.
fn bound_integers(value: &mut Value) {
    if let Some(object) = value.as_object_mut() {
        let format = object.get("format").and_then(Value::as_str);
        let unsigned = object.get("minimum").is_some();
        let bounds = match (format, unsigned) {
            (Some("int64"), false) => Some(("int64", json!(i64::MIN), json!(i64::MAX))),
            (Some("int64"), true) => Some(("uint64", json!(0), json!(u64::MAX))),
            (Some("int32"), false) => Some(("int32", json!(i32::MIN), json!(i32::MAX))),
            (Some("int32"), true) => Some(("uint32", json!(0), json!(u32::MAX))),
            _ => None,
        };
        if let Some((format, minimum, maximum)) = bounds {
            object.insert("format".to_owned(), json!(format));
            object.entry("minimum").or_insert(minimum);
            object.entry("maximum").or_insert(maximum);
        }
    }
    match value {
        Value::Object(object) => object.values_mut().for_each(bound_integers),
        Value::Array(items) => items.iter_mut().for_each(bound_integers),
        _ => {}
    }
}

/// Writes the lengths of arrays into all schemas: the derived ones do not tell `[f64; 3]` from a
/// list.
fn measure_arrays(value: &mut Value) {
    match value {
        Value::Object(object) => {
            for (name, length) in LENGTHS {
                if let Some(field) = object.get_mut(name) {
                    merge_into_array(field, length);
                }
            }
            // A parameter carries its name beside its schema.
            let length = LENGTHS
                .iter()
                .find(|(name, _)| object.get("name") == Some(&json!(name)));
            if let (Some((_, length)), Some(schema)) = (length, object.get_mut("schema")) {
                merge_into_array(schema, *length);
            }
            object.values_mut().for_each(measure_arrays);
        }
        Value::Array(items) => items.iter_mut().for_each(measure_arrays),
        _ => {}
    }
}

/// A variant is an object with one key: its name.
fn close_variants(schemas: &mut Value) {
    for (_, schema) in entries(schemas) {
        let variants = schema.get_mut("oneOf").and_then(Value::as_array_mut);
        for variant in variants.into_iter().flatten() {
            if variant["properties"]
                .as_object()
                .is_some_and(|keys| keys.len() == 1)
            {
                merge(variant, &json!({ "additionalProperties": false }));
            }
        }
    }
}

fn merge_into_array(schema: &mut Value, length: usize) {
    let types = &schema["type"];
    let array = types == "array"
        || types
            .as_array()
            .is_some_and(|types| types.iter().any(|one| one == "array"));
    if array {
        merge(schema, &json!({ "minItems": length, "maxItems": length }));
    }
}

/// Writes the bounds of request bodies into their schemas: the types cannot carry them.
fn constrain(schemas: &mut Value) {
    constrain_recall(&mut schemas["RecallQuery"]["properties"]);
    constrain_felt(&mut schemas["FeltQuery"]["properties"]);
    constrain_route(schemas);
    constrain_batch(&mut schemas["SampleBatch"]["properties"]);
    constrain_rotations(&mut schemas["Orientation"]);
    constrain_lists(schemas);
    merge_into_array(&mut schemas["Landmark"]["properties"]["covariance"], 6);
    constrain_settings(schemas);
}

fn constrain_recall(query: &mut Value) {
    let metres = json!({ "minimum": -METRES_MAX, "maximum": METRES_MAX });
    merge(&mut query["position_m"]["items"], &metres);
    let radius = json!({ "minimum": 0.0, "maximum": METRES_MAX });
    merge(&mut query["radius_m"], &radius);
    let limit = json!({ "minimum": 1, "maximum": 1000 });
    merge(&mut query["limit"], &limit);
    let name = json!({
        "pattern": "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        "minLength": 1,
        "maxLength": NAME_BYTES_MAX,
    });
    merge(&mut query["agent"], &name);
    let phase = &mut query["code"]["items"];
    merge_into_array(phase, 3);
    let turns = json!({ "minimum": 0.0, "exclusiveMaximum": 1.0 });
    merge(&mut phase["items"], &turns);
    let modules = json!({ "minItems": 1, "maxItems": GRID_MODULES_MAX });
    merge(&mut query["code"], &modules);
}

fn constrain_felt(query: &mut Value) {
    let metres = json!({ "minimum": -METRES_MAX, "maximum": METRES_MAX });
    merge(&mut query["position_m"]["items"], &metres);
    let radius = json!({ "minimum": 0.0, "maximum": METRES_MAX });
    merge(&mut query["radius_m"], &radius);
    let limit = json!({ "minimum": 1, "maximum": 1000 });
    merge(&mut query["limit"], &limit);
    let channels = json!({ "minItems": 1, "maxItems": 64 });
    merge(&mut query["channels"], &channels);
}

fn constrain_route(schemas: &mut Value) {
    let query = &mut schemas["RouteQuery"]["properties"];
    let spacing = json!({ "minimum": 0.01, "maximum": 1000.0 });
    merge(&mut query["spacing_m"], &spacing);
    let radius = json!({ "minimum": 0.01, "maximum": 1.0 });
    merge(&mut query["body_radius_m"], &radius);
    merge(&mut query["alternatives"], &json!({ "maximum": 4 }));
    let blockage = &mut schemas["BlockageRequest"]["properties"];
    let radius = json!({ "minimum": 0.01, "maximum": 1000.0 });
    merge(&mut blockage["radius_m"], &radius);
    let metres = json!({ "minimum": -METRES_MAX, "maximum": METRES_MAX });
    merge(&mut blockage["at_m"]["items"], &metres);
    let avoid = &mut schemas["RouteAvoid"]["properties"];
    merge(&mut avoid["places"], &json!({ "maxItems": 1000 }));
    merge(&mut avoid["boxes"], &json!({ "maxItems": 64 }));
}

fn constrain_batch(batch: &mut Value) {
    let first = json!({ "maximum": u64::MAX - 1 - BATCH_SAMPLES_MAX as u64 });
    merge(&mut batch["first_seq"], &first);
    merge(&mut batch["session"], &json!({ "maximum": u64::MAX - 1 }));
}

fn constrain_rotations(orientation: &mut Value) {
    let turns = orientation["oneOf"].as_array_mut();
    for variant in turns.into_iter().flatten() {
        let finite = "/properties/finite/properties/rotations_xyzw";
        if let Some(rotations) = variant.pointer_mut(finite) {
            let count = json!({ "minItems": 1, "maxItems": ROTATIONS_MAX });
            merge(rotations, &count);
            merge_into_array(&mut rotations["items"], 4);
        }
    }
}

fn constrain_lists(schemas: &mut Value) {
    let lists = [
        ("SampleBatch", "samples", BATCH_SAMPLES_MAX),
        ("LocalizeQuery", "samples", LOCALIZE_SAMPLES_MAX),
        ("ObjectLesson", "contacts", LESSON_CONTACTS_MAX),
        ("IdentifyQuery", "contacts", IDENTIFY_CONTACTS_MAX),
    ];
    for (name, field, most) in lists {
        let list = &mut schemas[name]["properties"][field];
        merge(list, &json!({ "minItems": 1, "maxItems": most }));
    }
}

fn constrain_settings(schemas: &mut Value) {
    let bernoulli = "/Recruitment/oneOf/1/properties/bernoulli/properties/probability";
    if let Some(probability) = schemas.pointer_mut(bernoulli) {
        merge(probability, &of_bound(Bound::Share));
    }
    for (field, bound) in setting_bounds() {
        for message in ["SpaceSettings", "NoiseSettings"] {
            if let Some(schema) = schemas[message]["properties"].get_mut(field) {
                merge(schema, &of_bound(bound));
            }
        }
    }
}

/// A bound of a setting, as a schema says it.
fn of_bound(bound: Bound) -> Value {
    match bound {
        Bound::Share => json!({ "minimum": 0.0, "maximum": 1.0 }),
        Bound::Real {
            min,
            is_open: true,
            max,
        } => json!({ "exclusiveMinimum": min, "maximum": max }),
        Bound::Real {
            min,
            is_open: false,
            max,
        } => json!({ "minimum": min, "maximum": max }),
        Bound::Whole { min, max: None } => json!({ "minimum": min }),
        Bound::Whole {
            min,
            max: Some(max),
        } => json!({ "minimum": min, "maximum": max }),
    }
}

fn merge(into: &mut Value, from: &Value) {
    if let (Some(into), Some(from)) = (into.as_object_mut(), from.as_object()) {
        into.extend(from.clone());
    }
}

fn entries(value: &mut Value) -> impl Iterator<Item = (&String, &mut Value)> {
    value.as_object_mut().into_iter().flat_map(Map::iter_mut)
}
