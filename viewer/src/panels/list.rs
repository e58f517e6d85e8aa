//! The list of panels: which panel a name means. Adding one takes its own file, its facts in [`crate::pane`] and its
//! line here.

use crate::breakpoints::panel::Breakpoints;
use crate::notes::panel::Notes;
use crate::pane::Pane;
use crate::panels::panel::Panel;
use crate::panels::{
    budget, features, gates, history, image_right, images_left, inspector, machine, map, messages, plots,
    runs, settings, shape, stereo_profile, strip, surface, targets, tolerances, uncertainty,
};
use crate::studies::panel::Studies;
use crate::why::panel::Why;

impl Pane {
    /// The panel itself.
    pub fn panel(self) -> &'static dyn Panel {
        match self {
            Self::Targets => &targets::Targets,
            Self::Settings => &settings::Settings,
            Self::Left => &images_left::LeftView,
            Self::Right => &image_right::RightView,
            Self::Features => &features::Features,
            Self::Shape => &shape::Shape,
            Self::Budget => &budget::Budget,
            Self::Studies => &Studies,
            Self::Strip => &strip::Strip,
            Self::History => &history::History,
            Self::Surface => &surface::Scores,
            Self::StereoProfile => &stereo_profile::StereoProfile,
            Self::Map => &map::Map,
            Self::Plots => &plots::Plots,
            Self::Tolerances => &tolerances::Tolerances,
            Self::Gates => &gates::Gates,
            Self::Machine => &machine::Machine,
            Self::Inspector => &inspector::Inspector,
            Self::Messages => &messages::Messages,
            Self::Runs => &runs::Runs,
            Self::Uncertainty => &uncertainty::UncertaintyPanel,
            Self::Why => &Why,
            Self::Notes => &Notes,
            Self::Breakpoints => &Breakpoints,
        }
    }

    /// Whether the panel can be looked at as tables.
    pub(crate) fn has_table(self) -> bool {
        self.panel().table().is_some()
    }
}
