//! One exploration as the recogniser sees it, touch by touch.

use object_recognition::{Contact, ObjectId, ObjectLibrary, Orientation, Posterior, Recognition};

/// Objects whose probabilities differ by less are tied.
const TIE: f64 = 1e-9;

/// What the recogniser said in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It is this one.
    Object(ObjectId),
    /// It is none that was learned.
    Unknown,
}

/// An answer and when it was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// Number of touches before it.
    pub touches: usize,
    /// The answer.
    pub answer: Answer,
}

/// What the recogniser said after a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchStep {
    /// What its first choice among the objects is worth: 1 if right, a share of it if tied with
    /// others.
    pub right: f64,
    /// Probability of the first choice.
    pub confidence: f64,
    /// Probability that it is none of the objects.
    pub unknown: f64,
    /// Objects with a probability above one in a hundred.
    pub live_objects: f64,
    /// Hypotheses, each an object and a pose, that hold 99 % of the evidence.
    pub live_hypotheses: f64,
    /// How long it took to take the touch in and to answer \[s\].
    pub took_s: f64,
}

/// When an exploration is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ending {
    /// An answer is given as soon as its probability is this high.
    pub sure: f64,
    /// Whether touching goes on after the answer, for those who want to know what comes after it.
    pub goes_on: GoesOn,
}

/// What happens after an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoesOn {
    /// The exploration is over.
    Never,
    /// It goes on to the last touch; the answer stays.
    ToTheEnd,
}

/// What the recogniser said in one exploration.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// After each touch.
    pub steps: Vec<TouchStep>,
    /// The first answer that was sure enough, if one was.
    pub decision: Option<Decision>,
}

impl Trace {
    /// Lets a recogniser take in contacts. `truth` is the object, unless it was never learned;
    /// `clock` tells seconds from any moment on.
    pub fn follow(
        library: &ObjectLibrary,
        orientation: &Orientation,
        contacts: impl IntoIterator<Item = Contact>,
        truth: Option<ObjectId>,
        ending: Ending,
        clock: &impl Fn() -> f64,
    ) -> Self {
        let mut recognition = Recognition::new(orientation);
        let mut trace = Self {
            steps: Vec::new(),
            decision: None,
        };
        for contact in contacts {
            let begin_s = clock();
            recognition.touch(library, contact);
            let posterior = recognition.posterior(library);
            let took_s = clock() - begin_s;
            trace.steps.push(TouchStep::of(&posterior, truth, took_s));
            if trace.decision.is_none() {
                trace.decision = answer(&posterior, ending.sure).map(|answer| Decision {
                    touches: trace.steps.len(),
                    answer,
                });
            }
            if trace.decision.is_some() && ending.goes_on == GoesOn::Never {
                break;
            }
        }
        trace
    }

    /// The step after so many touches; of an exploration that ended before, its last one.
    pub fn after(&self, touches: usize) -> Option<&TouchStep> {
        let last = self.steps.len().checked_sub(1)?;
        self.steps.get(touches.checked_sub(1)?.min(last))
    }
}

impl TouchStep {
    fn of(posterior: &Posterior, truth: Option<ObjectId>, took_s: f64) -> Self {
        let confidence = posterior.objects.first().map_or(0.0, |best| best.1);
        let tied = || {
            let all = posterior.objects.iter();
            all.take_while(|object| confidence - object.1 <= TIE * confidence)
        };
        let is_first = tied().any(|object| Some(object.0) == truth);
        Self {
            right: if is_first {
                1.0 / tied().count() as f64
            } else {
                0.0
            },
            confidence,
            unknown: posterior.unknown,
            live_objects: posterior.live_objects as f64,
            live_hypotheses: posterior.live_hypotheses as f64,
            took_s,
        }
    }
}

fn answer(posterior: &Posterior, sure: f64) -> Option<Answer> {
    let first = posterior.objects.first();
    match first {
        Some((object, probability)) if *probability >= sure => Some(Answer::Object(*object)),
        _ if posterior.unknown >= sure => Some(Answer::Unknown),
        _ => None,
    }
}
