//! Compares both searches at one step of a run: where coarse to fine differs from exhaustive (R65).

use super::scale_roll::scale_roll;
use super::settings::TemplateSettings;
use crate::target::Target;
use crate::trace::StepTrace;
use sightline_geometry::frames::Pose;
use sightline_vision::correlate::coarse_to_fine::{Comparison, compare};

/// Repeats the search of `step`, whose estimated pose is `site_from_rover`, both ways with the template of `before`.
///
/// `None` if that step did not search.
pub fn compare_searches(
    before: &Target,
    step: &StepTrace,
    site_from_rover: &Pose,
    settings: &TemplateSettings,
) -> Option<Comparison> {
    let appearance = &before.memory.template()?.appearance;
    let now_from_template = site_from_rover.inverse() * appearance.site_from_rover;
    let left = &step.point_mast.left;
    let evidence = step.template()?;
    let preparation = evidence.scale_roll.as_ref()?.preparation();
    let prepared = scale_roll(appearance, &now_from_template, left, settings, preparation).ok()?;
    let region = evidence.match_template.as_ref()?.search_window;
    let (similarity, descent, size) = (settings.similarity(), settings.descent(), settings.template_size_px);
    let wide = prepared.window(size + 2 * descent.margin_px(&similarity, size));
    compare(&similarity, &wide, size, &step.capture()?.pair.left, region, &descent)
}
