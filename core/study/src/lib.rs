//! The validation experiments: grid in, table and figure out. One-off experiments are in `experiments/`.
//!
//! ```text
//! catalogue   the studies by name        point       one point of a grid
//! plan        studies to run, keys        staged      a drive with the stops and jumps of a study
//! picks       target pixels, and faults   run         one target tracked and judged     step_record   one step of it
//! row         the table's rows           evenness    rows of targets                   calibration   NEES
//! by_pose     causes of losses, odometry  terrain_table   Table II
//! wire        messages about studies between page and server
//! randomised  approaches drawn from the seed
//! odometry    visual odometry in drives  drive_grid  commanded drives over slope, rocks, odometry, navigator
//! true_ground  reachability of the goal over the true ground   checkouts, k9_day   the papers' commanded drives
//! ```

pub mod calibration;
pub mod staged;
pub mod point;
pub mod catalogue;
mod confidence;
pub mod randomised;
pub mod paper;
pub mod plan;
pub mod picks;
mod step_record;
pub mod by_pose;
pub mod by_pose_row;
pub mod run;
mod evenness;
mod hand_over;
mod hand_over_row;
pub mod hand_over_table;
pub mod terrain_table;
mod spread;
pub mod row;
pub mod odometry;
pub mod drive_grid;
pub mod checkouts;
pub mod k9_day;
pub mod true_ground;
pub mod wire;
