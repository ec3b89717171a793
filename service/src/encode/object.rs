//! What is known of objects.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, KnownObject};
use object_recognition::{Density, LevelMemory, ModelPlace, ObjectId, ObjectModel};

/// An object of a map: its number, what is known of it, and its model.
type Known<'a> = (ObjectId, &'a KnownObject, &'a ObjectModel);

/// What is known of an object.
pub fn object_summary(map: &CognitiveMap, (id, known, model): Known<'_>) -> wire::ObjectSummary {
    let density = map.object_density(id);
    let corner = |pick: fn(f64, f64) -> f64| {
        let positions = model.places().iter().map(|place| place.position_m);
        let corner = positions.reduce(|a, b| a.coords.zip_map(&b.coords, pick).into());
        corner.map_or([0.0; 3], |corner| corner.coords.into())
    };
    wire::ObjectSummary {
        name: known.name().as_str().to_owned(),
        places: model.places().len() as u64,
        spacing_m: model.spacing_m(),
        min_m: corner(f64::min),
        max_m: corner(f64::max),
        contacts: known.contacts(),
        visits: known.visits(),
        gap_m: density.as_ref().map(|density| density.gap_m),
        advised_gap_m: density.as_ref().and_then(Density::advised_gap_m),
        alike: None,
    }
}

/// An object with its places.
pub fn object_detail(map: &CognitiveMap, object: Known<'_>) -> wire::ObjectDetail {
    wire::ObjectDetail {
        summary: object_summary(map, object),
        places: { object.2.places().iter() }
            .map(|place| object_place(map, place))
            .collect(),
    }
}

/// Another object for which one would be taken, and how probably.
pub fn object_alike(
    map: &CognitiveMap,
    alike: Option<(ObjectId, f64)>,
) -> Option<wire::ObjectProbability> {
    let (id, probability) = alike?;
    let name = map.object(id)?.name().as_str().to_owned();
    Some(wire::ObjectProbability { name, probability })
}

fn object_place(map: &CognitiveMap, place: &ModelPlace) -> wire::ObjectPlace {
    let level = |level: &LevelMemory| {
        Some(wire::ObjectLevel {
            channel: map.object_channel(level.channel)?.as_str().to_owned(),
            mean: level.mean,
            sd: level.variance().max(0.0).sqrt(),
        })
    };
    wire::ObjectPlace {
        position_m: place.position_m.coords.into(),
        normal: place.normal().map(|normal| normal.into_inner().into()),
        contacts: place.count,
        levels: place.levels.iter().filter_map(level).collect(),
    }
}
