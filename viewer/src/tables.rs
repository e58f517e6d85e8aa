//! The trackers' tables as received from the server, and the filter of the features.

use sightline_track::locate::features::evidence::{CLOUD_COLUMNS, FeatureColumn};
use sightline_track::locate::features::rows::{self, CloudPoint, Feature, Matched};
use sightline_track::locate::shape_tracker::evidence::{MESH_COLUMNS, PATH_COLUMNS};
use sightline_track::locate::shape_tracker::rows::{self as shape_rows, Facet, PathStep};
use sightline_track::trace::ArrayName;
use sightline_vision::image::npy;

/// A table, row by row.
pub enum Table {
    /// The features of the left image.
    Features(Vec<Feature>),
    /// The bootstrap distribution of the target.
    Cloud(Vec<CloudPoint>),
    /// The iterations of a refinement.
    Path(Vec<PathStep>),
    /// The facets of a mesh.
    Facets(Vec<Facet>),
}

impl Table {
    /// Whether an array is a table rather than an image.
    pub fn is_table(name: ArrayName) -> bool {
        Self::columns(name).is_some()
    }

    /// Number of columns of a table; `None` for an image.
    fn columns(name: ArrayName) -> Option<usize> {
        match name {
            ArrayName::FEATURES => Some(FeatureColumn::COUNT),
            ArrayName::CLOUD => Some(CLOUD_COLUMNS),
            ArrayName::REFINE_PATH => Some(PATH_COLUMNS),
            ArrayName::MESH_FIXED | ArrayName::MESH_MOVING => Some(MESH_COLUMNS),
            _ => None,
        }
    }

    /// Reads a table from its NumPy file.
    ///
    /// # Errors
    /// A sentence if the bytes are not a 2-D array of numbers with this table's columns.
    pub fn from_npy(name: ArrayName, bytes: &[u8]) -> Result<Self, String> {
        let values = npy::decode(bytes, name.word()).map_err(|e| e.to_string())?;
        let columns = Self::columns(name).unwrap_or_default();
        if values.width() as usize != columns {
            return Err(format!("{} has {} columns, not {columns}", name.word(), values.width()));
        }
        let values = values.as_raw();
        Ok(match name {
            ArrayName::CLOUD => Self::Cloud(rows::cloud(values).collect()),
            ArrayName::REFINE_PATH => Self::Path(shape_rows::path(values).collect()),
            ArrayName::MESH_FIXED | ArrayName::MESH_MOVING => {
                Self::Facets(shape_rows::facets(values).collect())
            }
            _ => Self::Features(rows::features(values).collect()),
        })
    }

    /// Memory size of the rows, bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Features(rows) => rows.len() * size_of::<Feature>(),
            Self::Cloud(rows) => rows.len() * size_of::<CloudPoint>(),
            Self::Path(rows) => rows.len() * size_of::<PathStep>(),
            Self::Facets(rows) => rows.len() * size_of::<Facet>(),
        }
    }
}

/// The outcome of matching a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatchOutcome {
    /// No match with the earlier stop.
    Unmatched,
    /// Its match is an inlier of the motion.
    Inlier,
    /// Its match is an outlier.
    Outlier,
}

impl MatchOutcome {
    /// The outcome for `feature`.
    pub fn of(feature: &Feature) -> Self {
        match &feature.matched {
            None => Self::Unmatched,
            Some(matched) if matched.is_inlier => Self::Inlier,
            Some(_) => Self::Outlier,
        }
    }
}

/// Filter of the displayed features, and magnification of their residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureView {
    /// Range of the displayed residuals, m. Features without a match have no residual and pass.
    pub residual_m: [f64; 2],
    /// Range of the displayed feature scales, px.
    pub sigma_px: [f64; 2],
    /// Factor by which the drawn residuals are lengthened.
    pub magnification: f64,
}

impl Default for FeatureView {
    fn default() -> Self {
        let all = [0.0, f64::INFINITY];
        Self { residual_m: all, sigma_px: all, magnification: 10.0 }
    }
}

