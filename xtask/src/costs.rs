//! Processor time that the compiler needs for the largest crates, for the estimate of a build's remaining time.

/// Processor time per crate, s; measured with the profile `dev`, for the viewer's crates with the profile `viewer`.
const COSTS_S: [(&str, f64); 46] = [
    ("sightline-core", 245.0),
    ("sightline-viewer", 130.0),
    ("sightline-server", 110.0),
    ("vello_cpu", 60.0),
    ("sightline-tests", 60.0),
    ("egui", 34.0),
    ("image", 26.0),
    ("parquet", 22.0),
    ("redb", 22.0),
    ("read-fonts", 21.0),
    ("re_sdk_types", 19.0),
    ("web-sys", 19.0),
    ("arrow-array", 16.0),
    ("skrifa", 12.0),
    ("tokio", 12.0),
    ("nalgebra", 12.0),
    ("harfrust", 11.0),
    ("js-sys", 11.0),
    ("epaint", 10.0),
    ("arrow-cast", 9.0),
    ("moxcms", 8.0),
    ("pulp", 8.0),
    ("pxfm", 8.0),
    ("fixed", 8.0),
    ("glam", 7.0),
    ("arrow-ipc", 6.0),
    ("wasm-bindgen-macro-support", 6.0),
    ("ttf-parser", 6.0),
    ("re_mcap", 6.0),
    ("syn", 6.0),
    ("wide", 6.0),
    ("rustls", 6.0),
    ("arrow-ord", 6.0),
    ("object", 5.0),
    ("re_protos", 5.0),
    ("tiny-skia", 5.0),
    ("arrow-select", 5.0),
    ("h2", 5.0),
    ("utoipa-gen", 5.0),
    ("arrow-data", 5.0),
    ("rustix", 5.0),
    ("vello_common", 5.0),
    ("toml", 5.0),
    ("simba", 5.0),
    ("axum", 5.0),
    ("regex-automata", 5.0),
];

/// Mean processor time of all other crates, s.
const OTHER_S: f64 = 0.6;

/// The estimated processor time for compiling the crate `name`, s.
pub(crate) fn of(name: &str) -> f64 {
    COSTS_S.iter().find(|(crate_name, _)| *crate_name == name).map_or(OTHER_S, |&(_, cost)| cost)
}
