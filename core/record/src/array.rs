//! Arrays of a stage: their kinds, declarations and borrowed values.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Unit;
use sightline_vision::correlate::zncc::Surface;
use sightline_vision::image::patch::Patch;

/// The kind of an array; it decides how every view draws it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ArrayKind {
    /// Grey values of an image window.
    Patch,
    /// Signed differences; zero is the centre of the colour scale.
    Difference,
    /// Similarity scores of candidate positions: large is good.
    ScoreMap,
    /// Residuals of candidate positions: small is good.
    CostMap,
    /// Depths, ranges or disparities of an image's pixels.
    DepthMap,
    /// Triangles; each row has x, y and z of the three corners.
    Mesh,
    /// Rows of numbers; each column has its own unit.
    Table,
}

impl ArrayKind {
    /// Whether the array is an image, drawn as a raster.
    pub const fn is_raster(self) -> bool {
        !matches!(self, Self::Mesh | Self::Table)
    }

    /// Whether the values are signed, so that a diverging colour scale is needed.
    pub const fn is_signed(self) -> bool {
        matches!(self, Self::Difference)
    }
}

/// The declaration of an array.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ArrayDecl {
    /// The name in paths and files, unique in the record.
    pub name: Cow<'static, str>,
    /// The kind.
    pub kind: ArrayKind,
    /// The unit of its values; the columns of a table have their own.
    pub unit: Unit,
    /// One sentence: the contents, their unit, and the meaning of bright or large values.
    pub description: Cow<'static, str>,
}

/// A borrowed array of `f32` with rows of equal length; NaN where a value does not exist.
#[derive(Clone, Copy, Debug)]
pub struct ArrayView<'a> {
    columns: u32,
    values: &'a [f32],
}

impl<'a> ArrayView<'a> {
    /// Row-major values with this many columns.
    pub const fn new(columns: u32, values: &'a [f32]) -> Self {
        Self { columns, values }
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        [self.columns, (self.values.len() / self.columns.max(1) as usize) as u32]
    }

    /// Row-major values.
    pub const fn values(&self) -> &'a [f32] {
        self.values
    }

    /// Whether the array has no columns.
    pub const fn is_empty(&self) -> bool {
        self.columns == 0
    }
}

impl<'a> From<&'a Patch> for ArrayView<'a> {
    fn from(patch: &'a Patch) -> Self {
        Self::new(patch.width(), patch.as_raw())
    }
}

impl<'a> From<&'a Surface> for ArrayView<'a> {
    fn from(surface: &'a Surface) -> Self {
        Self::new(surface.width, &surface.scores)
    }
}
