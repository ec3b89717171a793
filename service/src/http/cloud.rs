//! The places of a space as a point cloud: PLY, as text or binary, whole or what changed.

use std::fmt::Write;
use std::sync::Arc;

use axum::body::Body;
use axum::http::Response;
use axum::http::header::{CONTENT_LENGTH, HeaderValue};
use cognitive_map::{CognitiveMap, Place, PlaceId};
use serde::Deserialize;
use utoipa::ToSchema;

use super::long::LongAnswers;
use super::problem::Problem;
use super::reply;
use super::trajectory::TUM;
use crate::engine::Space;

/// Places that are written at once: an answer of any length takes the memory of this many.
const CHUNK_PLACES: usize = 256;
/// Bytes of a vertex of a binary cloud.
const VERTEX_BYTES: usize = 40;
/// Bytes of the number of a forgotten place.
const NUMBER_BYTES: usize = 4;
/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;

/// How a point cloud is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PlyEncoding {
    /// As text: position, number and visits.
    Ascii,
    /// In binary, little-endian: strength and stamps, too.
    Binary,
}

/// Which point cloud is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CloudForm {
    /// All places, as text.
    Ascii,
    /// In binary: the places that changed after a revision, all of them after revision 0.
    Binary { since_revision: u64 },
}

/// What a binary cloud is of.
struct Selection {
    /// What changed after this revision; 0 for all places.
    since_revision: u64,
    /// The places, by number.
    places: Vec<PlaceId>,
    /// Numbers of places that have been forgotten.
    forgotten: Vec<PlaceId>,
}

/// The answer to who asks for a point cloud.
pub(crate) async fn body(
    long: &LongAnswers,
    space: &Arc<Space>,
    form: CloudForm,
) -> Result<Response<Body>, Problem> {
    let room = long.enter()?;
    let map = space.snapshot().await?;
    match form {
        CloudForm::Ascii => {
            let body = long.body(room, ascii(space.name(), map));
            Ok(reply::with_type(TUM, body))
        }
        CloudForm::Binary { since_revision } => {
            let (of, selected) = (Arc::clone(space), Arc::clone(&map));
            let selection = long
                .make(move || Selection::of(&of, &selected, since_revision))
                .await?;
            let head = selection.head(space.name(), &map);
            let bytes = head.len()
                + selection.places.len() * VERTEX_BYTES
                + selection.forgotten.len() * NUMBER_BYTES;
            let body = long.body(room, binary(head, selection, map));
            let mut response = reply::with_type("application/octet-stream", body);
            let length = HeaderValue::from(bytes);
            response.headers_mut().insert(CONTENT_LENGTH, length);
            Ok(response)
        }
    }
}

/// The parts of a cloud as text.
fn ascii(space: &str, map: Arc<CognitiveMap>) -> impl Iterator<Item = String> + use<> {
    let head = format!(
        "ply\nformat ascii 1.0\ncomment places of the cogmap space {space}\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\n\
         property uint id\nproperty uint visits\nend_header\n",
        map.place_count()
    );
    let mut first = Some(0);
    let lines = std::iter::from_fn(move || {
        let mut lines = String::new();
        for (id, place) in map.places_from(PlaceId(first?)).take(CHUNK_PLACES) {
            let at = place.position();
            let visits = n_visits(place);
            writeln!(lines, "{} {} {} {} {visits}", at.x, at.y, at.z, id.0)
                .expect("a text takes what fits into memory");
            first = id.0.checked_add(1);
        }
        (!lines.is_empty()).then_some(lines)
    });
    std::iter::once(head).chain(lines)
}

/// The parts of a binary cloud.
fn binary(
    head: String,
    selection: Selection,
    map: Arc<CognitiveMap>,
) -> impl Iterator<Item = Vec<u8>> {
    let Selection {
        places, forgotten, ..
    } = selection;
    let mut first = 0;
    let vertices = std::iter::from_fn(move || {
        let some = places.get(first..)?.iter().take(CHUNK_PLACES);
        let bytes: Vec<u8> = some.flat_map(|id| vertex(&map, *id)).collect();
        first += CHUNK_PLACES;
        (!bytes.is_empty()).then_some(bytes)
    });
    let numbers: Vec<u8> = { forgotten.into_iter() }
        .flat_map(|id| id.0.to_le_bytes())
        .collect();
    std::iter::once(head.into_bytes())
        .chain(vertices)
        .chain((!numbers.is_empty()).then_some(numbers))
}

/// The bytes of a place.
///
/// # Panics
/// The map has no such place.
fn vertex(map: &CognitiveMap, id: PlaceId) -> [u8; VERTEX_BYTES] {
    let place = map.place(id).expect("the map that it was selected from");
    let at = place.position();
    let strength = map.place_strength(id);
    let mut bytes = [0; VERTEX_BYTES];
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a cloud is drawn: a millimetre in ten kilometres is enough"
    )]
    let single = |number: f64| (number as f32).to_le_bytes();
    bytes[..4].copy_from_slice(&id.0.to_le_bytes());
    bytes[4..8].copy_from_slice(&single(at.x));
    bytes[8..12].copy_from_slice(&single(at.y));
    bytes[12..16].copy_from_slice(&single(at.z));
    bytes[16..20].copy_from_slice(&single(strength));
    bytes[20..24].copy_from_slice(&n_visits(place).to_le_bytes());
    let seconds = |stamp_ns: i64| (stamp_ns as f64 / NS_PER_S).to_le_bytes();
    bytes[24..32].copy_from_slice(&seconds(place.first_stamp_ns()));
    bytes[32..40].copy_from_slice(&seconds(place.last_stamp_ns()));
    bytes
}

/// Visits of a place, as far as the format counts.
fn n_visits(place: &Place) -> u32 {
    u32::try_from(place.visits()).unwrap_or(u32::MAX)
}

impl Selection {
    /// What changed after a revision; everything where the space does not know, or where that is
    /// shorter.
    fn of(space: &Space, map: &CognitiveMap, since_revision: u64) -> Self {
        if since_revision > 0 && space.knows_changes_since(since_revision, map) {
            let (mut places, mut forgotten) = (Vec::new(), Vec::new());
            let bound = map.place_count();
            for id in map.places_near_changes(since_revision) {
                if map.place(id).is_some() {
                    places.push(id);
                } else {
                    forgotten.push(id);
                }
                if forgotten.len() > bound {
                    return Self::all(map);
                }
            }
            return Self {
                since_revision,
                places,
                forgotten,
            };
        }
        Self::all(map)
    }

    fn all(map: &CognitiveMap) -> Self {
        Self {
            since_revision: 0,
            places: map.places().map(|(id, _)| id).collect(),
            forgotten: Vec::new(),
        }
    }

    /// The header of the file.
    fn head(&self, space: &str, map: &CognitiveMap) -> String {
        let forgotten = if self.since_revision > 0 {
            let count = self.forgotten.len();
            format!("element forgotten {count}\nproperty uint id\n")
        } else {
            String::new() // a plain cloud, for any reader of the format
        };
        format!(
            "ply\nformat binary_little_endian 1.0\ncomment places of the cogmap space {space}\n\
             comment revision {}\ncomment since_revision {}\nelement vertex {}\n\
             property uint id\nproperty float x\nproperty float y\nproperty float z\n\
             property float strength\nproperty uint visits\n\
             property double first_s\nproperty double last_s\n{forgotten}end_header\n",
            map.revision(),
            self.since_revision,
            self.places.len()
        )
    }
}
