//! View of a target from the pair of a stop: its cameras and desired pointing, and whether the target is in view.

use sightline_geometry::frames::Point3;
use sightline_track::stages::point_mast::{self, Pointing};
use sightline_track::target::{Designation, Target};
use sightline_track::trace::StepTrace;

use crate::begun::Begun;
use crate::pair::StopPair;
use crate::pipeline::Stops;

/// Margin at the image border, as a fraction of its width, inside which a target is out of view: its search window would
/// be cut.
const VIEW_MARGIN: f64 = 1.0 / 16.0;

/// Cameras and desired pointing for a target carried to a stop, which may lack the target's pair.
pub(crate) fn pointing(stops: &dyn Stops, pair: Option<&StopPair<'_>>, carried: &Target) -> Pointing {
    let Some(pair) = pair else {
        let (left, right) = stops.cameras(carried.step);
        return point_mast::without_pair(left, right);
    };
    point_mast::point_mast(
        &carried.position_in_rover,
        &carried.covariance_in_rover,
        pair.pointing(stops, carried.designation.camera),
    )
}

/// The step of a stop at which the target is not searched: only visual odometry runs, or the mast is pointed at another
/// target and its pair does not show the predicted position of this one.
pub(crate) fn not_searched(
    stops: &dyn Stops,
    pair: Option<&StopPair<'_>>,
    target: &Target,
    begun: &Begun<'_>,
) -> Option<StepTrace> {
    if stops.is_odometry_alone(begun.step) {
        return Some(begun.odometry_alone());
    }
    let looks_elsewhere = stops.mast_target(begun.step).is_some_and(|other| other != target.designation);
    // A pair on the body has taken over for that other target.
    let is_of_mast = stops.mast_angles(begun.step).is_some() || stops.mast().is_none();
    let is_seen = |pair: &StopPair<'_>| is_of_mast && is_in_view(pair, &begun.predict.position_in_rover);
    (looks_elsewhere && pair.is_some_and(|pair| !is_seen(pair))).then(|| begun.out_of_view())
}

/// Whether both cameras of a pair show a point of the rover frame and some ground around it.
pub(crate) fn is_in_view(pair: &StopPair<'_>, point_in_rover: &Point3) -> bool {
    [pair.left, pair.right].into_iter().all(|camera| {
        let [width, height] = camera.size.map(f64::from);
        let margin_px = VIEW_MARGIN * width;
        camera.project(point_in_rover).is_some_and(|pixel| {
            (margin_px..width - margin_px).contains(&pixel.x)
                && (margin_px..height - margin_px).contains(&pixel.y)
        })
    })
}

/// Whether a stop is an additional look at a target: the rover has not moved since the previous stop, and the mast was
/// pointed at the target at both.
pub(crate) fn is_another_look(stops: &dyn Stops, step: usize, target: Designation) -> bool {
    has_stayed(stops, step)
        && [step - 1, step].into_iter().all(|step| stops.mast_target(step) == Some(target))
}

/// Whether the rover has not moved since the previous stop.
pub(crate) fn has_stayed(stops: &dyn Stops, step: usize) -> bool {
    step > 0 && stops.site_from_rover(step) == stops.site_from_rover(step - 1)
}
