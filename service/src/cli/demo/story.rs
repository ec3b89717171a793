//! What happens in the demo: what the room does, and what the service makes of it.

use cogmap_proto::{Estimate, Event, EventKind, Status};
use cogmap_worlds::Act;
use nalgebra::Vector3;

use super::summary::{Cause, ObjectRecord, SearchRecord};

/// A robot that is localized farther from where it is than this was not found, but put somewhere
/// wrong \[m\].
const FALSE_M: f64 = 0.5;

/// The story so far. Times are on the robots' clock, since the first tick.
pub(super) struct Story {
    epoch_ns: i64,
    side_m: f64,
    searches: Vec<SearchRecord>,
    objects: Vec<ObjectRecord>,
    /// Stamps of the contacts of the object that is touched, since the arm began.
    contacts_ns: Vec<i64>,
}

impl Story {
    /// Begins at a stamp, in a room of an edge \[m\].
    pub(super) fn new(epoch_ns: i64, side_m: f64) -> Self {
        Self {
            epoch_ns,
            side_m,
            searches: Vec::new(),
            objects: Vec::new(),
            contacts_ns: Vec::new(),
        }
    }

    /// Something happens in the room, where a robot is then. Answers with what to say of it.
    pub(super) fn act(
        &mut self,
        act: &Act,
        stamp_ns: i64,
        robot_m: Option<Vector3<f64>>,
    ) -> String {
        let at_s = self.seconds(stamp_ns);
        let here = robot_m.map_or_else(String::new, |robot_m| self.whereabouts(&robot_m));
        let text = match act {
            Act::SwitchedOff { robot } => {
                format!("{robot} is switched off and removed; what it taught the others stays")
            }
            Act::WokenUp { robot } => {
                self.searches
                    .push(SearchRecord::new(robot, Cause::Woken, at_s));
                format!("{robot} wakes up {here} and is not told where it is")
            }
            Act::CarriedOff { robot, from_m } => {
                let mut search = SearchRecord::new(robot, Cause::Carried, at_s);
                let carried_m = robot_m.map(|robot_m| (robot_m - from_m).norm());
                search.carried_m = carried_m;
                self.searches.push(search);
                let way_m = carried_m.unwrap_or_default();
                format!(
                    "{robot} is carried off while it flies, {way_m:.1} m, and goes on {here}; \
                     its odometry does not notice"
                )
            }
            Act::Learning(thing) => {
                format!(
                    "the arm feels its way over a {} and learns it",
                    thing.name()
                )
            }
            Act::Touching(thing) => {
                self.contacts_ns.clear();
                self.objects.push(ObjectRecord::new(thing.name(), at_s));
                format!(
                    "the arm touches something that stands elsewhere, turned: it is not told what \
                     (it is the {})",
                    thing.name()
                )
            }
            Act::LetGo => "the arm lets go".to_owned(),
        };
        self.line(stamp_ns, &text)
    }

    /// The arm has made a contact.
    pub(super) fn contact(&mut self, stamp_ns: i64) {
        self.contacts_ns.push(stamp_ns);
    }

