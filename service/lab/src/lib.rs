//! Laboratory of cogmap: data sets, experiments, and figures of both. The program `cogmap-lab` runs
//! them.
//!
//! A recording becomes a stream of [`Reading`](cogmap_worlds::Reading)s: plain numbers, as a sensor
//! gives them. A reading becomes a sample of the core by `cognitive_map::Sample::try_from`, or a
//! message on a wire; the same stream can go either way, so an experiment run straight into the
//! core and one sent through a network are the same experiment.
//!
//! | module | what |
//! |---|---|
//! | [`mrclam`] | the UTIAS multi-robot data sets |
//! | [`nees`] | errors against their covariances |
//! | [`coverage`] | how many positions lie within the ellipses of their covariances |
//! | [`g2o`] | pose graphs |
//! | [`tuc`] | the TUC data sets: odometry and place matches, many of them false |
//! | [`victoria`] | Victoria Park, as text with odometry and sightings |
//! | [`objects`] | objects of coloured voxels, and an end effector that explores them |
//! | [`outlines`] | random outlines and solids, taught and touched again through the fold |
//! | [`touch`] | objects as sets of touches |
//! | [`points`] | objects as points with normals, recognised in any pose |
//! | [`csv`] | recordings as tables: motion, levels, views and ranges of robots |
//! | [`stream`] | what one robot sends, and its dead reckoning |
//! | [`mod@reference`] | known positions of poses that have no time |
//! | [`paths`] | a figure of paths |
//! | [`eval`] | the seed paper's experiments: protocols, measures, tables and figures |
//!
//! # From a data set to a score
//!
//! ```no_run
//! use cogmap_worlds::dead_reckoned;
//! use trajectory::{Alignment, Trajectory, ate_rmse_m};
//! use cogmap_lab::mrclam::Mrclam;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let set = Mrclam::load("data/MRCLAM_Dataset6".as_ref())?;
//! for (&robot, log) in set.robots() {
//!     let estimate = Trajectory::from_poses(&dead_reckoned(&set.robot_readings(robot))?)?;
//!     let ate_m = ate_rmse_m(&estimate, &log.truth_trajectory(), set.span(), Alignment::None)?;
//!     assert!(ate_m < 10.0);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # A simulated team
//!
//! ```
//! use cogmap_worlds::{ObstacleWorld, Team, TeamSettings};
//! use cognitive_map::Sample;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let settings = TeamSettings { seed: 1, n_robots: 3, ..TeamSettings::default() };
//! let mut team = Team::new(ObstacleWorld::new(1), settings)?;
//! for tick in team.tick() {
//!     for reading in &tick.readings {
//!         let sample = Sample::try_from(reading)?;
//!         assert_eq!(sample.stamp_ns, tick.truth.stamp_ns);
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Nothing here reads a clock or draws randomness that was not seeded. Only
//! the functions called `load` touch files.

pub mod coverage;
pub mod csv;
pub mod eval;
pub mod g2o;
pub mod mrclam;
pub mod nees;
pub mod objects;
pub mod outlines;
pub mod paths;
pub mod points;
pub mod reference;
pub mod routes;
pub mod stream;
pub mod touch;
pub mod tuc;
pub mod victoria;
pub mod waking;
