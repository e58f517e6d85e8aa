//! Query parameters; unknown ones are refused.

use serde::{Deserialize, Serialize};
use sightline_geometry::camera::CameraName;
use utoipa::IntoParams;

/// What of a run is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FirstRow {
    /// The first row that is sent, counted from 0: of a run that goes on, how many are there already.
    #[serde(default)]
    pub from_row: usize,
}

/// Which image of a stop is wanted, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ImageWish {
    /// Bits of a pixel: 8 (the default) or 16.
    #[serde(default)]
    #[param(minimum = 8, maximum = 16, multiple_of = 8)]
    pub bits: Option<u8>,
    /// A camera of the stop beside its main pair, by its name; left out: the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[param(value_type = Option<String>)]
    pub camera: Option<CameraName>,
}

/// Which stops are wanted soon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct FirstStop {
    /// The first of them.
    pub from: usize,
}

/// Names the value of a step that a request asks about.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ValueName {
    /// The value's name; left out: the verdict, and the names that can be asked for.
    pub value: Option<String>,
}

/// The limits by which a map is made.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MapLimits {
    /// Limits that are not the defaults: `name=value`, commas between, for example `edge_bad_px=4,slant_risky_deg=70`.
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
    /// Limits that are not the defaults: `name=value`, commas between.
    pub limits: Option<String>,
}

/// Which part of a session is wanted; all of it by default.
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
