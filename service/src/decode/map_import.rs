//! Exports of maps, as the journal takes them in.

use std::collections::BTreeMap;

use cogmap_proto as wire;
use cogmap_proto::SpaceSettings;
use serde::Deserialize;

use super::core_settings;
use super::name::check_name;
use super::remembrance::journaled_remembrance;
use crate::journal::{
    Entry, JournaledPlace, JournaledPose, JournaledRemembrance, JournaledTraversals, JournaledWay,
};

/// What is read of a map's JSON export.
#[derive(Debug, Deserialize)]
struct Export {
    space: Space,
    agents: Vec<Agent>,
    places: Vec<wire::Place>,
    ways: Vec<wire::Way>,
}

#[derive(Debug, Deserialize)]
struct Space {
    settings: SpaceSettings,
}

#[derive(Debug, Deserialize)]
struct Agent {
    name: String,
}

/// A map to be taken in.
#[derive(Debug)]
pub struct MapImport {
    /// Settings of the space that it was exported from.
    pub settings: SpaceSettings,
    /// What is journaled, in order.
    pub entries: Vec<Entry<'static>>,
}

/// Why an export cannot be taken in.
#[derive(Debug, thiserror::Error)]
pub enum InvalidImport {
    /// It is none.
    #[error("this is no JSON export of a map: {0}")]
    Malformed(#[from] serde_json::Error),
    /// Its settings are none.
    #[error("the settings of the space make no sense: {0}")]
    Settings(String),
    /// Something in it makes no sense.
    #[error("{0} {1} makes no sense")]
    Nonsense(&'static str, String),
}

/// The map of an export: its agents by name, its places and its ways.
///
/// # Errors
/// Says what makes no sense.
pub fn map_import(export: &str) -> Result<MapImport, InvalidImport> {
    let export: Export = serde_json::from_str(export)?;
    core_settings(&export.space.settings)
        .map_err(|error| InvalidImport::Settings(error.to_string()))?;
    let agents = export.agents.into_iter().map(|agent| agent.name);
    let founders = export.places.iter().map(|place| place.founder.clone());
    let mut numbers: BTreeMap<String, u32> = agents.chain(founders).map(|name| (name, 0)).collect();
    let mut entries = Vec::new();
    for ((name, number), next) in numbers.iter_mut().zip(0..) {
        check_name(name).map_err(|_| InvalidImport::Nonsense("the agent", name.clone()))?;
        *number = next;
        let name = name.clone().into();
        entries.push(Entry::Enrol { agent: next, name });
    }
    let mut places = export.places;
    places.sort_by_key(|place| place.id);
    for was in &places {
        let place = place(was, numbers[&was.founder]);
        entries.push(checked(
            place.map(JournaledRemembrance::Place),
            "the place",
            was.id,
        )?);
    }
    for was in &export.ways {
        let way = way(was).map(|way| JournaledRemembrance::Way(Box::new(way)));
        entries.push(checked(way, "the way from", was.from)?);
    }
    Ok(MapImport {
        settings: export.space.settings,
        entries,
    })
}

fn checked(
    remembrance: Option<JournaledRemembrance>,
    what: &'static str,
    number: u64,
) -> Result<Entry<'static>, InvalidImport> {
    let makes_sense = |journaled: &JournaledRemembrance| journaled_remembrance(journaled).is_some();
    let remembrance = remembrance.filter(makes_sense);
    let remembrance =
        remembrance.ok_or_else(|| InvalidImport::Nonsense(what, number.to_string()))?;
    Ok(Entry::Remember { remembrance })
}

fn place(was: &wire::Place, founder: u32) -> Option<JournaledPlace> {
    Some(JournaledPlace {
        place: u32::try_from(was.id).ok()?,
        pose: JournaledPose {
            translation_m: was.translation_m,
            rotation_xyzw: was.rotation_xyzw,
        },
        position_sd_m: was.position_sd_m,
        founder,
        visits: was.visits,
        first_stamp_ns: was.first_stamp_ns,
        last_stamp_ns: was.last_stamp_ns,
        strength: was.strength,
    })
}

fn way(was: &wire::Way) -> Option<JournaledWay> {
    let pose = |translation_m, rotation_xyzw| JournaledPose {
        translation_m,
        rotation_xyzw,
    };
    let [x, y, z] = was.translation_sd_m;
    let [roll, pitch, yaw] = was.rotation_sd_rad;
    Some(JournaledWay {
        ends: [u32::try_from(was.from).ok()?, u32::try_from(was.to).ok()?],
        poses: [
            pose(was.from_m, was.from_rotation_xyzw),
            pose(was.to_m, was.to_rotation_xyzw),
        ],
        travelled: [traversals(&was.there), traversals(&was.back)],
        relative: pose(was.translation_m, was.rotation_xyzw),
        sd: [x, y, z, roll, pitch, yaw],
        measurements: was.measurements,
        shortest_m: was.length_m,
        strength: was.strength,
    })
}

fn traversals(were: &wire::WayTraversals) -> Option<JournaledTraversals> {
    Some(JournaledTraversals {
        times: were.times,
        fastest_s: were.fastest_s?,
        mean_s: were.mean_s?,
        last_stamp_ns: were.last_stamp_ns?,
    })
}
