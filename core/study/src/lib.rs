//! The validation experiments: grid in, table and figure out. One-off experiments are in `experiments/`.
//!
//! ```text
//! catalogue   the studies by name        point       one point of a grid
//! plan        what is to be done, keys   staged      a drive as a study stages it
//! picks       which pixels, and faults   run         one target tracked and judged     step_record   one step of it
//! row         the table's rows           evenness    rows of targets                   calibration   NEES
//! by_pose     why targets are lost, odometry   terrain_table   Table II
//! wire        what page and server say to each other about studies
//! randomised  approaches that the seed draws
//! odometry    visual odometry in drives  drive_grid  drives on commands over slope, rocks, odometry, navigator
//! true_ground  whether a way leads over the true ground   checkouts, k9_day   the papers' drives on commands
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
