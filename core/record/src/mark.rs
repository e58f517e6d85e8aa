//! Marks: what a stage found in an image, as shapes with roles. One list for every renderer.

use std::borrow::Cow;

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pixel;
use sightline_vision::image::PixelRect;

/// An image of the stereo pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Eye {
    /// The left (or first) image.
    Left,
    /// The right (or second) image.
    Right,
}

/// The role of a mark, from which a renderer takes its colour and stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The prediction and its covariance.
    Prediction,
    /// The region that was searched.
    Search,
    /// The accepted measurement.
    Measurement,
    /// The second-best measurement.
    SecondPeak,
    /// The designated or corrected position of the template.
    Template,
    /// The ground truth.
    Truth,
}

/// The kind of a mark's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeKind {
    /// Contour of a covariance.
    Ellipse,
    /// Four corners.
    Quad,
    /// A polyline.
    Curve,
    /// A dot.
    Dot,
    /// A cross.
    Cross,
    /// An axis-aligned rectangle of pixels.
    Rect,
}

/// A shape in an image, px; (0, 0) is the centre of the first pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Shape {
    /// The 1σ contour of a covariance.
    Ellipse {
        /// Its centre.
        centre: Pixel,
        /// The covariance, px².
        #[schema(value_type = Vec<f64>)]
        covariance_px2: Matrix2<f64>,
    },
    /// Four corners in order.
    Quad {
        /// The corners.
        corners: [Pixel; 4],
    },
    /// A polyline.
    Curve {
        /// Its points.
        points: Vec<Pixel>,
    },
    /// A dot.
    Dot {
        /// Its position.
        at: Pixel,
    },
    /// A cross.
    Cross {
        /// Its position.
        at: Pixel,
    },
    /// A rectangle of whole pixels.
    Rect {
        /// The pixels inside.
        rect: PixelRect,
    },
}

impl Shape {
    /// The kind of the shape.
    pub const fn kind(&self) -> ShapeKind {
        match self {
            Self::Ellipse { .. } => ShapeKind::Ellipse,
            Self::Quad { .. } => ShapeKind::Quad,
            Self::Curve { .. } => ShapeKind::Curve,
            Self::Dot { .. } => ShapeKind::Dot,
            Self::Cross { .. } => ShapeKind::Cross,
            Self::Rect { .. } => ShapeKind::Rect,
        }
    }
}

/// The declaration of a mark.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct MarkDecl {
    /// The name, unique in the stage.
    pub name: Cow<'static, str>,
    /// The image it is drawn in.
    pub eye: Eye,
    /// Its role.
    pub role: Role,
    /// The kind of its shape.
    pub kind: ShapeKind,
}

/// A mark at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mark {
    /// The name of its declaration.
    pub name: Cow<'static, str>,
    /// The image it is drawn in.
    pub eye: Eye,
    /// Its role.
    pub role: Role,
    /// Its shape.
    #[serde(flatten)]
    pub shape: Shape,
}
