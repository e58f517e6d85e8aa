//! Opening in a real browser.
