//! Trajectories, as JSON or in the TUM format.

use ::trajectory::write_tum;
use axum::body::Body;
use axum::extract::State;
use axum::http::header::{ACCEPT, HeaderMap, HeaderValue, LINK};
use axum::http::{Response, Uri};
use cogmap_proto::Trajectory;
use serde::Deserialize;
use utoipa::ToSchema;

use super::extract::{AgentName, AgentParams, Query};
use super::page;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use crate::answer::agent_once_named;
use crate::encode;

/// Media type of the TUM format.
pub(crate) const TUM: &str = "text/plain; charset=utf-8";

/// Form of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TrajectoryFormat {
    /// A JSON object.
    Json,
    /// Lines `t x y z qx qy qz qw`, t in seconds.
    Tum,
}

/// Which trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TrajectoryKind {
    /// Each pose as it was known when its sample was applied.
    #[default]
    Causal,
    /// Each pose by all that has been seen since.
    Refined,
}

/// Which part of the trajectory, and in which form.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TrajectoryQuery {
    /// `json` or `tum`; when absent, `tum` if `Accept` asks for text/plain.
    #[param(inline)]
    format: Option<TrajectoryFormat>,
    /// `causal` (when absent): each pose as it was known when its sample was applied. `refined`: by
    /// all that has been seen since; of all sessions, and between two of its poses the agent moved
    /// evenly.
    #[param(inline)]
    kind: Option<TrajectoryKind>,
    /// Only poses of this session; of the current one when absent. For causal trajectories only.
    session: Option<u64>,
    /// Only poses at or after this stamp \[ns\].
    from_ns: Option<i64>,
    /// Only poses before this stamp \[ns\].
    to_ns: Option<i64>,
    /// Most poses in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// The trajectory of an agent: each pose as it was known when its sample was applied, or by all
/// that has been seen since.
///
/// For a refined trajectory the whole map is relaxed, which may take seconds.
/// The next page begins at `next_from_ns`; in the TUM format the header `Link` names it.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}/trajectory", tag = "agents",
    operation_id = "get_agent_trajectory", params(AgentParams, TrajectoryQuery),
    responses(
        (status = 200, description = "The poses, oldest first", content(
            (Trajectory = "application/json"), (String = "text/plain"))),
        (status = 404, description = "There is no such space or agent"),
        (status = 422, description = "A session was named for a refined trajectory, or the span \
            ends before it begins")))]
pub(crate) async fn get(
    State(service): State<Service>,
    AgentName(space, agent): AgentName,
    Query(query): Query<TrajectoryQuery>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    agent_once_named(&space, agent.as_str())?;
    let (name, from_ns, to_ns) = (agent.as_str(), query.from_ns, query.to_ns);
    if let Some((from, to)) = from_ns.zip(to_ns)
        && from > to
    {
        let detail = format!("from_ns {from} must not be after to_ns {to}");
        return Err(Problem::new(Kind::InvalidQuery, detail));
    }
    let read = match query.kind.unwrap_or_default() {
        TrajectoryKind::Causal => {
            space
                .trajectory(name, query.session, from_ns, to_ns, limit)
                .await?
        }
        TrajectoryKind::Refined if query.session.is_some() => {
            return Err(Problem::new(
                Kind::InvalidQuery,
                "`session` is for causal trajectories only",
            ));
        }
        TrajectoryKind::Refined => {
            space
                .refined_trajectory(name, from_ns, to_ns, limit)
                .await?
        }
    };
    let format = query.format.unwrap_or_else(|| accepted(&headers));
    // A page is a text of a thousand poses.
    let written = service.long.make(move || {
        if format == TrajectoryFormat::Json {
            let (poses, next) = (&read.poses, read.next_from_ns);
            let name = agent.as_str();
            return reply::json(&encode::trajectory(
                name,
                read.session,
                read.revision,
                poses,
                next,
            ));
        }
        let mut response = reply::with_type(TUM, Body::from(write_tum(&read.poses)));
        if let Some(next) = read.next_from_ns {
            let session = read.revision.is_none().then_some(read.session);
            let link = next_page(&uri, session, next);
            response.headers_mut().insert(LINK, link);
        }
        response
    });
    written.await
}

fn accepted(headers: &HeaderMap) -> TrajectoryFormat {
    let accept = headers
        .get(ACCEPT)
        .and_then(|accept| accept.to_str().ok())
        .unwrap_or_default();
    let mut types = accept
        .split(',')
        .map(|range| range.split(';').next().unwrap_or("").trim());
    if types.any(|range| range.eq_ignore_ascii_case("text/plain")) {
        TrajectoryFormat::Tum
    } else {
        TrajectoryFormat::Json
    }
}

/// `Link` to the page that begins at `from_ns`. The session of a causal trajectory stays the same
/// even if the agent begins another one meanwhile.
fn next_page(uri: &Uri, session: Option<u64>, from_ns: i64) -> HeaderValue {
    let kept = uri.query().unwrap_or_default().split('&').filter(|pair| {
        !pair.is_empty() && !pair.starts_with("from_ns=") && !pair.starts_with("session=")
    });
    let session = session.map(|session| format!("session={session}"));
    let from = format!("from_ns={from_ns}");
    let query = kept
        .chain(session.as_deref())
        .chain(std::iter::once(from.as_str()))
        .collect::<Vec<_>>()
        .join("&");
    let link = format!("<{}?{query}>; rel=\"next\"", uri.path());
    HeaderValue::try_from(link).expect("a URI is visible ASCII, and so are numbers")
}

#[cfg(test)]
mod tests {
    use ::trajectory::StampedPose;
    use nalgebra::Isometry3;

    use super::*;

    #[test]
    fn stamps_keep_their_nanoseconds_and_sign() {
        let pose = |stamp_ns| StampedPose {
            stamp_ns,
            pose: Isometry3::translation(1.5, -2.0, 0.0),
        };
        let stamps = [1_700_000_000_123_456_789, -1, 0, i64::MIN];
        let text = write_tum(&stamps.map(pose));
        let first: Vec<_> = text
            .lines()
            .map(|line| line.split(' ').next().expect("a stamp"))
            .collect();
        assert_eq!(
            first,
            [
                "1700000000.123456789",
                "-0.000000001",
                "0.000000000",
                "-9223372036.854775808"
            ]
        );
        assert!(
            text.starts_with("1700000000.123456789 1.5 -2 0 0 0 0 1\n"),
            "{text}"
        );
    }

    #[test]
    fn the_next_page_keeps_the_other_parameters() {
        let uri: Uri = "/t?format=tum&from_ns=1&limit=2&session=4"
            .parse()
            .expect("a URI");
        let link = next_page(&uri, Some(5), -7);
        assert_eq!(
            link,
            "</t?format=tum&limit=2&session=5&from_ns=-7>; rel=\"next\""
        );
    }
}
