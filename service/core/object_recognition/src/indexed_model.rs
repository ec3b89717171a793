//! A model with its indexes, ready for recognition.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::index::packed_places::PackedPlaces;
use crate::indexed_place::IndexedPlace;
use crate::interpolation::{
    Body, FieldVariants, Fields, LevelProcess, LinkGraph, OpenRegion, Spread, UnpredictedGaps,
    interpolated, missed_share, plane_normal,
};
use crate::level_prior::{LevelPrior, object_levels, without_unusual_levels};
use crate::model::{ModelPlace, ObjectModel};
use crate::numeric::{centroid, floor_u32};
use crate::surfels::map::SurfelMap;

use crate::tuning::{FIELD_PER_SPACING, JOINT_CHANNELS, NODE_STEP, SHARE_BINS, SHARE_SAMPLES};

/// A model ready for recognition: its places, their indexes, and the share of them within a
/// distance.
#[derive(Clone, Debug)]
pub(crate) struct IndexedModel {
    pub(crate) places: Vec<IndexedPlace>,
    /// The same places, packed in the order of their index.
    pub(crate) packed: PackedPlaces,
    /// Diameter of a ball about the mean of the places that holds all of them \[m\].
    pub(crate) extent_m: f64,
    /// Area \[m²\]: one spacing squared per place.
    pub(crate) area_m2: f64,
    /// Typical distance between neighbouring places that were felt \[m\].
    pub(crate) gap_m: f64,
    /// Distance within which contacts are of one place \[m\].
    pub(crate) spacing_m: f64,
    /// Variance of the contacts from which it was learned, per axis \[m²\].
    pub(crate) noise_m2: f64,
    /// Whether its places lie along lines.
    pub(crate) is_curve: bool,
    /// The normal of the plane in which these lie, if they do.
    pub(crate) plane: Option<Vector3<f64>>,
    /// Standard deviation of what was predicted between the places \[m\]; none where nothing was.
    pub(crate) between_sd_m: Option<f64>,
    /// Where contacts fell on places alone: probability that one is with a place that was missed.
    pub(crate) missed_share: Option<f64>,
    /// The gaps between its places, if nothing is predicted there.
    pub(crate) gaps: Option<UnpredictedGaps>,
    /// Distributions of its levels, by channel.
    pub(crate) own_levels: Vec<LevelPrior>,
    /// How its levels vary together, by channel, where what lies between places is predicted.
    pub(crate) level_processes: Vec<LevelProcess>,
    /// Where it goes on beyond what was felt; none of one that was felt all over.
    pub(crate) open: Option<OpenRegion>,
    /// The surface, if the places have normals.
    pub(crate) surfel_map: Option<Arc<SurfelMap>>,
    /// The body that predicts its surface, if one does.
    pub(crate) body: Option<Body>,
    /// By how much the places of a body are likelier chosen than random ones \[nats\].
    pub(crate) chosen_log: Option<f64>,
    shares: [f64; SHARE_BINS + 1],
}

impl IndexedModel {
    /// The variants of a model: by what its places tell, and by the body through them, if it is
    /// uncertain whether anything lies between them.
    pub(crate) fn variants(model: &ObjectModel) -> (Self, Option<Self>) {
        let felt: Vec<_> = { model.places().iter() }
            .map(|place| place.position_m)
            .collect();
        let graph = LinkGraph::new(&felt);
        let usual = without_unusual_levels(model.places());
        let spacing_m = model.spacing_m();
        let spread = Spread::learned(model.places(), &graph, spacing_m);
        let fields = FieldVariants::learned(&usual, &graph, (spread, spacing_m));
        let surfel_map = SurfelMap::new(model).map(Arc::new);
        let of = |fields| Self {
            surfel_map: surfel_map.clone(),
            ..Self::new(model, (&felt, &graph, spread), &usual, fields)
        };
        let body = fields.body.as_ref().map(|body| of(Some(body)));
        (of(fields.places.as_ref()), body)
    }

