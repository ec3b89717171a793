//! The cluster: several services, the *nodes*, that share the shards of one store.
//!
//! Who may write a shard the storage decides, by the epoch of its database (the *term*): a node
//! that has lost a shard cannot write it, whatever it believes. All else here only decides who
//! tries: placement says which node a shard belongs to, beats in the storage and tokens on Zenoh
//! say which nodes are there.
//!
//! ```text
//! Zenoh tokens, beats ─► view ─► placement ─► node: opens and closes shards of the engine
//!                                               └─► standing ─► HTTP
//! ```

#[cfg(feature = "object-storage")]
mod node;
#[cfg(feature = "object-storage")]
mod placement;
#[cfg(feature = "object-storage")]
mod presence;
#[cfg(feature = "object-storage")]
mod replicas;
mod standing;
#[cfg(feature = "object-storage")]
mod view;

#[cfg(feature = "object-storage")]
pub use node::{Node, NodeSettings, Signals};
#[cfg(feature = "object-storage")]
pub use presence::{Presence, PresenceSign};
#[cfg(feature = "object-storage")]
pub use replicas::Replicas;
pub use standing::{
    Cluster, NodeState, NodeStatus, OwnerState, OwnerStatus, Standing, Whereabouts,
};
