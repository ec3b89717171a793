//! Views in the order in which agents saw them.

use super::view_log::{LoggedView, ViewLog};
use crate::tuning::similarity as tuning;

/// The views of a channel, by agent, session and time.
#[derive(Debug)]
pub(super) struct Runs<'a> {
    pub(super) views: Vec<&'a LoggedView>,
    /// The run of each view: within one, neighbours are neighbours along the way.
    pub(super) run: Vec<u32>,
    /// Whether each view was added since the log was last matched.
    pub(super) is_new: Vec<bool>,
    /// Difference of the ordinals of neighbours.
    pub(super) stride: u32,
}

impl<'a> Runs<'a> {
    /// The views of a channel.
    pub(super) fn of(log: &'a ViewLog, channel: u8) -> Self {
        let n_old = log.views.len().saturating_sub(log.n_new as usize);
        let numbered = log.views.iter().enumerate();
        let views = numbered.filter(|(_, view)| view.channel == channel);
        let mut views: Vec<(bool, &LoggedView)> = views
            .map(|(number, view)| (number >= n_old, view))
            .collect();
        views.sort_by_key(|(_, view)| {
            (
                view.sample.agent,
                view.sample.session,
                view.stretch,
                view.ordinal,
            )
        });
        Self::of_sorted(views, log.stride)
    }

    /// At most so many of them, evenly thinned.
    pub(super) fn thinned(&self, most: usize) -> Self {
        let numbered = self.is_new.iter().copied().zip(self.views.iter().copied());
        let mut views: Vec<(bool, &LoggedView)> = numbered.collect();
        let mut stride = self.stride;
        let last = views.iter().map(|(_, view)| view.ordinal).max();
        while views.len() > most && last.is_some_and(|last| stride <= last) {
            stride = stride.saturating_mul(2);
            views.retain(|(_, view)| view.ordinal.is_multiple_of(stride));
        }
        if views.len() > most {
            // The first views of many sessions.
            let every = views.len().div_ceil(most.max(1));
            views = views.into_iter().step_by(every).collect();
        }
        Self::of_sorted(views, stride)
    }

    fn of_sorted(views: Vec<(bool, &'a LoggedView)>, stride: u32) -> Self {
        let (is_new, views): (Vec<bool>, Vec<&LoggedView>) = views.into_iter().unzip();
        let mut run = Vec::with_capacity(views.len());
        let mut number = 0;
        for (index, view) in views.iter().enumerate() {
            let goes_on = index.checked_sub(1).is_some_and(|previous| {
                let previous = views[previous];
                let way =
                    |view: &LoggedView| (view.sample.agent, view.sample.session, view.stretch);
                way(previous) == way(view)
                    && previous.ordinal.saturating_add(stride) == view.ordinal
            });
            if index > 0 && !goes_on {
                number += 1;
            }
            run.push(number);
        }
        Self {
            views,
            run,
            is_new,
            stride,
        }
    }

    /// Where each view of a thinned selection of these is among them.
    pub(super) fn places_of(&self, thinned: &Self) -> Vec<usize> {
        let mut places = Vec::with_capacity(thinned.len());
        let mut place = 0;
        for view in &thinned.views {
            while !std::ptr::eq(self.views[place], *view) {
                place += 1;
            }
            places.push(place);
        }
        places
    }

    /// Number of views.
    pub(super) fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether two views are of one run.
    pub(super) fn is_same(&self, a: usize, b: usize) -> bool {
        self.run[a] == self.run[b]
    }

    /// The view so many after another one, if it is of the same run.
    pub(super) fn after(&self, index: usize, lag: isize) -> Option<usize> {
        let other = index.checked_add_signed(lag)?;
        (other < self.len() && self.is_same(index, other)).then_some(other)
    }

    /// Distance between two views of a run by motion alone \[m\].
    pub(super) fn distance_m(&self, a: usize, b: usize) -> f64 {
        let [a, b] = [a, b].map(|index| self.views[index].in_odom.translation.vector);
        (a - b).norm()
    }

    /// Angle that the body has turned by between two views of a run, by motion alone \[rad\].
    pub(super) fn turn_rad(&self, a: usize, b: usize) -> f64 {
        let [a, b] = [a, b].map(|index| self.views[index].in_odom.rotation);
        a.angle_to(&b)
    }
}

/// Fewest views that lie between two of a run that may be matched, of so many in all.
pub(crate) fn gap(n_views: usize) -> usize {
    tuning::GAP_MIN.max(n_views / tuning::GAP_PART)
}