    /// The service tells where a robot is, so far from the truth \[m\]. Answers with what to say of
    /// it, if anything.
    pub(super) fn estimate(&mut self, estimate: &Estimate, error_m: f64) -> Option<String> {
        let at_s = self.seconds(estimate.stamp_ns);
        let robot = &estimate.agent;
        // The latest search of the robot, while it lasts.
        let search = self
            .searches
            .iter_mut()
            .rfind(|search| search.robot == *robot)
            .filter(|search| search.found_s.is_none() && at_s >= search.at_s)?;
        let text = match estimate.status {
            Status::Uncertain if search.noticed_s.is_none() => {
                search.noticed_s = Some(at_s);
                format!(
                    "{robot} is uncertain: what it sees contradicts where it was; {error_m:.1} m from \
                     the truth"
                )
            }
            Status::Lost if search.lost_s.is_none() => {
                search.noticed_s.get_or_insert(at_s);
                search.lost_s = Some(at_s);
                if search.cause == Cause::Woken {
                    format!("{robot} is lost: the service looks for it in what the others remember")
                } else {
                    format!("{robot} is lost: it may be anywhere, and the service looks for it")
                }
            }
            // Who is carried off may be found by the very sightings that tell so.
            Status::Localized
                if error_m <= FALSE_M
                    && (search.noticed_s.is_some() || search.cause == Cause::Carried) =>
            {
                search.noticed_s.get_or_insert(at_s);
                search.found_s = Some(at_s);
                search.error_m = Some(error_m);
                let again = match search.cause {
                    Cause::Woken => "",
                    Cause::Carried => " again",
                };
                format!(
                    "{robot} is found{again}, {error_m:.2} m from the truth, after {:.1} s",
                    at_s - search.at_s
                )
            }
            Status::Localized if search.noticed_s.is_some() && !search.was_false => {
                search.was_false = true;
                format!("{robot} is taken to be somewhere else, {error_m:.1} m from the truth")
            }
            _ => return None,
        };
        Some(self.line(estimate.stamp_ns, &text))
    }

    /// The service tells what happened. Answers with what to say of it, if anything.
    pub(super) fn event(&mut self, event: &Event) -> Option<String> {
        let at_s = self.seconds(event.stamp_ns);
        let text = match &event.kind {
            EventKind::ObjectLearned { object, contacts } => {
                format!("the {object} is learned, from {contacts} contacts")
            }
            EventKind::ObjectRecognised {
                object,
                probability,
            } => {
                let stamps = self.contacts_ns.iter();
                let contacts = stamps.filter(|stamp| **stamp <= event.stamp_ns).count() as u64;
                let touched = self.objects.last_mut()?;
                if touched.recognised_s.is_some() {
                    return None;
                }
                touched.recognised = Some(object.clone());
                touched.recognised_s = Some(at_s);
                touched.contacts = Some(contacts);
                touched.probability = Some(*probability);
                let but = if *object == touched.object {
                    String::new()
                } else {
                    format!(", which is wrong: it is the {}", touched.object)
                };
                let percent = probability * 100.0;
                format!(
                    "the arm's object is recognised after {contacts} contacts: the {object} \
                     ({percent:.1} %){but}"
                )
            }
            EventKind::ObjectUnknown {} => {
                "what the arm touches is taken for something new".to_owned()
            }
            _ => return None,
        };
        Some(self.line(event.stamp_ns, &text))
    }

    /// A line of the story.
    pub(super) fn line(&self, stamp_ns: i64, text: &str) -> String {
        format!("{:>5.1} s  {text}", self.seconds(stamp_ns))
    }

    /// All searches and all touched objects.
    pub(super) fn end(self) -> (Vec<SearchRecord>, Vec<ObjectRecord>) {
        (self.searches, self.objects)
    }

    fn seconds(&self, stamp_ns: i64) -> f64 {
        stamp_ns.saturating_sub(self.epoch_ns) as f64 * 1e-9
    }

    /// A position in words: x is to the east, y to the north, z up.
    fn whereabouts(&self, position_m: &Vector3<f64>) -> String {
        let third = |axis: usize, names: [&'static str; 3]| {
            let share = position_m[axis] / self.side_m * 3.0;
            let index = if share < 1.0 {
                0
            } else {
                1 + usize::from(share >= 2.0)
            };
            names[index]
        };
        let north = third(1, ["south", "", "north"]);
        let east = third(0, ["west", "", "east"]);
        let side = match (north, east) {
            ("", "") => "middle".to_owned(),
            ("", side) | (side, "") => side.to_owned(),
            (north, east) => format!("{north}-{east} corner"),
        };
        format!("{}in the {side}", third(2, ["low ", "", "high up "]))
    }
}

#[cfg(test)]
mod tests {
    use cogmap_worlds::Thing;

    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    fn story() -> Story {
        Story::new(5 * SECOND_NS, 15.0)
    }

