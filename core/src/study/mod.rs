//! The validation experiments: grid in, table and figure out; and the truth they are measured against.
//!
//! ```text
//! catalogue   the studies by name        point       one point of a grid
//! plan        what is to be done, keys   staged      a drive as a study stages it
//! picks       which pixels, and faults   run         one target tracked and judged     step_record   one step of it
//! row         the table's rows           evenness    rows of targets                   calibration   NEES
//! wire        what page and server say to each other about studies
//! randomised  approaches that the seed draws
//! scenery, picture, exposure             the simulated scenery against its laws
//! realism     how hard a world is for plain correlation
//! real_motion the motion of recorded frames against their poses
//! registration surfaces registered by their shape where the motion is known
//! trackability targets drawn where the map says good, risky or bad, tracked against the truth
//! ```

pub mod scenery;
pub mod picture;
pub mod truth;
pub mod calibration;
pub mod staged;
pub mod point;
pub mod catalogue;
pub mod confidence;
pub mod randomised;
pub mod paper;
pub mod plan;
pub mod picks;
pub mod step_record;
pub mod run;
pub mod evenness;
pub mod hand_over;
mod hand_over_row;
pub mod hand_over_table;
pub mod row;
pub mod wire;
pub mod realism;
pub mod exposure;
pub mod real_motion;
pub mod registration;
pub mod trackability;
