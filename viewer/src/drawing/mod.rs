//! Images and marks on the screen.
//!
//! | file | contents |
//! |---|---|
//! | `raster`, `stretch` | images and arrays as textures, and the stretch of grey values |
//! | `view2d` | the zoomable canvas |
//! | `overlay`, `ellipse`, `contour` | marks on the canvas |
//! | `decimate` | decimation of long drives for drawing |

pub(crate) mod view2d;
pub(crate) mod overlay;
pub(crate) mod ellipse;
pub(crate) mod contour;
pub(crate) mod raster;
pub(crate) mod stretch;
pub(crate) mod decimate;
