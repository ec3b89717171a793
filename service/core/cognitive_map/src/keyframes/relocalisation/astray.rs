//! An agent of the map that sees what contradicts where it is believed to be: it was carried off, or went astray.
//!
//! Each look says how much better it is expected where the agent is believed to be, by the covariance of that, than anywhere
//! ([`field`](crate::keyframes::field)). Summed up since nothing spoke against it (Page 1954), that decides. Then the looks must
//! contradict every place where the agent may be, all of them together, before it counts as astray.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3};

use super::doubt::Doubt;
use super::positions::Positions;
use super::problem::Problem;
use super::relocalise::MOVED;
use super::scene::scene;
use super::search::{Look, Search};
use crate::keyframes::field::{Glimpse, Neighbourhood, Prior, Seen, told};
use crate::keyframes::graph::{KeyframeGraph, Moment};
use crate::keyframes::life::is_within;
use crate::keyframes::revisit::{Kernel, twist};
use crate::keyframes::revisited::Viewed;

/// Odds at which an agent counts as astray: one false alarm in a thousand, where one look in a thousand is the first one after
/// it was carried off \[nats\].
const SURE: f64 = 6.9 + 6.9;
/// Distance between looks that are weighed, in lengths of the channel's kernel: nearer ones err alike.
const SPACING: f64 = 0.25;
/// How much larger the errors of a pose may be than its covariance says.
const WIDER: f64 = 2.0;
/// A view nearer than this to the one before must be like it, in reaches: else one of them shows something that is not there.
const BESIDE: f64 = 0.6;
/// Remembered views near the agent that are looked up.
const NEAR_MAX: usize = 24;
/// A look counts whose heading is that of one of the views about it, or not farther from one than these are from one another: a
/// channel may see something else in another direction \[rad\].
const TURNED_RAD: f64 = 0.5;

impl KeyframeGraph {
    /// An agent in the map saw something. Answers whether what it saw lately contradicts where it is believed to be.
    /// `accepted` is the number of its sightings so far that agree with that.
    pub fn is_contradicted(&mut self, moment: &Moment, viewed: &Viewed<'_>, accepted: u64) -> bool {
        self.note(moment);
        let known = self.revisits.known_channel(viewed.descriptor);
        let Some((channel, kernel)) =
            known.and_then(|known| Some((known, self.revisits.kernel(known)?)))
        else {
            return false;
        };
        let number = self.doubt_of(moment);
        let Some(doubt) = self.doubts.get(number) else {
            return false;
        };
        let has_moved = doubt.latest.as_ref().is_none_or(|latest| {
            let way = latest.in_odom.inv_mul(&viewed.in_odom);
            !is_within(&way, MOVED.0, MOVED.1)
        });
        if !has_moved {
            return false;
        }
        let look = Look {
            in_odom: viewed.in_odom,
            travelled_m: 0.0,
            channel,
            vector: viewed.descriptor.vector().into(),
            alike: Vec::new(),
        };
        let is_borne_out = self.is_borne_out(doubt, &look);
        let spacing_m = doubt.weighed_at.map_or(f64::INFINITY, |at| {
            (at.translation.vector - look.in_odom.translation.vector).norm()
        });
        let says = (is_borne_out && spacing_m >= SPACING * kernel.length_m)
            .then(|| self.says(doubt, moment, viewed, &look, kernel, spacing_m))
            .flatten();
        let revision = self.revision;
        let Some(doubt) = self.doubts.get_mut(number, revision) else {
            return false;
        };
        doubt.latest = Some(look.clone());
        // One that was lost and is not any more was brought back by what it sighted.
        doubt.is_astray = false;
        if doubt.accepted != accepted {
            // What the agent sighted is where it should be.
            doubt.accepted = accepted;
            doubt.dispel(moment.seq);
            return false;
        }
        if let Some(says) = says {
            doubt.weighed_at = Some(look.in_odom);
            doubt.against = (doubt.against - says).max(0.0);
        }
        if doubt.against == 0.0 {
            doubt.dispel(moment.seq);
            return false;
        }
        if is_borne_out {
            doubt
                .run
                .look(look.in_odom, channel, &look.vector, Vec::new());
        }
        let is_much = says.is_some() && doubt.against >= SURE;
        let Some(doubt) = self.doubts.get(number).filter(|_| is_much) else {
            return false;
        };
        self.is_nowhere_about(doubt, moment, viewed, kernel)
    }

