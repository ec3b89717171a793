//! Search for positions that match a code, in the box that holds all places.

use std::sync::Arc;

use crate::settings::Settings;
use grid::{Ball, Extent, GridModules, PartialCode, PositionSearch, Search};

/// The box that holds all places, and the search for boxes of its size.
///
/// The box grows and shrinks with the places. The search rounds its edges up to powers of two, so
/// that a growing world seldom needs another one.
#[derive(Clone, Debug)]
pub(super) struct CodeSearch {
    /// `None` as long as there is no place.
    fitted: Option<(Extent, Arc<PositionSearch>)>,
    finest_spacing_m: f64,
    modules: usize,
}

impl CodeSearch {
    /// Without places.
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            fitted: None,
            finest_spacing_m: settings.grid_spacing_m,
            modules: settings.grid_modules,
        }
    }

    /// Fits the box of all places; `None` without places.
    pub(super) fn fit(&mut self, extent: Option<Extent>) {
        let Some(extent) = extent else {
            self.fitted = None;
            return;
        };
        match &mut self.fitted {
            Some((known, search)) if search.fits(&extent, self.finest_spacing_m) => {
                *known = extent;
            }
            fitted => {
                let search = PositionSearch::new(&extent, self.finest_spacing_m, self.modules);
                *fitted = Some((extent, Arc::new(search)));
            }
        }
    }

    /// [`PositionSearch::run`] for the box of all places.
    pub(super) fn run(
        &self,
        modules: &GridModules,
        code: &PartialCode,
        tolerance: f64,
        steps_max: u64,
        visit: impl FnMut(&Ball) -> f64,
    ) -> Search {
        let Some((extent, search)) = &self.fitted else {
            return Search::Complete;
        };
        search.run(modules, code, extent, tolerance, steps_max, visit)
    }
}
