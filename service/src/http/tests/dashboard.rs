//! The page: its files, how they are cached, and what stands for it where it was not built.

use axum::response::Response;
use rust_embed::Embed;

use super::*;
use crate::http::dashboard;

/// A page that is small enough to be read here.
#[derive(Embed)]
#[folder = "src/http/tests/page"]
struct Page;

/// A page that was not built.
#[derive(Embed)]
#[folder = "src/http/tests/no_page"]
#[allow_missing = true]
struct NoPage;

async fn ask<F: Embed + 'static>(path: &str, tag: Option<&str>) -> Response<Body> {
    let mut request = Request::get(path);
    if let Some(tag) = tag {
        request = request.header("if-none-match", tag);
    }
    let request = request.body(Body::empty()).expect("a request");
    let answer = dashboard::routes::<(), F>().oneshot(request).await;
    answer.expect("infallible")
}

fn header(answer: &Response<Body>, name: &str) -> String {
    let value = answer.headers().get(name).map(|value| value.to_str());
    value.expect("it is there").expect("a text").to_owned()
}

async fn text(answer: Response<Body>) -> String {
    let body = to_bytes(answer.into_body(), usize::MAX).await;
    String::from_utf8(body.expect("readable").to_vec()).expect("a text")
}

#[tokio::test]
async fn the_page_may_run_what_comes_from_the_service_and_nothing_else() {
    let page = ask::<Page>("/", None).await;
    assert_eq!(page.status(), 200);
    assert_eq!(header(&page, "content-type"), "text/html; charset=utf-8");
    assert_eq!(header(&page, "x-content-type-options"), "nosniff");
    let policy = header(&page, "content-security-policy");
    assert!(policy.starts_with("default-src 'none'"), "{policy}");
    assert!(policy.contains("script-src 'self';"), "{policy}");
    assert!(!policy.contains("unsafe"), "{policy}");
    assert!(text(page).await.contains("/assets/app-1f2e.js"));
    let script = ask::<Page>("/assets/app-1f2e.js", None).await;
    let kind = header(&script, "content-type");
    assert_eq!(kind, "text/javascript; charset=utf-8");
    let style = ask::<Page>("/assets/deep/look-77aa.css", None).await;
    assert_eq!(header(&style, "content-type"), "text/css; charset=utf-8");
    for missing in [
        "/assets/app.js",
        "/assets/../../mod.rs",
        "/assets/%2e%2e/%2e%2e/mod.rs",
    ] {
        assert_eq!(ask::<Page>(missing, None).await.status(), 404, "{missing}");
    }
}

#[tokio::test]
async fn files_are_kept_for_ever_and_the_page_is_asked_for_again() {
    for (path, caching) in [
        ("/", "no-cache"),
        ("/assets/app-1f2e.js", "public, max-age=31536000, immutable"),
    ] {
        let first = ask::<Page>(path, None).await;
        assert_eq!(header(&first, "cache-control"), caching);
        let tag = header(&first, "etag");
        for known in [tag.clone(), format!("\"other\", {tag}"), format!("W/{tag}")] {
            let again = ask::<Page>(path, Some(&known)).await;
            assert_eq!(again.status(), 304, "{known}");
            assert_eq!(header(&again, "etag"), tag);
            assert!(text(again).await.is_empty());
        }
        assert_eq!(ask::<Page>(path, Some("\"other\"")).await.status(), 200);
    }
}

#[tokio::test]
async fn where_the_page_was_not_built_a_plain_one_says_how() {
    let page = ask::<NoPage>("/", None).await;
    assert_eq!(page.status(), 200);
    assert!(text(page).await.contains("make dashboard"));
    let script = ask::<NoPage>("/assets/app-1f2e.js", None).await;
    assert_eq!(script.status(), 404);
}

#[tokio::test]
async fn the_page_needs_no_token() {
    let mut settings = settings();
    settings.token = Some(Token::new("secret"));
    let rig = rig_with(&settings, EngineSettings::default());
    assert_eq!(rig.get("/").await.status, 200);
    assert_eq!(rig.get("/assets/none.js").await.status, 404);
    assert_eq!(rig.get("/v1/spaces").await.status, 401);
}
