//! Tests of the trackers on complete drives, which need the loop, the simulator and the recordings together.

#![allow(clippy::unwrap_used)]

mod designate;
mod template;
mod template_configurations;
mod features;
mod shape_tracker;
mod shape_tracker_recorded;
mod trackability;
mod trackability_convergent;
mod records;
mod rendering;
mod driving;
mod driving_hazards;
mod driving_wedges;
mod driving_odometry;
mod terrain_odometry;
mod stage_pause;
mod stop_causes;
mod visits;
mod directed;
mod faults;
mod registration;
mod stereo_rendered;
mod stereo_recorded;
mod hand_off;
mod cameras;
mod odometry_scenarios;
mod visual_odometry;
