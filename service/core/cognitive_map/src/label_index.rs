//! The order of numbered items by label.

use std::sync::Arc;

/// Most numbers in a run; a longer run is halved.
const RUN_MAX: usize = 256;

/// Numbers of items in the order of their labels, in runs, none of them empty.
///
/// The items keep their labels; `label_of` gives that of a number. A clone shares all runs, and a
/// change after that copies one run and the list of runs.
#[derive(Clone, Debug, Default)]
pub(crate) struct LabelIndex(Arc<Vec<Arc<Vec<u32>>>>);

impl LabelIndex {
    /// The number of the item with a label.
    pub(crate) fn find<'a>(&self, label: &str, label_of: impl Fn(u32) -> &'a str) -> Option<u32> {
        let run = self.0.get(self.run_of(label, &label_of))?;
        let slot = run.partition_point(|&number| label_of(number) < label);
        let number = *run.get(slot)?;
        (label_of(number) == label).then_some(number)
    }

    /// The numbers in the order of the labels, from the first one whose label is larger.
    pub(crate) fn after<'a>(
        &self,
        label: Option<&str>,
        label_of: impl Fn(u32) -> &'a str,
    ) -> impl Iterator<Item = u32> {
        let run = label.map_or(0, |label| self.run_of(label, &label_of));
        let numbers = self.0[run..].iter().flat_map(|run| run.iter().copied());
        numbers.skip_while(move |&number| label.is_some_and(|label| label_of(number) <= label))
    }

    /// Adds a number where its label belongs.
    pub(crate) fn insert<'a>(&mut self, number: u32, label_of: impl Fn(u32) -> &'a str) {
        let label = label_of(number);
        let run = self.run_of(label, &label_of);
        let runs = Arc::make_mut(&mut self.0);
        if runs.is_empty() {
            runs.push(Arc::default());
        }
        let members = Arc::make_mut(&mut runs[run]);
        let slot = members.partition_point(|&other| label_of(other) < label);
        members.insert(slot, number);
        if members.len() > RUN_MAX {
            let upper = members.split_off(members.len() / 2);
            runs.insert(run + 1, Arc::new(upper));
        }
    }

    /// Removes a number, whose item still has its label.
    pub(crate) fn remove<'a>(&mut self, number: u32, label_of: impl Fn(u32) -> &'a str) {
        let run = self.run_of(label_of(number), &label_of);
        let runs = Arc::make_mut(&mut self.0);
        let Some(members) = runs.get_mut(run) else {
            return;
        };
        let members = Arc::make_mut(members);
        members.retain(|&member| member != number);
        if members.is_empty() {
            runs.remove(run);
        }
    }

    /// The run in which a label belongs: the last one that does not start after it; 0 without any.
    fn run_of<'a>(&self, label: &str, label_of: impl Fn(u32) -> &'a str) -> usize {
        let starts_up_to =
            |run: &Arc<Vec<u32>>| run.first().is_some_and(|&first| label_of(first) <= label);
        self.0.partition_point(starts_up_to).saturating_sub(1)
    }
}
