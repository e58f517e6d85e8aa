//! All tests that cross crates.

mod approach;
mod imports;
mod recorded_cameras;
<<<<<<< HEAD
=======
mod recorded_tracking;
>>>>>>> main
mod rerun_export;
mod zncc_reference;
