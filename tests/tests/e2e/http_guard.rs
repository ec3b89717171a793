//! Who is let in, what is described, and how the service goes.

use std::sync::mpsc::channel;
use std::thread;

use cogmap_client::Api;
use cogmap_tests::{Drive, Server, batch, seed};
use serde_json::json;

/// Every path of the interface and its methods: what clients are written against.
const ROUTES: [(&str, &[&str]); 39] = [
    ("/healthz", &["get"]),
    ("/metrics", &["get"]),
    ("/readyz", &["get"]),
    ("/v1", &["get"]),
    ("/v1/cluster", &["get"]),
    ("/v1/spaces", &["get"]),
    ("/v1/spaces/{space}", &["delete", "get", "put"]),
    ("/v1/spaces/{space}/agents", &["get"]),
    ("/v1/spaces/{space}/agents/{agent}", &["delete", "get"]),
    ("/v1/spaces/{space}/agents/{agent}/at", &["get"]),
    ("/v1/spaces/{space}/agents/{agent}/grid", &["get"]),
    ("/v1/spaces/{space}/agents/{agent}/object", &["get"]),
    ("/v1/spaces/{space}/agents/{agent}/predict", &["post"]),
    (
        "/v1/spaces/{space}/agents/{agent}/route",
        &["delete", "get", "put"],
    ),
    ("/v1/spaces/{space}/agents/{agent}/samples", &["post"]),
    ("/v1/spaces/{space}/agents/{agent}/trajectory", &["get"]),
    ("/v1/spaces/{space}/blockages", &["get", "post"]),
    ("/v1/spaces/{space}/blockages/{id}", &["delete"]),
    ("/v1/spaces/{space}/channels", &["get"]),
    ("/v1/spaces/{space}/events", &["get"]),
    ("/v1/spaces/{space}/export", &["get"]),
    ("/v1/spaces/{space}/felt", &["post"]),
    ("/v1/spaces/{space}/landmarks", &["get"]),
    ("/v1/spaces/{space}/landmarks/{id}", &["get"]),
    ("/v1/spaces/{space}/live", &["get"]),
    ("/v1/spaces/{space}/localize", &["post"]),
    ("/v1/spaces/{space}/objects", &["get"]),
    ("/v1/spaces/{space}/objects/identify", &["post"]),
    (
        "/v1/spaces/{space}/objects/{name}",
        &["delete", "get", "put"],
    ),
    ("/v1/spaces/{space}/places", &["get"]),
    ("/v1/spaces/{space}/places/{id}", &["get"]),
    ("/v1/spaces/{space}/places/{id}/percepts", &["get"]),
    ("/v1/spaces/{space}/recall", &["post"]),
    ("/v1/spaces/{space}/route", &["post"]),
    ("/v1/spaces/{space}/routes", &["get"]),
    ("/v1/spaces/{space}/sequence", &["post"]),
    ("/v1/spaces/{space}/trips", &["get"]),
    ("/v1/spaces/{space}/trips/{id}", &["get"]),
    ("/v1/spaces/{space}/trips/{id}/pin", &["delete", "put"]),
];

#[test]
fn the_token_opens_everything_but_health_and_the_pages_which_are_open() {
    let mut server = Server::start(&["http.token=s3cret"]);
    let (bare, wrong) = (server.http(), server.http().with_token("s3cre"));
    let with = server.http().with_token("s3cret");
    for path in ["/v1/spaces", "/v1/spaces/default", "/metrics", "/nothing"] {
        bare.get(path).problem(401, "unauthorized");
        wrong.get(path).problem(401, "unauthorized");
        assert_ne!(with.get(path).status, 401, "{path}");
    }
    for path in ["/healthz", "/readyz", "/", "/docs/", "/openapi.json"] {
        assert_eq!(bare.get(path).status, 200, "{path}");
    }
    let samples = "/v1/spaces/default/agents/ada/samples";
    bare.post_json(samples, &json!({}))
        .problem(401, "unauthorized");
    let drive = batch(1, 0, Drive::new(seed(30)).take(20).collect());
    let api = Api::new(&server.url(), Some("s3cret"));
    let answer = api.post_samples("default", "ada", &drive).unwrap();
    assert_eq!(answer.watermark.durable, 20);
    server.terminate();
    assert!(!server.log().contains("s3cret"), "the log tells the token");
}

