//! The page around the panels: its address, the browser's storage, and what a test in a browser reads.
//!
//! | file | contents |
//! |---|---|
//! | `link` | the fragment of the address: session, target, run, step, arrangement |
//! | `storage` | what the browser keeps across reloads: arrangement, colours, keys |
//! | `status` | the machine-readable status of the page |
//! | `start` | the way in from the browser |
//! | `web` | the calls into the browser |

pub(crate) mod storage;
#[cfg(target_arch = "wasm32")]
pub(crate) mod start;
pub(crate) mod link;
#[cfg(target_arch = "wasm32")]
pub(crate) mod web;
pub(crate) mod status;
