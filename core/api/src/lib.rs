//! The types that server and viewer exchange: endpoints, requests, replies and events of the REST and WebSocket
//! interface.

pub mod endpoint;
pub mod endpoints;
pub mod event;
pub mod location;
pub mod program;
pub mod query;
pub mod recording;
pub mod table;
pub mod wire;