#[test]
fn the_description_lists_every_route() {
    let server = Server::start(&[]);
    let http = server.http();
    let description = http.get("/openapi.json").json(200);
    assert!(description["openapi"].as_str().unwrap().starts_with("3."));
    let paths = description["paths"].as_object().unwrap();
    let mut described: Vec<_> = paths
        .iter()
        .map(|(path, item)| {
            let methods = ["delete", "get", "post", "put"];
            let methods = methods
                .into_iter()
                .filter(|method| item.get(method).is_some());
            (path.as_str(), methods.collect::<Vec<_>>())
        })
        .collect();
    described.sort();
    let expected: Vec<_> = ROUTES
        .iter()
        .map(|(path, methods)| (*path, methods.to_vec()))
        .collect();
    assert_eq!(described, expected);
    let docs = http.get("/docs/");
    assert_eq!(docs.status, 200);
    assert!(docs.content_type.starts_with("text/html"), "{docs:?}");
    http.get("/v2/spaces").problem(404, "unknown-route");
    http.post_json("/healthz", &json!({}))
        .problem(405, "method-not-allowed");
    http.get("/v1/spaces/default/agents?limt=3")
        .problem(400, "invalid-parameter");
    http.get("/v1/spaces/nowhere").problem(404, "unknown-space");
    http.get("/v1/spaces/default/agents/nobody")
        .problem(404, "unknown-agent");
    http.get("/v1/spaces/default/places/0")
        .problem(404, "unknown-memory");
}

#[test]
fn spaces_come_and_go_and_keep_their_settings() {
    let mut server = Server::start(&[]);
    let (http, api) = (server.http(), server.api());
    let settings = json!({"seed": 5, "field_radius_m": 0.5});
    let made = http.put_json("/v1/spaces/lab", &settings).json(201);
    assert_eq!(made["settings"]["field_radius_m"], 0.5);
    assert_eq!(made["settings"]["grid_modules"], 6);
    http.put_json("/v1/spaces/lab", &settings).json(200);
    http.put_json("/v1/spaces/lab", &json!({}))
        .problem(409, "other-settings");
    let misspelt = json!({"field_radius": 0.5});
    http.put_json("/v1/spaces/hall", &misspelt)
        .problem(400, "malformed-body");
    let senseless = json!({"grid_modules": 0});
    http.put_json("/v1/spaces/hall", &senseless)
        .problem(422, "invalid-settings");
    let drive: Vec<_> = Drive::new(seed(31)).take(200).collect();
    let drive = batch(1, 0, drive);
    for space in ["default", "lab"] {
        api.post_samples(space, "ada", &drive).unwrap();
    }
    server.kill();
    server.run();
    let names = |api: &Api| -> Vec<_> {
        let spaces = api.spaces().unwrap();
        spaces
            .into_iter()
            .map(|space| (space.name, space.map_revision))
            .collect()
    };
    assert_eq!(
        names(&api),
        [("default".to_owned(), 201), ("lab".to_owned(), 201)]
    );
    // Places lie farther apart where fields are wider.
    let places = |space| api.space(space).unwrap().places;
    assert!(
        places("lab") < places("default"),
        "{} {}",
        places("lab"),
        places("default")
    );
    api.delete_space("lab").unwrap();
    http.get("/v1/spaces/lab").problem(404, "unknown-space");
    server.kill();
    server.run();
    assert_eq!(names(&api), [("default".to_owned(), 201)]);
}

#[test]
fn it_ends_in_good_order_while_a_stream_is_open() {
    let mut server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(32)).take(500).collect();
    let (http, (opened, open)) = (server.http(), channel());
    let stream = thread::spawn(move || {
        let mut events = 0;
        let end = http.follow(
            "/v1/spaces/default/events",
            || opened.send(()).unwrap(),
            |_| events += 1,
        );
        (end, events)
    });
    open.recv().unwrap();
    let drive = batch(1, 0, samples);
    let answer = server.api().post_samples("default", "ada", &drive).unwrap();
    assert_eq!(answer.watermark.durable, 500);
    let digest = server.api().space("default").unwrap().digest;
    server.terminate();
    let (end, events) = stream.join().unwrap();
    assert_eq!(end, Ok(()), "the stream ends and does not break");
    assert!(events > 0);
    server.run();
    assert_eq!(server.api().space("default").unwrap().digest, digest);
}
