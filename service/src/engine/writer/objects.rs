//! Lessons about objects, and wishes to forget them.

use cognitive_map::Record;

use super::Writer;
use crate::engine::counters::Drop;
use crate::engine::message::{Change, ObjectRequest};
use crate::journal::Entry;

impl Writer {
    /// Journals a change of what is known of objects. Whoever waits is answered when it is durable.
    pub(super) fn receive_object(&mut self, request: ObjectRequest) {
        let ObjectRequest {
            name,
            lesson,
            reply,
        } = request;
        if let Some(refusal) = self.shared.health.refusal() {
            self.counters.dropped(Drop::StoreFailed);
            // Whoever asked may have gone.
            let _ = reply.send(Err(refusal));
            return;
        }
        let number = self.next_lesson;
        self.next_lesson += 1;
        let title = name.as_str().to_owned().into();
        let record = if let Some((as_it_came, lesson)) = lesson {
            self.block.push(&Entry::Teach {
                number,
                name: title,
                lesson: as_it_came,
            });
            Record::TeachObject {
                number,
                name,
                lesson,
            }
        } else {
            self.block.push(&Entry::Forget {
                number,
                name: title,
            });
            Record::ForgetObject { number, name }
        };
        self.records.push(record);
        self.changes.push(Change::Made(reply));
    }
}
