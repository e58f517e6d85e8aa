//! The parsers of foreign bytes, each as a function of arbitrary bytes: a file of an import, a request, a stored record.
//!
//! A parser may refuse its input; it must not panic, nor take seconds or hundreds of megabytes. `cargo xtask fuzz` searches
//! for inputs that violate this, guided by the coverage of the workspace's own crates. The inputs under `corpus/` are the
//! seeds of the search and the inputs that once failed; the tests replay them, with seeded changes.

mod files;
mod connections;
mod recording;
mod requests;
mod server;
mod store;
mod texts;
#[cfg(test)]
mod replay;

/// A parser of foreign bytes.
pub struct Target {
    /// Its name, which is also the name of its folder of inputs.
    pub name: &'static str,
    /// The function; it must return for every input.
    pub parse: fn(&[u8]),
}

/// All parsers of foreign bytes.
pub const TARGETS: &[Target] = &[
    Target { name: "pds3", parse: files::pds3 },
    Target { name: "kitti_calibration", parse: files::kitti_calibration },
    Target { name: "kitti_poses", parse: files::kitti_poses },
    Target { name: "index_toml", parse: files::index_toml },
    Target { name: "index_json", parse: files::index_json },
    Target { name: "camera", parse: texts::camera },
    Target { name: "scenario", parse: texts::scenario },
    Target { name: "expression", parse: texts::expression },
    Target { name: "png", parse: files::png },
    Target { name: "npz", parse: files::npz },
    Target { name: "stored_session", parse: texts::stored_session },
    Target { name: "reproduction", parse: texts::reproduction },
    Target { name: "store", parse: store::store },
    Target { name: "settings", parse: texts::settings },
    Target { name: "requests", parse: requests::requests },
    Target { name: "http", parse: connections::http },
    Target { name: "websocket", parse: connections::websocket },
];

/// The parser with this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