    /// Of a model that has such fields between its places, which have these links and on which
    /// contacts fall so; `usual` are the places without unusual levels. The surface is left out.
    fn new(
        model: &ObjectModel,
        (felt, graph, spread): (&[Point3<f64>], &LinkGraph, Spread),
        usual: &[ModelPlace],
        fields: Option<&Fields>,
    ) -> Self {
        let spacing_m = model.spacing_m();
        let between = fields.filter(|_| spread == Spread::Even);
        // On a surface contacts fall up to half a link beside a place, or half the step of nodes.
        let is_surface = between.is_some() && !graph.is_curve();
        let field_m = |own| {
            let link_m = graph.mean_link_m(own, felt).filter(|_| is_surface);
            let width_m = link_m.map_or(spacing_m, |link_m| {
                link_m.clamp(spacing_m, NODE_STEP * spacing_m)
            });
            FIELD_PER_SPACING * width_m
        };
        let mut places: Vec<_> = model
            .places()
            .iter()
            .enumerate()
            .map(|(own, place)| IndexedPlace {
                position: place.position_m,
                normal: place.normal(),
                variance_m2: field_m(own).powi(2) + place.variance_m2 / (place.count * place.count),
                prediction: None,
                levels: place.levels.clone(),
                descriptors: place.descriptors.clone(),
            })
            .collect();
        if let Some(fields) = between {
            let nodes = interpolated(usual, graph, fields, spacing_m);
            places.extend(nodes);
        }
        let body = fields.and_then(Fields::body);
        let body = body.filter(|_| between.is_some());
        let chosen_log = body.and_then(|body| body.chosen_log);
        let positions: Vec<_> = places.iter().map(|place| place.position).collect();
        let middle = centroid(positions.iter().map(|position| position.coords));
        let own_levels = object_levels(places.iter().flat_map(|place| &place.levels));
        let processes = own_levels.iter().filter(|_| between.is_some());
        let processes =
            processes.filter_map(|own| LevelProcess::learned(own.channel, usual, graph.typical_m));
        let radius_m = positions
            .iter()
            .map(|p| (p.coords - middle).norm())
            .fold(spacing_m, f64::max);
        let extent_m = 2.0 * radius_m;
        Self {
            packed: PackedPlaces::new(&places, spacing_m, extent_m, model.noise_m2()),
            shares: shares(&positions, extent_m),
            gaps: (fields.is_none() && spread == Spread::Even)
                .then(|| UnpredictedGaps::new(felt, graph, spacing_m))
                .flatten(),
            open: fields.and_then(|fields| {
                let unexpected = fields.body().map(|body| body.unexpected);
                let felt = felt.len();
                OpenRegion::new(&positions, felt, graph, (spread, spacing_m), unexpected)
            }),
            area_m2: positions.len() as f64 * spacing_m * spacing_m,
            surfel_map: None,
            extent_m,
            gap_m: graph.typical_m,
            spacing_m,
            noise_m2: model.noise_m2(),
            is_curve: graph.is_curve(),
            plane: plane_normal(felt).filter(|_| graph.is_curve()),
            between_sd_m: between_sd_m(&places),
            missed_share: (spread == Spread::OnPlaces).then(|| missed_share(model.places())),
            level_processes: processes.take(JOINT_CHANNELS).collect(),
            own_levels,
            body: body.cloned(),
            chosen_log,
            places,
        }
    }

    /// Whether what was predicted is known from the places around alone: no body explains it.
    pub(crate) fn is_vague(&self) -> bool {
        self.shares_errors() && self.body.is_none()
    }

    /// Whether contacts share errors: some of its places were predicted from others.
    pub(crate) fn shares_errors(&self) -> bool {
        self.between_sd_m.is_some()
    }

    /// Correlation of the errors of what is predicted at two points, of which the square of the
    /// distance is given \[m²\]: `reach` is how far they are common, in typical gaps.
    pub(crate) fn error_correlation(&self, square_m2: f64, reach: f64) -> f64 {
        let reach_m = reach * self.gap_m;
        (-0.25 * square_m2 / (reach_m * reach_m).max(f64::MIN_POSITIVE)).exp()
    }

    /// Mean share of the model within `reach_m` of one of its places.
    pub(crate) fn share(&self, reach_m: f64) -> f64 {
        let at = (reach_m / self.extent_m).clamp(0.0, 1.0) * SHARE_BINS as f64;
        let below = (floor_u32(at) as usize).min(SHARE_BINS - 1);
        let part = at - below as f64;
        self.shares[below] * (1.0 - part) + self.shares[below + 1] * part
    }
}

/// Standard deviation of what was predicted between the places \[m\].
fn between_sd_m(places: &[IndexedPlace]) -> Option<f64> {
    let predicted = places.iter().filter(|place| place.prediction.is_some());
    let (count, sum) = predicted.fold((0.0, 0.0), |(count, sum), place| {
        (count + 1.0, sum + place.variance_m2)
    });
    (count > 0.0).then(|| f64::sqrt(sum / count))
}

fn shares(positions: &[Point3<f64>], extent_m: f64) -> [f64; SHARE_BINS + 1] {
    let mut counts = [0.0; SHARE_BINS + 1];
    let step = positions.len().div_ceil(SHARE_SAMPLES).max(1);
    let mut total = 0.0;
    for from in positions.iter().step_by(step) {
        for to in positions {
            let bin = ((to - from).norm() / extent_m * SHARE_BINS as f64).ceil();
            counts[(floor_u32(bin) as usize).min(SHARE_BINS)] += 1.0;
            total += 1.0;
        }
    }
    let mut sum = 0.0;
    counts.map(|count| {
        sum += count;
        if total > 0.0 { sum / total } else { 1.0 }
    })
}
