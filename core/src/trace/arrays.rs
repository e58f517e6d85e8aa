//! The arrays of a step: what is fetched one by one and drawn.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::StepTrace;
use crate::correlate::zncc::Surface;
use crate::image::patch::Patch;
use crate::locate::features::FeatureEvidence;
use crate::locate::features::evidence::Table;
use crate::locate::shape_tracker::evidence::ShapeArrays;

impl StepTrace {
    /// An array of this step, where the stage that makes it was reached.
    pub fn array(&self, name: ArrayName) -> Option<ArrayView<'_>> {
        let table = |table: fn(&FeatureEvidence) -> &Table| {
            self.features().map(table).filter(|table| table.columns > 0).map(ArrayView::Table)
        };
        let shape = |table: fn(&ShapeArrays) -> &Table| {
            self.shape().map(|e| table(&e.arrays)).filter(|table| table.columns > 0).map(ArrayView::Table)
        };
        let draped = self.shape().and_then(|e| e.registration.as_ref()?.draped.as_ref());
        let evidence = self.template();
        let scale_roll = evidence.and_then(|e| e.scale_roll.as_ref());
        let matched = evidence.and_then(|e| e.match_template.as_ref());
        match name {
            ArrayName::Features => table(|evidence| &evidence.table),
            ArrayName::Cloud => table(|evidence| &evidence.cloud),
            ArrayName::Disparities => shape(|arrays| &arrays.disparities),
            ArrayName::Ranges => shape(|arrays| &arrays.ranges),
            ArrayName::Sensor => shape(|arrays| &arrays.sensor),
            ArrayName::ErrorBefore => shape(|arrays| &arrays.error_before),
            ArrayName::ErrorCoarse => shape(|arrays| &arrays.error_coarse),
            ArrayName::ErrorFine => shape(|arrays| &arrays.error_fine),
            ArrayName::CoarseSearch => shape(|arrays| &arrays.coarse),
            ArrayName::RefinePath => shape(|arrays| &arrays.path),
            ArrayName::MeshFixed => shape(|arrays| &arrays.mesh_fixed),
            ArrayName::MeshMoving => shape(|arrays| &arrays.mesh_moving),
            ArrayName::Draped => draped.map(|draped| ArrayView::Table(&draped.picture)),
            ArrayName::DrapedMatch => draped.map(|draped| ArrayView::Table(&draped.matched)),
            ArrayName::Reference => scale_roll.map(|s| ArrayView::Patch(&s.reference)),
            ArrayName::Scaled => scale_roll.map(|s| ArrayView::Patch(&s.scaled)),
            ArrayName::Rolled => scale_roll.map(|s| ArrayView::Patch(&s.rolled)),
            ArrayName::Matched => matched.map(|m| ArrayView::Patch(&m.matched)),
            ArrayName::Difference => matched.map(|m| ArrayView::Patch(&m.difference)),
            ArrayName::Surface => matched.map(|m| &m.surface).filter(|s| s.width > 0).map(ArrayView::Surface),
            ArrayName::RightWindow => {
                evidence.and_then(|e| e.point_stereo.as_ref()).map(|s| ArrayView::Patch(&s.right_window))
            }
        }
    }
}

/// The arrays of a step, in the order of the strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ArrayName {
    /// The template as it was taken.
    Reference,
    /// The template, scaled.
    Scaled,
    /// The template, scaled and rolled: what was matched.
    Rolled,
    /// The image at the match.
    Matched,
    /// Matched minus rolled, both normalised.
    Difference,
    /// The scores of all positions of the search window.
    Surface,
    /// The right image at the stereo match.
    RightWindow,
    /// The features of the left image: a row each, with the columns of `FeatureColumn`.
    Features,
    /// Where the bootstrap puts the target: a row each, position and pixel.
    Cloud,
    /// Disparities of the aligned left image, px.
    Disparities,
    /// Distances from the left camera in the aligned left image, m.
    Ranges,
    /// The earlier surface in the virtual range sensor: depth, m.
    Sensor,
    /// Present less earlier depth there before the registration, m.
    ErrorBefore,
    /// The same after the coarse search.
    ErrorCoarse,
    /// The same at its end.
    ErrorFine,
    /// Mean distance of the surfaces for every shift of the coarse search, m.
    CoarseSearch,
    /// The way of the refinement, a row a step.
    RefinePath,
    /// The earlier mesh, a row a facet: x, y, z of its corners in the present rover frame, m.
    MeshFixed,
    /// The present mesh alike.
    MeshMoving,
    /// At a hand-off, the earlier image draped over the surface as the present camera would see it.
    Draped,
    /// The present image where it was found.
    DrapedMatch,
}

impl ArrayName {
    /// All arrays, in the order of the strip.
    pub const ALL: [Self; 21] = [
        Self::Reference,
        Self::Scaled,
        Self::Rolled,
        Self::Matched,
        Self::Difference,
        Self::Surface,
        Self::RightWindow,
        Self::Features,
        Self::Cloud,
        Self::Disparities,
        Self::Ranges,
        Self::Sensor,
        Self::ErrorBefore,
        Self::ErrorCoarse,
        Self::ErrorFine,
        Self::CoarseSearch,
        Self::RefinePath,
        Self::MeshFixed,
        Self::MeshMoving,
        Self::Draped,
        Self::DrapedMatch,
    ];

    /// The name as paths and files write it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Scaled => "scaled",
            Self::Rolled => "rolled",
            Self::Matched => "matched",
            Self::Difference => "difference",
            Self::Surface => "surface",
            Self::RightWindow => "right_window",
            Self::Features => "features",
            Self::Cloud => "cloud",
            Self::Disparities => "disparities",
            Self::Ranges => "ranges",
            Self::Sensor => "sensor",
            Self::ErrorBefore => "error_before",
            Self::ErrorCoarse => "error_coarse",
            Self::ErrorFine => "error_fine",
            Self::CoarseSearch => "coarse_search",
            Self::RefinePath => "refine_path",
            Self::MeshFixed => "mesh_fixed",
            Self::MeshMoving => "mesh_moving",
            Self::Draped => "draped",
            Self::DrapedMatch => "draped_match",
        }
    }

    /// The array of that name.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|name| name.word() == word)
    }
}

/// A borrowed two-dimensional array of `f32`.
#[derive(Clone, Copy, Debug)]
pub enum ArrayView<'a> {
    /// A patch of grey values; NaN where invalid.
    Patch(&'a Patch),
    /// A surface of scores; NaN where excluded.
    Surface(&'a Surface),
    /// Rows of numbers; NaN where one does not exist.
    Table(&'a Table),
}

impl<'a> ArrayView<'a> {
    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Patch(patch) => patch.dimensions().into(),
            Self::Surface(surface) => [surface.width, surface.height],
            Self::Table(table) => {
                [table.columns, (table.values.len() / table.columns.max(1) as usize) as u32]
            }
        }
    }

    /// Row-major values.
    pub fn values(&self) -> &'a [f32] {
        match self {
            Self::Patch(patch) => patch.as_raw(),
            Self::Surface(surface) => &surface.scores,
            Self::Table(table) => &table.values,
        }
    }
}
