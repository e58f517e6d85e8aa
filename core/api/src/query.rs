//! Query parameters; unknown ones are refused.

use serde::{Deserialize, Serialize};
use sightline_geometry::camera::CameraName;
use utoipa::IntoParams;

/// The rows of a run to send.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FirstRow {
    /// The first row to send, from 0: for a run in progress, the number of rows that the client already has.
    #[serde(default)]
    pub from_row: usize,
}

/// Which image of a stop to send, and its bit depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ImageWish {
    /// Bits per pixel: 8 (the default) or 16.
    #[serde(default)]
    #[param(minimum = 8, maximum = 16, multiple_of = 8)]
    pub bits: Option<u8>,
    /// The name of a camera of the stop other than the main pair; default: the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[param(value_type = Option<String>)]
    pub camera: Option<CameraName>,
}

/// The stops to render first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FirstStop {
    /// The first of these stops.
    pub from: usize,
}

/// Names the value of a step to explain.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ValueName {
    /// The value's name; default: the verdict, with the names of all values that can be explained.
    pub value: Option<String>,
}

/// The limits of a trackability map.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MapLimits {
    /// Limits that differ from the defaults, separated by commas, for example `edge_bad_px=4,slant_risky_deg=70`.
    pub limits: Option<String>,
}

/// A pixel of the left image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MapPixel {
    /// Its column, px.
    pub x: f64,
    /// Its row, px.
    pub y: f64,
    /// Limits that differ from the defaults: `name=value`, separated by commas.
    pub limits: Option<String>,
}

/// The part of a session; all of it by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct SessionPart {
    /// One target by its number.
    #[serde(default)]
    pub target: Option<usize>,
    /// One run of that target by its number.
    #[serde(default)]
    pub run: Option<usize>,
}
