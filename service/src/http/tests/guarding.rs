//! What stands before every handler.

use std::future::pending;

use axum::routing::get;
use tokio::sync::Notify;

use super::*;
use crate::http::Token;
use crate::http::dashboard::PLAIN_PAGE;

/// A guarded router of handlers that go wrong.
fn guarded(settings: &HttpSettings, entered: Arc<Notify>) -> Router {
    let routes = ["/panic", "/never", "/fine"];
    let guard = Guard::new(settings, routes.into_iter().map(str::to_owned));
    Router::new()
        .route(
            "/panic",
            get(|| async { assert_eq!(1, 2, "one is not two") }),
        )
        .route("/never", get(move || never(Arc::clone(&entered))))
        .route("/fine", get(|| async { "fine" }))
        .layer(guard)
}

/// Says that it has been entered, and stays.
async fn never(entered: Arc<Notify>) {
    entered.notify_one();
    pending::<()>().await;
}

/// Settings with a time limit that a test can wait for.
fn hasty() -> HttpSettings {
    HttpSettings {
        request_timeout: Duration::from_millis(100),
        ..settings()
    }
}

async fn ask(router: &Router, path: &str) -> Answer {
    let request = Request::get(path).body(Body::empty()).expect("a request");
    let response = router.clone().oneshot(request).await.expect("infallible");
    let (parts, body) = response.into_parts();
    let body = to_bytes(body, usize::MAX)
        .await
        .expect("the body ends well");
    Answer {
        status: parts.status,
        headers: parts.headers,
        body,
    }
}

#[tokio::test]
async fn a_panic_is_a_problem_and_the_service_goes_on() {
    let router = guarded(&settings(), Arc::default());
    let problem = ask(&router, "/panic").await.problem(500, "internal");
    assert!(
        !problem["detail"]
            .as_str()
            .is_some_and(|detail| detail.contains("one is not two"))
    );
    assert_eq!(ask(&router, "/fine").await.status, 200);
}

#[tokio::test]
async fn an_answer_that_never_comes_is_a_problem() {
    ask(&guarded(&hasty(), Arc::default()), "/never")
        .await
        .problem(504, "timeout");
}

#[tokio::test]
async fn more_requests_than_the_bound_are_told_to_come_back() {
    let entered = Arc::new(Notify::new());
    let settings = HttpSettings {
        requests_max: 1,
        request_timeout: Duration::from_secs(1),
        ..settings()
    };
    let router = guarded(&settings, Arc::clone(&entered));
    let first = tokio::spawn({
        let router = router.clone();
        async move { ask(&router, "/never").await }
    });
    entered.notified().await;
    let answer = ask(&router, "/fine").await;
    answer.problem(503, "busy");
    assert_eq!(answer.header("retry-after"), "1");
    first.await.expect("joined").problem(504, "timeout");
    assert_eq!(ask(&router, "/fine").await.status, 200);
}

#[tokio::test]
async fn a_token_is_asked_for_everywhere_but_for_health_and_pages() {
    let token = Some(Token::new("s3cret"));
    let rig = rig_with(
        &HttpSettings {
            token,
            ..settings()
        },
        EngineSettings::default(),
    );
    for path in ["/v1/spaces", "/v1/spaces/void", "/metrics", "/nowhere"] {
        let answer = rig.get(path).await;
        answer.problem(401, "unauthorized");
        assert_eq!(answer.header("www-authenticate"), "Bearer");
    }
    for path in ["/healthz", "/readyz", "/", "/docs/", "/openapi.json"] {
        assert_eq!(rig.get(path).await.status, 200, "{path}");
    }
    // The plain page takes the token from whoever looks at it, keeps it in the tab and sends it in
    // the header. The tests in a browser show the same of the built page.
    for part in ["id=\"ask-token\"", "sessionStorage", "\"Bearer \" + token"] {
        assert!(PLAIN_PAGE.contains(part), "{part}");
    }
    let described = rig.get("/openapi.json").await.json();
    assert_eq!(
        described["components"]["securitySchemes"]["token"]["scheme"],
        "bearer"
    );
    let listed = &described["paths"]["/v1/spaces"]["get"]["security"];
    assert_eq!(listed[0]["token"], serde_json::json!([]));
    for (authorization, status) in [
        ("Bearer s3cret", 200),
        ("bearer s3cret", 200),
        ("Bearer s3cre", 401),
        ("Bearer s3crets", 401),
        ("Bearer", 401),
        ("Basic s3cret", 401),
        ("s3cret", 401),
    ] {
        let request = Request::get("/v1/spaces").header("authorization", authorization);
        let answer = rig
            .ask(request.body(Body::empty()).expect("a request"))
            .await;
        assert_eq!(answer.status.as_u16(), status, "{authorization}");
    }
}