    fn told(status: Status, at_s: i64) -> Estimate {
        Estimate {
            space: "demo".to_owned(),
            agent: "robot5".to_owned(),
            session: 1,
            seq: 0,
            stamp_ns: (5 + at_s) * SECOND_NS,
            frame: "map".to_owned(),
            map_revision: 0,
            status,
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            covariance: [0.0; 21],
            place: None,
            confidence: 0.0,
            term: 0,
        }
    }

    #[test]
    fn a_robot_is_found_when_the_service_says_where_it_is_and_that_is_so() {
        let mut story = story();
        let carried = Act::CarriedOff {
            robot: "robot5".to_owned(),
            from_m: Vector3::new(1.0, 1.0, 1.0),
        };
        let there_m = Vector3::new(14.0, 14.0, 14.0);
        let line = story.act(&carried, 45 * SECOND_NS, Some(there_m));
        assert!(line.starts_with(" 40.0 s  robot5"), "{line}");
        assert!(
            line.contains("22.5 m, and goes on high up in the north-east corner"),
            "{line}"
        );
        // It believes itself where it was: nobody has noticed anything.
        assert_eq!(story.estimate(&told(Status::Localized, 41), 22.5), None);
        // An estimate from before says nothing.
        assert_eq!(story.estimate(&told(Status::Lost, 39), 22.5), None);
        assert!(story.estimate(&told(Status::Uncertain, 42), 22.0).is_some());
        assert!(story.estimate(&told(Status::Lost, 43), 22.0).is_some());
        assert_eq!(story.estimate(&told(Status::Lost, 44), 22.0), None);
        let wrong = story.estimate(&told(Status::Localized, 45), 9.0);
        assert!(wrong.is_some_and(|line| line.contains("somewhere else")));
        let found = story.estimate(&told(Status::Localized, 47), 0.1);
        assert!(found.is_some_and(|line| line.contains("found again, 0.10 m")));
        assert_eq!(story.estimate(&told(Status::Lost, 48), 0.1), None);
        let (searches, _) = story.end();
        let search = &searches[0];
        assert_eq!(
            [search.noticed_s, search.lost_s, search.found_s],
            [Some(42.0), Some(43.0), Some(47.0)]
        );
    }

    #[test]
    fn who_is_found_at_once_was_noticed_then() {
        let mut story = story();
        let carried = Act::CarriedOff {
            robot: "robot5".to_owned(),
            from_m: Vector3::new(1.0, 1.0, 1.0),
        };
        story.act(
            &carried,
            45 * SECOND_NS,
            Some(Vector3::new(14.0, 14.0, 14.0)),
        );
        assert_eq!(story.estimate(&told(Status::Localized, 40), 22.5), None);
        let found = story.estimate(&told(Status::Localized, 41), 0.1);
        assert!(found.is_some_and(|line| line.contains("found again, 0.10 m")));
        let (searches, _) = story.end();
        let search = &searches[0];
        assert_eq!(
            [search.noticed_s, search.lost_s, search.found_s],
            [Some(41.0), None, Some(41.0)]
        );
    }

    #[test]
    fn an_object_counts_the_contacts_until_it_was_recognised() {
        let mut story = story();
        story.act(&Act::Touching(Thing::Cup), 35 * SECOND_NS, None);
        for at_s in 36..46 {
            story.contact(at_s * SECOND_NS);
        }
        let event = Event {
            space: "demo".to_owned(),
            agent: "arm".to_owned(),
            map_revision: 1,
            stamp_ns: 39 * SECOND_NS,
            kind: EventKind::ObjectRecognised {
                object: "bottle".to_owned(),
                probability: 0.997,
            },
        };
        let line = story.event(&event).expect("it is worth a line");
        assert!(line.contains("after 4 contacts: the bottle"), "{line}");
        assert!(line.contains("wrong: it is the cup"), "{line}");
        let (_, objects) = story.end();
        assert_eq!(objects[0].contacts, Some(4));
        assert_eq!(objects[0].recognised.as_deref(), Some("bottle"));
    }
}