impl FeatureView {
    /// Whether a feature passes the filters.
    pub fn shows(&self, feature: &Feature) -> bool {
        let within = |value: f64, [least, largest]: [f64; 2]| value >= least && value <= largest;
        let residual_m = feature.matched.as_ref().and_then(|matched: &Matched| matched.residual_m);
        within(feature.sigma_px, self.sigma_px) && residual_m.is_none_or(|r| within(r, self.residual_m))
    }

    /// Counts the features of a kind, and those of them that are shown.
    pub fn count(&self, features: &[Feature], kind: MatchOutcome) -> Count {
        let of_kind = || features.iter().filter(|feature| MatchOutcome::of(feature) == kind);
        Count { all: of_kind().count(), shown: of_kind().filter(|feature| self.shows(feature)).count() }
    }
}

/// Number of features, and of those that are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// Number of all features.
    pub all: usize,
    /// Number of features that pass the filter.
    pub shown: usize,
}

impl Count {
    /// “12”, or “3 of 12” where some are not shown.
    pub fn words(self) -> String {
        if self.shown == self.all { self.all.to_string() } else { format!("{} of {}", self.shown, self.all) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::Pixel;
    use sightline_vision::image::GrayImage;

    fn feature(sigma_px: f64, residual_m: Option<f64>) -> Feature {
        let matched = residual_m.map(|residual_m| Matched {
            then: Pixel::new(1.0, 1.0),
            moved: None,
            residual_m: Some(residual_m),
            is_inlier: residual_m < 0.03,
        });
        let pixel = Pixel::new(0.0, 0.0);
        Feature { pixel, sigma_px, orientation_rad: 0.0, right: None, range_m: None, matched }
    }

    #[test]
    fn filters_hold_scale_and_residual_and_features_without_a_match_have_no_residual() {
        let view = FeatureView { residual_m: [0.0, 0.02], sigma_px: [2.0, 5.0], ..FeatureView::default() };
        assert!(view.shows(&feature(3.0, Some(0.02))));
        assert!(!view.shows(&feature(3.0, Some(0.021))));
        assert!(!view.shows(&feature(1.9, Some(0.01))));
        assert!(view.shows(&feature(5.0, None)));
        let features = [feature(3.0, Some(0.01)), feature(3.0, Some(0.025)), feature(3.0, Some(1.0))];
        assert_eq!(view.count(&features, MatchOutcome::Inlier).words(), "1 of 2");
        assert_eq!(view.count(&features, MatchOutcome::Outlier).words(), "0 of 1");
        assert_eq!(FeatureView::default().count(&features, MatchOutcome::Outlier).words(), "1");
    }

    #[test]
    fn a_table_with_other_columns_is_refused_and_one_without_rows_is_empty() {
        let bytes = |width: u32, height: u32| npy::encode(&GrayImage::new(width, height)).unwrap();
        let refused = Table::from_npy(ArrayName::FEATURES, &bytes(5, 2)).err().unwrap();
        assert_eq!(refused, "features has 5 columns, not 13");
        let empty = Table::from_npy(ArrayName::FEATURES, &bytes(13, 0)).unwrap();
        assert!(matches!(empty, Table::Features(rows) if rows.is_empty()));
        let cloud = Table::from_npy(ArrayName::CLOUD, &bytes(5, 2)).unwrap();
        assert!(matches!(cloud, Table::Cloud(rows) if rows.len() == 2));
        let mesh = Table::from_npy(ArrayName::MESH_FIXED, &bytes(9, 4)).unwrap();
        assert!(matches!(mesh, Table::Facets(rows) if rows.len() == 4));
        let path = Table::from_npy(ArrayName::REFINE_PATH, &bytes(9, 3)).unwrap();
        assert!(matches!(path, Table::Path(rows) if rows.len() == 3));
        assert!(Table::from_npy(ArrayName::MESH_MOVING, &bytes(3, 3)).is_err());
    }
}
