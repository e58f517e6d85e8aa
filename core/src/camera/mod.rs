//! Camera models.
