//! What robots and routes are to heed: blockages, routes that agents follow, pinned trips.

use cogmap_proto::{
    Blockage, BlockageList, BlockageRequest, FollowRequest, FollowedRoute, FollowedRoutePage,
    FollowedRouteSummary,
};
use ureq::http::Method;

use super::Api;
use super::error::ApiError;
use super::exchange::{agent_path, done, json, path};

impl Api {
    /// Lets an agent follow a route from where it is, in place of any that it follows. Events tell
    /// its progress.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn follow_route(
        &self,
        space: &str,
        agent: &str,
        request: &FollowRequest,
    ) -> Result<FollowedRoute, ApiError> {
        let path = agent_path(space, agent, "/route")?;
        self.send(&Method::PUT, &path, &json(request))
    }

    /// What is left of the route that an agent follows.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn followed_route(&self, space: &str, agent: &str) -> Result<FollowedRoute, ApiError> {
        self.get(&agent_path(space, agent, "/route")?)
    }

    /// What is left of the routes that agents follow, without the steps, by agent.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn followed_routes(&self, space: &str) -> Result<Vec<FollowedRouteSummary>, ApiError> {
        self.pages(&path(space, "/routes")?, |page: FollowedRoutePage| {
            (page.routes, page.next)
        })
    }

    /// Lets an agent follow its route no more.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn stop_following(&self, space: &str, agent: &str) -> Result<(), ApiError> {
        let path = agent_path(space, agent, "/route")?;
        done(self.run(&Method::DELETE, &path, None)?)
    }

    /// The blockages of a space, by number.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn blockages(&self, space: &str) -> Result<Vec<Blockage>, ApiError> {
        let list: BlockageList = self.get(&path(space, "/blockages")?)?;
        Ok(list.blockages)
    }

    /// Says where nobody gets through; returns when that is durable.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn block(&self, space: &str, request: &BlockageRequest) -> Result<Blockage, ApiError> {
        let path = path(space, "/blockages")?;
        self.send(&Method::POST, &path, &json(request))
    }

    /// Ends a blockage.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn unblock(&self, space: &str, blockage: u64) -> Result<(), ApiError> {
        let path = path(space, &format!("/blockages/{blockage}"))?;
        done(self.run(&Method::DELETE, &path, None)?)
    }

    /// Pins a trip, which then is never forgotten.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn pin_trip(&self, space: &str, trip: u64) -> Result<(), ApiError> {
        let path = path(space, &format!("/trips/{trip}/pin"))?;
        done(self.run(&Method::PUT, &path, None)?)
    }

    /// Lets a trip be forgotten like others.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn unpin_trip(&self, space: &str, trip: u64) -> Result<(), ApiError> {
        let path = path(space, &format!("/trips/{trip}/pin"))?;
        done(self.run(&Method::DELETE, &path, None)?)
    }
}
