//! What came out.

use std::fmt::{self, Display, Formatter};

use serde::Serialize;

use super::family::{Family, Levels};
use super::protocol::{Teaching, Turn};

/// Answers after some touches, as numbers of explorations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Answers {
    /// Answered with the right object.
    pub right: usize,
    /// The right object is the most probable one.
    pub first: usize,
    /// Answered with another object.
    pub wrong: usize,
    /// Answered with `unknown`.
    pub unknown: usize,
    /// `unknown` is the most probable.
    pub unknown_first: usize,
}

/// One family, taught by so many contacts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Family.
    pub family: Family,
    /// Ranges of levels.
    pub levels: Levels,
    /// Where each object was touched to teach it.
    pub teaching: Teaching,
    /// Turns.
    pub turn: Turn,
    /// Contacts by which each object was taught.
    pub taught: usize,
    /// Explorations of taught objects, and as many of strangers.
    pub explorations: usize,
    /// Mean number of touches that cover half of the object.
    pub half_touches: f64,
    /// After these touches.
    pub half: Answers,
    /// After each number of touches.
    pub looks: Vec<(usize, Answers)>,
    /// Explorations of taught objects that were called unknown at any time.
    pub ever_unknown: usize,
    /// Objects that were made up of taught ones.
    pub made_up: usize,
    /// Strangers after touches that cover half of them; `right` is none of them.
    pub strangers: Answers,
    /// The same at the end.
    pub strangers_end: Answers,
    /// Objects learned of strangers.
    pub strangers_learned: usize,
}

/// All rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Rows.
    pub rows: Vec<Row>,
}

impl Display for Report {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            out,
            "{:<9} {:<7} {:<5} {:>6} {:>5} {:>17} {:>10} {:>8} {:>20}   by touches [%]",
            "family",
            "levels",
            "turn",
            "taught",
            "half",
            "right/wrong/unk.",
            "ever unk.",
            "made up",
            "strangers named/caught",
        )?;
        self.rows.iter().try_for_each(|row| writeln!(out, "{row}"))
    }
}

impl Display for Row {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let all = self.explorations.max(1) as f64;
        let percent = |count: usize| 100.0 * count as f64 / all;
        let name = |value: &dyn fmt::Debug| format!("{value:?}").to_lowercase();
        write!(
            out,
            "{:<9} {:<7} {:<5} {:>6} {:>5.0} {:>5.0} {:>5.0} {:>5.0} {:>10.0} {:>8} \
             {:>5.0} {:>4.0} {:>4.0} {:>4.0}  ",
            name(&self.family),
            name(&self.levels),
            name(&self.turn),
            self.taught,
            self.half_touches,
            percent(self.half.right),
            percent(self.half.wrong),
            percent(self.half.unknown),
            percent(self.ever_unknown),
            self.made_up,
            percent(self.strangers.wrong),
            percent(self.strangers.unknown_first),
            percent(self.strangers_end.wrong),
            percent(self.strangers_end.unknown_first),
        )?;
        for (touches, answers) in &self.looks {
            write!(
                out,
                " {touches}: {:.0} right {:.0} unk. {:.0} wrong;",
                percent(answers.right),
                percent(answers.unknown),
                percent(answers.wrong),
            )?;
        }
        Ok(())
    }
}
