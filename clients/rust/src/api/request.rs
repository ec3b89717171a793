//! Sending requests: to which address, and again where that helps.

use std::thread;
use std::time::Duration;

use ureq::http::{Method, Request, Response};

use super::exchange::{Content, whole};
use super::retry::{Repeat, Retries, may_go_elsewhere};
use super::{Api, ApiError};

impl Api {
    /// Asks at a further address, too: that of another node of the same cluster. When nothing
    /// listens at one address the next one is asked, and stays in use; for `GET` and for samples
    /// also when the connection breaks.
    #[must_use]
    pub fn or_at(mut self, base: &str) -> Self {
        self.addresses = self.addresses.and(base);
        self
    }

    /// Sets how long a request is sent again while its space moves to another owner
    /// (`/problems/moving`), with the pauses that the service asks for: 30 s unless set, not at all
    /// with zero. `GET` and samples, which are applied once however often they come, are sent again
    /// also when the owner did not answer (`/problems/owner-lost`). What the service says after
    /// that time is an [`ApiError::Problem`].
    #[must_use]
    pub fn retry_timeout(mut self, timeout: Duration) -> Self {
        self.retry_timeout = timeout;
        self
    }

    /// Sends a request, again while its space moves.
    pub(super) fn run(
        &self,
        method: &Method,
        path: &str,
        content: Option<&Content>,
    ) -> Result<Response<Vec<u8>>, ApiError> {
        let repeat = match content {
            Some(content) => content.repeat,
            None if *method == Method::GET => Repeat::Harmless,
            None => Repeat::Once,
        };
        let retries = Retries::new(self.retry_timeout, repeat);
        loop {
            let answer = self.run_anywhere(method, path, content, repeat)?;
            let Some(pause) = retries.pause_after(&answer) else {
                return Ok(answer);
            };
            // Another one may know better where the space is.
            self.addresses.leave(self.addresses.in_use().0);
            thread::sleep(pause);
        }
    }

    /// Sends a request to the address in use, or else to the next one that answers.
    fn run_anywhere(
        &self,
        method: &Method,
        path: &str,
        content: Option<&Content>,
        repeat: Repeat,
    ) -> Result<Response<Vec<u8>>, ApiError> {
        let mut left = self.addresses.len();
        loop {
            let (index, base) = self.addresses.in_use();
            let answer = self.run_once(method, &format!("{base}{path}"), content);
            left -= 1;
            let Err(error @ ApiError::Transport(_)) = answer else {
                return answer;
            };
            // The next request at least shall go elsewhere.
            self.addresses.leave(index);
            if left == 0 || !may_go_elsewhere(&error, repeat) {
                return Err(error);
            }
        }
    }

    fn run_once(
        &self,
        method: &Method,
        url: &str,
        content: Option<&Content>,
    ) -> Result<Response<Vec<u8>>, ApiError> {
        let mut request = Request::builder()
            .method(method)
            .uri(url)
            .header("accept", "application/json");
        if let Some(token) = &self.token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let response = match content {
            Some(content) => {
                let request = request
                    .header("content-type", content.kind)
                    .body(content.bytes.as_slice())
                    .map_err(ureq::Error::from)?;
                self.agent.run(request)?
            }
            None => self
                .agent
                .run(request.body(()).map_err(ureq::Error::from)?)?,
        };
        whole(response)
    }
}
