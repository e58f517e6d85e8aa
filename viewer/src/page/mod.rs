//! The page around the panels: its address, the browser's storage, and a status for browser tests.
//!
//! | file | contents |
//! |---|---|
//! | `link` | the fragment of the address: session, target, run, step, arrangement |
//! | `storage` | settings stored across reloads: arrangement, colours, stretch, keys |
//! | `status` | the machine-readable status of the page |
//! | `start` | the entry point in the browser |
//! | `web` | calls to the browser |

pub(crate) mod storage;
#[cfg(target_arch = "wasm32")]
pub(crate) mod start;
pub(crate) mod link;
#[cfg(target_arch = "wasm32")]
pub(crate) mod web;
pub(crate) mod status;
