//! About what views are centred.

use nalgebra::{DMatrix, RowDVector};

use super::runs::Runs;
use crate::keyframes::SampleKey;
use crate::tuning::similarity as tuning;

/// The means about which views are taken. A long session is centred about its own mean: seasons
/// and hours change all views alike.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Centres {
    /// The mean of all views.
    pub(super) whole: RowDVector<f64>,
    /// Those of long sessions, by agent and session.
    pub(super) own: Vec<((u32, u32), RowDVector<f64>)>,
}

impl Centres {
    /// Of the views of a channel.
    pub(super) fn of(runs: &Runs<'_>) -> Self {
        let views = rows(runs);
        let mut own = Vec::new();
        let mut begin = 0;
        while let Some(first) = runs.views.get(begin) {
            let session = session(&first.sample);
            let of_session = runs.views[begin..].iter();
            let count = of_session
                .take_while(|view| self::session(&view.sample) == session)
                .count();
            if count >= tuning::SESSION_VIEWS_MIN {
                own.push((session, views.rows(begin, count).row_mean()));
            }
            begin += count;
        }
        Self {
            whole: views.row_mean(),
            own,
        }
    }

    /// The mean about which the views of a sample's session are taken.
    fn of_sample(&self, sample: &SampleKey) -> &RowDVector<f64> {
        let session = session(sample);
        let own = self.own.iter().find(|(of, _)| *of == session);
        own.map_or(&self.whole, |(_, mean)| mean)
    }

    /// The views of a channel, one a row, about their means.
    pub(super) fn centred(&self, runs: &Runs<'_>) -> DMatrix<f64> {
        let mut views = rows(runs);
        for (mut row, view) in views.row_iter_mut().zip(&runs.views) {
            row -= self.of_sample(&view.sample);
        }
        views
    }
}

fn session(sample: &SampleKey) -> (u32, u32) {
    (sample.agent, sample.session)
}

fn rows(runs: &Runs<'_>) -> DMatrix<f64> {
    let width = runs.views.first().map_or(0, |view| view.vector.len());
    DMatrix::from_fn(runs.len(), width, |row, column| {
        f64::from(runs.views[row].vector[column])
    })
}
