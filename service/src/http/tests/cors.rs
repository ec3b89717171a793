//! Pages of other origins: those of the settings may ask, others may not.

use axum::http::Response;

use super::*;

const PAGE: &str = "https://map.example.org";

fn rig_for_page() -> Rig {
    let mut settings = settings();
    settings.token = Some(Token::new("secret"));
    settings.hosts = HostRule::new(&["localhost".to_owned()], true);
    settings.cors_origins = vec![PAGE.to_owned()];
    rig_with(&settings, EngineSettings::default())
}

impl Rig {
    async fn ask_as_page(&self, method: Method, origin: &str, headers: &[(&str, &str)]) -> Answer {
        let mut request = Request::builder()
            .method(method)
            .uri("/v1/spaces/lab")
            .header("host", "localhost")
            .header("origin", origin);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(Body::empty()).expect("a request");
        let response: Response<Body> =
            { self.router.clone().oneshot(request).await }.expect("infallible");
        let (parts, body) = response.into_parts();
        Answer {
            status: parts.status,
            headers: parts.headers,
            body: to_bytes(body, usize::MAX).await.expect("readable"),
        }
    }
}

#[tokio::test]
async fn a_browser_that_asks_before_the_page_may_is_told_so_without_a_token() {
    let rig = rig_for_page();
    let wish = [
        ("access-control-request-method", "PUT"),
        (
            "access-control-request-headers",
            "authorization,content-type",
        ),
    ];
    let told = rig.ask_as_page(Method::OPTIONS, PAGE, &wish).await;
    assert_eq!(told.status, 200, "{told:?}");
    assert_eq!(told.header("access-control-allow-origin"), PAGE);
    let methods = told.header("access-control-allow-methods");
    assert!(methods.contains("PUT") && methods.contains("DELETE"));
    let headers = told.header("access-control-allow-headers");
    assert!(headers.contains("authorization") && headers.contains("last-event-id"));
    let other = rig
        .ask_as_page(Method::OPTIONS, "https://other.example", &wish)
        .await;
    assert_eq!(other.header("access-control-allow-origin"), "");
}

#[tokio::test]
async fn a_page_of_the_settings_may_read_and_change_what_its_token_opens() {
    let rig = rig_for_page();
    let token = [("authorization", "Bearer secret")];
    let read = rig.ask_as_page(Method::GET, PAGE, &token).await;
    assert_eq!(read.status, 200);
    assert_eq!(read.header("access-control-allow-origin"), PAGE);
    // The page can read why it was refused, too.
    let refused = rig.ask_as_page(Method::GET, PAGE, &[]).await;
    assert_eq!(refused.status, 401);
    assert_eq!(refused.header("access-control-allow-origin"), PAGE);
    let changed = rig.ask_as_page(Method::PUT, PAGE, &token).await;
    assert_eq!(changed.status, 200, "{changed:?}");
    let stranger = "https://other.example";
    let other = rig.ask_as_page(Method::GET, stranger, &token).await;
    assert_eq!(other.header("access-control-allow-origin"), "");
    let other = rig.ask_as_page(Method::PUT, stranger, &token).await;
    other.problem(403, "foreign-origin");
}

#[tokio::test]
async fn without_the_setting_no_page_of_another_origin_is_let_in() {
    let rig = rig();
    let read = rig.ask_as_page(Method::GET, PAGE, &[]).await;
    assert_eq!(read.header("access-control-allow-origin"), "");
    let told = rig.ask_as_page(Method::OPTIONS, PAGE, &[]).await;
    assert_eq!(told.header("access-control-allow-origin"), "");
}
