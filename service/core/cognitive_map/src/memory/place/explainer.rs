//! Where in the world of the places to look for those that answer a code.

use std::sync::Arc;

use crate::settings::Settings;
use grid::{Ball, Explainer, Extent, GridModules, PartialCode, Search};

/// The box that all places lie in, and what explains codes in boxes of its size.
///
/// It grows and shrinks with the places. For the explainer its edges are rounded up to powers of two,
/// so that a growing world seldom needs another one.
#[derive(Clone, Debug)]
pub(super) struct PlaceExplainer {
    /// None as long as there is no place.
    fitted: Option<(Extent, Arc<Explainer>)>,
    finest_spacing_m: f64,
    modules: usize,
}

impl PlaceExplainer {
    /// For no places yet.
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            fitted: None,
            finest_spacing_m: settings.grid_spacing_m,
            modules: settings.grid_modules,
        }
    }

    /// Fits the box of all places; none if there is no place.
    pub(super) fn fit(&mut self, extent: Option<Extent>) {
        let Some(extent) = extent else {
            self.fitted = None;
            return;
        };
        match &mut self.fitted {
            Some((known, explainer)) if explainer.serves(&extent, self.finest_spacing_m) => {
                *known = extent;
            }
            fitted => {
                let explainer = Explainer::new(&extent, self.finest_spacing_m, self.modules);
                *fitted = Some((extent, Arc::new(explainer)));
            }
        }
    }

    /// [`Explainer::explain`] for the box of all places.
    pub(super) fn explain(
        &self,
        modules: &GridModules,
        code: &PartialCode,
        tolerance: f64,
        steps_max: u64,
        visit: impl FnMut(&Ball) -> f64,
    ) -> Search {
        let Some((extent, explainer)) = &self.fitted else {
            return Search::Complete;
        };
        explainer.explain(modules, code, extent, tolerance, steps_max, visit)
    }
}
