//! Settings of the hazard map: unit, default, range and source of each.
//!
//! A term has full goodness up to `…_ok_…` and none from `…_bad_…` on; between them its goodness falls linearly
//! (`goodness.rs`). Sources: domain.md 8.2, whose values marked “M” are those commonly reported for MER.

use sightline_geometry::error::{Error, Result};
use sightline_track::limits::Domain;
use sightline_track::settings_group;
use sightline_vision::stereo::{StereoMethod, StereoSettings};

settings_group! {
    /// Settings of the hazard map.
    HazardSettings as "hazards" {
        /// Side of a cell. Smaller: rocks are sharper, but distant cells lack points.
        cell_m: f64 = 0.10, "m", Domain::Between(0.05, 0.5), "ours; Goldberg02 has 0.20";
        /// Side of the map, which wraps around the rover.
        side_m: f64 = 16.0, "m", Domain::Between(4.0, 40.0), "ours; Goldberg02 has 10";
        /// Radius of the disc under which the ground is assessed: half the width over the wheels with a margin.
        rover_radius_m: f64 = 0.8, "m", Domain::Between(0.2, 2.0), "ours, after Goldberg02";
        /// Largest distance of two cells whose height difference relative to the slope of the ground counts as a step.
        step_reach_m: f64 = 0.4, "m", Domain::Between(0.1, 1.0), "ours, after Goldberg02";
        /// Largest tilt of the plane with full goodness.
        tilt_ok_deg: f64 = 8.0, "deg", Domain::Between(0.0, 45.0), "ours, after Goldberg02";
        /// Tilt from which on the goodness is 0.
        tilt_bad_deg: f64 = 25.0, "deg", Domain::Between(1.0, 60.0), "ours, after Goldberg02";
        /// Largest RMS residual of the plane with full goodness.
        roughness_ok_m: f64 = 0.04, "m", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// RMS residual from which on the goodness is 0.
        roughness_bad_m: f64 = 0.10, "m", Domain::Between(0.001, 2.0), "ours, after Goldberg02";
        /// Largest step with full goodness.
        step_ok_m: f64 = 0.08, "m", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Step from which on the goodness is 0.
        step_bad_m: f64 = 0.18, "m", Domain::Between(0.001, 2.0), "ours: wheels climb 0.25 m; docs/driving.md";
        /// A step higher than this reaches the deck: 0.62 m above the ground, with a margin.
        deck_clearance_m: f64 = 0.5, "m", Domain::Between(0.0, 10.0), "ours, after the deck of MER";
        /// Distance beyond the disc at the rover's origin in which such a step counts: half the width of the deck (1.15 m)
        /// with a margin.
        deck_overhang_m: f64 = 0.45, "m", Domain::Between(0.0, 3.0), "ours, after the deck of MER";
        /// If the heights of a cell's points spread by more, they are on the face of an obstacle, whose height is that of
        /// its upper edge.
        face_spread_m: f64 = 0.03, "m", Domain::Between(0.0, 2.0), "ours; docs/driving.md";
        /// Number of points in the disc from which on it does not reduce the certainty.
        points_full: f64 = 40.0, "", Domain::Between(3.0, 10_000.0), "ours, after Goldberg02";
        /// A cell is known if its decayed number of points is at least this.
        weight_min: f64 = 0.25, "", Domain::Between(0.001, 100.0), "ours";
        /// A cell of lower certainty is unknown.
        certainty_min: f64 = 0.3, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Distance driven in which the number of points halves.
        half_life_m: f64 = 5.0, "m", Domain::Between(0.1, 1000.0), "ours, after Goldberg02";
        /// Nearest range of the stereo pair.
        range_min_m: f64 = 0.4, "m", Domain::Between(0.1, 10.0), "ours";
        /// Points farther from the left camera are excluded: their error exceeds the terms.
        range_max_m: f64 = 3.5, "m", Domain::Between(1.0, 100.0), "ours";
        /// The same for a pair on the mast, which looks down more steeply and has a higher resolution.
        mast_range_max_m: f64 = 5.0, "m", Domain::Between(1.0, 100.0), "ours; docs/driving.md";
        /// 1σ of a point's disparity, from which its height error follows; steps must exceed that error.
        disparity_sigma_px: f64 = 0.25, "px", Domain::Between(0.0, 5.0), "ours; Kim09 §4.2 has 1/3";
        /// Height difference of two cells that does not count as a step, in 1σ of the difference.
        step_sigmas: f64 = 0.25, "", Domain::Between(0.0, 10.0), "ours";
        /// Smallest gradient of the image for a match, fraction of full scale per px. Too low: points in the sky; too
        /// high: holes.
        range_texture_min: f64 = 0.003, "1/px", Domain::Between(0.0, 0.1), "ours; docs/driving.md";
        /// Smallest relative margin of the best match over any other.
        range_uniqueness_min: f64 = 0.15, "", Domain::Between(0.0, 1.0), "ours; docs/driving.md";
        /// Disparity patches of fewer pixels are removed (speckle filter).
        range_speckle_px: u32 = 250, "px", Domain::Between(0.0, 100_000.0), "ours; JPL: 4 % of the image";
        /// A stop whose pair gives fewer points has no range data.
        range_points_min: u32 = 200, "", Domain::Between(1.0, 100_000.0), "ours";
        /// Points within this distance of the rover's origin along its length and …
        own_half_length_m: f64 = 0.95, "m", Domain::Between(0.0, 3.0), "ours: the body of MER";
        /// … across its width are excluded: they are its own wheels and panels.
        own_half_width_m: f64 = 1.2, "m", Domain::Between(0.0, 3.0), "ours: the body of MER";
        /// Points higher above the rover's origin are excluded: the rover passes below them, or they are false matches.
        height_max_m: f64 = 2.0, "m", Domain::Between(0.2, 20.0), "ours";
        /// Depth of the ground below the rover's origin: stereo matches relative to that plane.
        ground_below_m: f64 = 0.294, "m", Domain::Between(0.0, 2.0), "VICAR PigMER";
        /// Images wider than this are reduced before stereo.
        range_width_px: u32 = 256, "px", Domain::Between(64.0, 2048.0), "Kim09 §3; flown width";
        /// Cells within this distance of the target count as good (target exemption); 0 = none.
        exemption_radius_m: f64 = 0.0, "m", Domain::Between(0.0, 5.0), "Kim09 §6; off";
        /// Unknown cells within this distance of the start count as good …
        start_radius_m: f64 = 2.0, "m", Domain::Between(0.0, 10.0), "Kim09 §6";
        /// … until the rover is this far from the start: the first map has no data under the rover.
        start_distance_m: f64 = 2.0, "m", Domain::Between(0.0, 10.0), "Kim09 §6";
    }
}

