//! The routes of the REST interface, one file a resource; [`openapi`] puts them together.

pub(crate) mod route;
pub(crate) mod about;
pub(crate) mod settings;
pub(crate) mod traverses;
pub(crate) mod sessions;
pub(crate) mod targets;
pub(crate) mod runs;
pub(crate) mod removal;
pub(crate) mod steps;
pub(crate) mod photometry;
pub(crate) mod compare;
pub(crate) mod exports;
pub(crate) mod rerun;
pub(crate) mod studies;
pub(crate) mod notes;
pub(crate) mod documents;
pub(crate) mod plain;
pub(crate) mod breakpoints;
pub(crate) mod expressions;
pub(crate) mod events;
pub(crate) mod trackability;
pub(crate) mod counterfactual;
pub(crate) mod what_if;
pub(crate) mod why;
pub(crate) mod openapi;
pub(crate) mod page;
