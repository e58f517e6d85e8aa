//! Tests of the refinement through a Gaussian window.

use super::*;