    /// Whether the view before is like a look, unless it was too far away to be.
    fn is_borne_out(&self, doubt: &Doubt, look: &Look) -> bool {
        let before = doubt.latest.as_ref();
        let Some(before) = before.filter(|before| before.channel == look.channel) else {
            return false;
        };
        let apart = before.in_odom.translation.vector - look.in_odom.translation.vector;
        let reach_m = self.revisits.reach_m(look.channel).unwrap_or(0.0);
        apart.norm() >= BESIDE * reach_m
            || self
                .revisits
                .is_alike(look.channel, &before.vector, &look.vector)
    }

    /// What a look says for where its agent is believed to be, against anywhere else \[nats\]; nothing where little is known.
    fn says(
        &self,
        doubt: &Doubt,
        moment: &Moment,
        viewed: &Viewed<'_>,
        look: &Look,
        kernel: Kernel,
        spacing_m: f64,
    ) -> Option<f64> {
        let at = Point3::from(moment.pose.translation.vector);
        let mut near: Vec<(Seen<'_>, Isometry3<f64>)> = Vec::new();
        let mut remembered: Vec<_> = self
            .revisits
            .views
            .iter()
            .filter(|view| view.channel == look.channel && !doubt.run.is_own(view))
            .map(|view| ((view.in_map - at).norm_squared(), view))
            .filter(|(squared, _)| *squared <= kernel.length_m.powi(2))
            .collect();
        remembered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut unsure_m2 = 0.0;
        for (_, view) in remembered.into_iter().take(NEAR_MAX) {
            if let Some(pose) = self.pose_at(view.agent, view.session, view.seq) {
                let from = Point3::from(pose.translation.vector);
                let vector = &*view.vector;
                near.push((Seen { at: from, vector }, pose));
                unsure_m2 += view.spread[0].powi(2);
            }
        }
        let turned_rad = |pose: &Isometry3<f64>| pose.rotation.angle_to(&moment.pose.rotation);
        let turns_rad = near.iter().map(|(_, pose)| turned_rad(pose));
        let least_rad = turns_rad.fold(f64::INFINITY, f64::min);
        let spread_rad = near
            .iter()
            .map(|(_, pose)| pose.rotation.angle_to(&near[0].1.rotation))
            .fold(TURNED_RAD, f64::max);
        if least_rad > spread_rad {
            return None;
        }
        let seen: Vec<Seen<'_>> = near.iter().map(|(seen, _)| *seen).collect();
        let covariance = viewed.covariance.in_map_axes(&moment.pose.rotation);
        // Where these views were taken is known no better than their agents knew it then.
        let unsure_m2 = unsure_m2 / (3.0 * near.len() as f64);
        let own: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let covariance = (own + Matrix3::identity() * unsure_m2) * WIDER.powi(2);
        let about = Neighbourhood::of(&look.vector, &at, &seen, kernel)?;
        let foreseen = about.foresee(&at, &covariance)?;
        let glimpse = Glimpse {
            at,
            drift_m: 0.0,
            channel: look.channel,
            kernel: Some(kernel),
            vector: &look.vector,
        };
        let says = told(glimpse.numbers(spacing_m), foreseen.open, foreseen.off);
        Some(says)
    }

    /// Whether the looks of a run, all together, contradict every pose where the agent may be.
    fn is_nowhere_about(
        &self,
        doubt: &Doubt,
        moment: &Moment,
        viewed: &Viewed<'_>,
        kernel: Kernel,
    ) -> bool {
        let mut spaced = Search {
            looks: Vec::new(),
            ..doubt.run.clone()
        };
        // Back from the newest, where the agent is.
        for look in doubt.run.looks.iter().rev() {
            let is_apart = spaced.looks.last().is_none_or(|later| {
                let apart = later.in_odom.translation.vector - look.in_odom.translation.vector;
                apart.norm() >= SPACING * kernel.length_m
            });
            if is_apart {
                spaced.looks.push(look.clone());
            }
        }
        spaced.looks.reverse();
        let positions = Positions::of(self);
        let Some(problem) = Problem::of(&spaced, self, &positions) else {
            return false;
        };
        let open = problem.prior().open;
        let stated = viewed.covariance.matrix() * WIDER.powi(2);
        // What is known without error, as the height of a robot on a floor, stays as it is.
        let floor = Matrix6::identity() * 1e-6;
        let Some(information) = (stated + floor).try_inverse() else {
            return false;
        };
        let prior = Prior {
            pose: Some(moment.pose),
            information,
            open,
        };
        let scene = scene(&problem, &spaced, self, &positions);
        let best = scene.settle(&moment.pose, &prior).map(|settled| {
            let off = twist(&moment.pose.inv_mul(&settled.pose));
            settled.evidence.total() - 0.5 * off.dot(&(information * off))
        });
        best.is_some_and(|best| best <= -SURE)
    }

    /// An agent may be anywhere. What it saw since that is contradicted is not remembered where it was believed to be; by that it
    /// is sought.
    pub fn go_astray(&mut self, moment: &Moment) {
        let (agent, revision) = (moment.agent, self.revision);
        let number = self.doubt_of(moment);
        let Some(doubt) = self.doubts.get_mut(number, revision) else {
            return;
        };
        let mut search = doubt.run.clone();
        doubt.dispel(moment.seq);
        doubt.is_astray = true;
        self.revisits
            .forget_since(agent, search.session, search.since_seq, revision);
        self.revisits.cut(agent, revision);
        search.await_comparison(&self.revisits);
        let number = self.search_of(moment);
        if let Some(known) = self.searches.get_mut(number, revision) {
            *known = search;
        }
        if let Some(life) = self.lives.get_mut(agent as usize, revision) {
            life.is_cut = true;
        }
        self.anchor_anew(agent);
    }

    /// Whether an agent of the map may be anywhere, by what it has seen.
    pub fn is_astray(&self, agent: u32) -> bool {
        let mut doubts = self.doubts.iter();
        doubts.any(|doubt| doubt.agent == agent && doubt.is_astray)
    }

    /// An agent is where it is believed to be, from a sample on: it was told, or found.
    pub fn dispel_doubt(&mut self, agent: u32, seq: u64) {
        let revision = self.revision;
        let number = self.doubts.iter().position(|doubt| doubt.agent == agent);
        if let Some(doubt) = number.and_then(|number| self.doubts.get_mut(number, revision)) {
            doubt.is_astray = false;
            doubt.dispel(seq);
        }
    }

    /// The number of the doubt about an agent in its present session; a new one if there is none.
    fn doubt_of(&mut self, moment: &Moment) -> usize {
        let (agent, revision) = (moment.agent, self.revision);
        let session = self.session(agent);
        let Some(number) = self.doubts.iter().position(|doubt| doubt.agent == agent) else {
            self.doubts
                .push(Doubt::new(agent, session, moment.seq), revision);
            return self.doubts.len() - 1;
        };
        let is_over = |doubt: &Doubt| doubt.session != session;
        if self.doubts.get(number).is_some_and(is_over)
            && let Some(doubt) = self.doubts.get_mut(number, revision)
        {
            let is_astray = doubt.is_astray;
            *doubt = Doubt {
                is_astray,
                ..Doubt::new(agent, session, moment.seq)
            };
        }
        number
    }
}
