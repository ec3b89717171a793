//! Plain HTTP: status, type and body, whatever they are.

use std::io::{BufRead, BufReader};

use serde_json::Value;
use ureq::Agent;
use ureq::http::{Method, Request};

use crate::wait::LONG;

/// An HTTP client that takes every answer as it is.
#[derive(Clone, Debug)]
pub struct Http {
    base: String,
    token: Option<String>,
    agent: Agent,
}

/// An answer.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Its status.
    pub status: u16,
    /// Its `Content-Type`.
    pub content_type: String,
    /// Its body.
    pub body: String,
}

impl Http {
    /// A client of the service at `base`.
    pub fn new(base: &str) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(LONG))
            .proxy(None)
            .build();
        Self {
            base: base.to_owned(),
            token: None,
            agent: config.new_agent(),
        }
    }

    /// The same with a bearer token.
    #[must_use]
    pub fn with_token(&self, token: &str) -> Self {
        Self {
            token: Some(token.to_owned()),
            ..self.clone()
        }
    }

    /// Sends a request; an error says why there was no answer.
    ///
    /// # Errors
    /// The connection failed or broke.
    pub fn try_request(
        &self,
        method: &Method,
        path: &str,
        content: Option<(&str, &[u8])>,
    ) -> Result<Answer, String> {
        let mut request = Request::builder()
            .method(method)
            .uri(format!("{}{path}", self.base));
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        if let Some((content_type, _)) = content {
            request = request.header("content-type", content_type);
        }
        let body = content.map_or(&[][..], |(_, body)| body);
        let response = match content {
            Some(_) => self.agent.run(request.body(body).expect("a request")),
            None => self.agent.run(request.body(()).expect("a request")),
        };
        let mut response = response.map_err(|error| format!("{method} {path}: {error}"))?;
        let content_type = response.headers().get("content-type");
        Ok(Answer {
            status: response.status().as_u16(),
            content_type: content_type.map_or_else(String::new, |content_type| {
                content_type.to_str().unwrap_or_default().to_owned()
            }),
            body: response
                .body_mut()
                .with_config()
                .limit(256 << 20)
                .read_to_string()
                .map_err(|error| format!("{method} {path}: {error}"))?,
        })
    }

    /// Gets a path.
    pub fn get(&self, path: &str) -> Answer {
        self.request(&Method::GET, path, None)
    }

    /// Posts a body.
    pub fn post(&self, path: &str, content_type: &str, body: &[u8]) -> Answer {
        self.request(&Method::POST, path, Some((content_type, body)))
    }

    /// Posts JSON.
    pub fn post_json(&self, path: &str, body: &Value) -> Answer {
        self.post(path, "application/json", body.to_string().as_bytes())
    }

    /// Puts JSON.
    pub fn put_json(&self, path: &str, body: &Value) -> Answer {
        let body = body.to_string();
        self.request(
            &Method::PUT,
            path,
            Some(("application/json", body.as_bytes())),
        )
    }

    fn request(&self, method: &Method, path: &str, content: Option<(&str, &[u8])>) -> Answer {
        self.try_request(method, path, content)
            .unwrap_or_else(|error| panic!("{error}"))
    }

    /// Opens an event stream and passes the data of each event to `take`, until the stream ends.
    /// `opened` is called once the stream is open. Says how it ended.
    ///
    /// # Errors
    /// The stream broke instead of ending.
    pub fn follow(
        &self,
        path: &str,
        opened: impl FnOnce(),
        mut take: impl FnMut(Value),
    ) -> Result<(), String> {
        let response = self
            .agent
            .get(format!("{}{path}", self.base))
            .call()
            .map_err(|error| error.to_string())?;
        assert_eq!(response.status(), 200);
        opened();
        for line in BufReader::new(response.into_body().into_reader()).lines() {
            let line = line.map_err(|error| error.to_string())?;
            if let Some(data) = line.strip_prefix("data:") {
                take(serde_json::from_str(data).expect("the data of an event is JSON"));
            }
        }
        Ok(())
    }
}

impl Answer {
    /// The body as JSON, of an answer with this status.
    pub fn json(&self, status: u16) -> Value {
        assert_eq!(self.status, status, "{self:?}");
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// The problem document with this status and kind.
    pub fn problem(&self, status: u16, kind: &str) -> Value {
        let problem = self.json(status);
        assert_eq!(self.content_type, "application/problem+json", "{self:?}");
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{self:?}");
        assert_eq!(problem["status"], status, "{self:?}");
        for text in ["title", "detail"] {
            assert!(problem[text].as_str().is_some_and(|text| !text.is_empty()));
        }
        problem
    }
}
