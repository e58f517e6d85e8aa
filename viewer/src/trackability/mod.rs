//! The trackability of the cursor's stop, and the aim in its left image.
//!
//! The map is read while a target is being picked, and again after each event about new rows; leaving the mode cancels it.

pub(crate) mod limits;
pub(crate) mod limits_window;
pub(crate) mod update;

use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::MapProgress;
use sightline_track::settings::Changes;

use crate::state::ImagePosition;
use crate::trackability::limits::LimitsForm;

/// Key of a trackability map: the traverse, the stop, and the limits that differ from the defaults.
pub(crate) type MapPlace = (String, usize, Changes);

/// State of the trackability map.
#[derive(Clone, Debug, Default)]
pub struct Trackability {
    /// The map that is shown or being computed.
    pub place: Option<MapPlace>,
    /// The limits that differ from the defaults.
    pub limits: Changes,
    /// The form of the limits, while its window is open.
    pub form: Option<LimitsForm>,
    /// The progress of the map; `None` before the first reply.
    pub progress: Option<MapProgress>,
    /// The picked position, which is designated once the map has a verdict for it.
    pub judged: Option<ImagePosition>,
    /// The position aimed at by keys.
    pub aim: Option<Pixel>,
    is_pending: bool,
    is_stale: bool,
}
