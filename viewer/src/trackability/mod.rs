//! The trackability of the cursor's stop, and the aim in its left image.
//!
//! The map is read while a target is picked, and again after each event about new rows; ending the pick cancels it.

pub(crate) mod limits;
pub(crate) mod limits_window;
pub(crate) mod update;

use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::MapProgress;
use sightline_track::settings::Changes;

use crate::state::Place;
use crate::trackability::limits::Form;

/// A map of trackability: the traverse, the stop, and the limits that are not the defaults.
pub(crate) type MapPlace = (String, usize, Changes);

/// The trackability of a stop.
#[derive(Clone, Debug, Default)]
pub struct Trackability {
    /// The map that is shown or being made.
    pub place: Option<MapPlace>,
    /// The limits that are not the defaults.
    pub limits: Changes,
    /// The limits as they are typed, while their window is open.
    pub form: Option<Form>,
    /// How far the map is; none before the first answer.
    pub progress: Option<MapProgress>,
    /// The place that was picked and is designated once the map judges it.
    pub judged: Option<Place>,
    /// The place chosen by keys.
    pub aim: Option<Pixel>,
    is_asked: bool,
    is_stale: bool,
}
