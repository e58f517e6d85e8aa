//! Smoke tests of the panels.
