//! The channels of views.

use place_recognition::LearnedChannel;

use super::map::KeyframeMap;

/// A channel on which agents of the map have seen something.
#[derive(Clone, Copy, Debug)]
pub struct ViewChannel<'a> {
    /// Its name.
    pub name: &'a str,
    /// How many numbers a view has.
    pub dimension: u16,
    /// How many of its views are logged.
    pub views: usize,
    /// What was learned of it when views were last matched, if they say anything of where they
    /// were seen.
    pub learned: Option<LearnedChannel>,
}

impl KeyframeMap {
    /// The channels on which agents of the map have seen something, in the order in which they
    /// first did.
    pub fn view_channels(&self) -> impl Iterator<Item = ViewChannel<'_>> {
        let channels = self.recognition.channels();
        channels.map(|(number, name, dimension, views)| ViewChannel {
            name,
            dimension,
            views,
            learned: { self.graph.learned.iter() }
                .find(|learned| learned.channel == number)
                .copied(),
        })
    }
}
