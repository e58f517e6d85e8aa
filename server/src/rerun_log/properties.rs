//! The properties of a recording in the viewer: its program, settings and source.

use rerun::components::Text;
use rerun::{AnyValues, RecordingStream};
use sightline_rover::version::tracker_version;

use super::Logged;
use crate::version::VERSION;

/// The version of Rerun to which recordings conform.
const RERUN_VERSION: &str = "0.36";

/// Sends the properties.
pub(super) fn send(stream: &RecordingStream, traverse: &str) -> Logged {
    let values = [
        ("program", format!("sightline {VERSION}")),
        ("tracker", tracker_version()),
        ("traverse", traverse.to_owned()),
        ("rerun", format!("written for Rerun {RERUN_VERSION}")),
        (
            "pixels",
            "Rerun counts from the corner of the first pixel, half a pixel more than Sightline".to_owned(),
        ),
    ];
    let all = values
        .into_iter()
        .fold(AnyValues::default(), |all, (name, value)| all.with_component::<Text>(name, [value.as_str()]));
    stream.send_property("sightline", &all)
}
