//! Claims about the simulator as a whole.

use super::*;
