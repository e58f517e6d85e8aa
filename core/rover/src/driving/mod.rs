//! Targeted driving: the stages after tracking, and the loop that repeats them at every stop (R1–R8, R94–R97, R104–R107).
//!
//! ```text
//! last step ─► set_goal ─► map_hazards ─► select_path ─► drive ─► point_mast ─► odometry ─► run_step ─► next step
//! ```
//! [`executive`] is the loop; it requests motions from an [`ActiveWorld`] and receives estimates only.

pub mod active_world;
pub mod command;
pub mod dead_reckoning;
pub mod ending;
pub mod executive;
pub mod flight_time;
mod limit_cycle;
pub mod map_hazards;
pub mod motion;
mod next_motion;
pub mod odometry;
pub mod path_choice;
pub mod select_path;
pub mod set_goal;
pub mod waiting;

pub use active_world::{ActiveWorld, DriveReport, FollowedCycle, Stall};
pub use command::{
    ArrivalAction, DriveCommand, GoalRule, HAZARD_CAMERAS_MAX, NavigatorKind, SlipCheck, TrackedStops,
    WAITING_MAX,
};
pub use dead_reckoning::Reckoned;
pub use ending::{Ending, StopReason};
pub use executive::Cycle;
pub use flight_time::FlightTime;
pub use map_hazards::{HazardMaps, RangeData, StopHazards};
pub use motion::Motion;
pub use odometry::OdometryPair;
pub use path_choice::{Candidate, PathChoice, PathTerms, Veto};
pub use select_path::{ArcNavigator, Navigator, PathInput};
pub use set_goal::Goal;
pub use waiting::WaitingTarget;