impl HazardSettings {
    /// Rejects values out of range, and contradictory limits.
    ///
    /// # Errors
    /// [`Error::Setting`] with the setting and its range.
    pub fn validate(&self) -> Result<()> {
        let document = serde_json::to_value(self).map_err(|e| Error::setting("hazards", e.to_string()))?;
        for info in Self::table() {
            if let Some(problem) = info.problem_with(&document[&info.key]) {
                return Err(Error::setting(info.key, problem));
            }
        }
        for (ok, bad, key) in [
            (self.tilt_ok_deg, self.tilt_bad_deg, "tilt_ok_deg"),
            (self.roughness_ok_m, self.roughness_bad_m, "roughness_ok_m"),
            (self.step_ok_m, self.step_bad_m, "step_ok_m"),
            (self.range_min_m, self.range_max_m, "range_min_m"),
            (self.range_min_m, self.mast_range_max_m, "range_min_m"),
        ] {
            if ok >= bad {
                return Err(Error::setting(key, format!("{ok} must be less than {bad}, the upper limit")));
            }
        }
        if self.rover_radius_m < 2.0 * self.cell_m {
            let problem = format!("must be at least two cells of {} m", self.cell_m);
            return Err(Error::setting("rover_radius_m", problem));
        }
        Ok(())
    }

    /// These settings for a pair on the mast.
    pub(crate) fn of_mast(&self) -> Self {
        Self { range_max_m: self.mast_range_max_m, ..self.clone() }
    }

    /// Cells along a side of the map, an even number.
    pub(super) fn side_cells(&self) -> usize {
        2 * (0.5 * self.side_m / self.cell_m).round() as usize
    }

    /// Settings of dense stereo for the points of the map.
    pub(super) fn stereo(&self) -> StereoSettings {
        StereoSettings {
            // Semi-global matching carries disparities of the ground into the sky.
            method: StereoMethod::BlockMatching,
            range_min_m: self.range_min_m,
            range_max_m: self.range_max_m,
            texture_min: self.range_texture_min,
            uniqueness_min: self.range_uniqueness_min,
            speckle_px: self.range_speckle_px,
            ..StereoSettings::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_contradictions_are_refused() {
        assert!(HazardSettings::default().validate().is_ok());
        let refused = |change: fn(&mut HazardSettings)| {
            let mut settings = HazardSettings::default();
            change(&mut settings);
            settings.validate().map_err(|error| error.to_string()).unwrap_err()
        };
        assert!(refused(|s| s.cell_m = f64::NAN).contains("cell_m"));
        assert!(refused(|s| s.tilt_ok_deg = 30.0).contains("tilt_ok_deg"));
        assert!(refused(|s| (s.rover_radius_m, s.cell_m) = (0.3, 0.2)).contains("two cells"));
    }
}
