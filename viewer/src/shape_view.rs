//! The selection in the shape panel: the part, the limit of the colours, and the viewpoint of the meshes.

/// The parts of the shape panel, in the order in which a registration computes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShapePart {
    /// Disparities and ranges of the stop (dense stereo).
    Surface,
    /// Depth maps of the virtual range sensor, and their differences.
    #[default]
    Sensor,
    /// The coarse search, and the iterations of the refinement.
    Search,
    /// Both meshes in 3-D.
    Meshes,
    /// The image of the previous camera, draped over its mesh and rendered for the next camera.
    HandOff,
}

impl ShapePart {
    /// All parts, in order.
    pub const ALL: [Self; 5] = [Self::Surface, Self::Sensor, Self::Search, Self::Meshes, Self::HandOff];

    /// The title in the panel.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Surface => "Surface",
            Self::Sensor => "Sensor",
            Self::Search => "Search",
            Self::Meshes => "Meshes",
            Self::HandOff => "Hand-off",
        }
    }
}

/// Viewpoint of the meshes, as rotations from the camera's own view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Rotation about the vertical, rad; positive: the viewpoint moves to the right.
    pub yaw_rad: f64,
    /// Rotation about the horizontal of the screen, rad; positive: the viewpoint moves up.
    pub pitch_rad: f64,
    /// Magnification relative to the view that fits both meshes.
    pub zoom: f64,
}

impl Default for Orbit {
    fn default() -> Self {
        Self { yaw_rad: 0.0, pitch_rad: 0.0, zoom: 1.0 }
    }
}

impl Orbit {
    /// Rotation per point of a drag, rad.
    const TURN: f64 = 0.01;

    /// The viewpoint after a drag, points.
    #[must_use]
    pub fn turned(self, right: f32, down: f32) -> Self {
        let yaw_rad = (self.yaw_rad - Self::TURN * f64::from(right)) % std::f64::consts::TAU;
        let pitch_rad = self.pitch_rad + Self::TURN * f64::from(down);
        Self { yaw_rad, pitch_rad: pitch_rad.clamp(-1.55, 1.55), ..self }
    }

    /// The viewpoint with its magnification multiplied by a factor.
    #[must_use]
    pub(crate) fn zoomed(self, factor: f64) -> Self {
        Self { zoom: (self.zoom * factor).clamp(0.2, 40.0), ..self }
    }
}

/// The selection in the shape panel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShapeView {
    /// The part.
    pub part: ShapePart,
    /// The colours of depth errors range from minus to plus this, m; `None`: a limit that covers nearly all errors.
    pub error_limit_m: Option<f64>,
    /// Viewpoint of the meshes.
    pub orbit: Orbit,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_turns_and_stops_at_the_poles_and_the_wheel_keeps_its_limits() {
        let orbit = Orbit::default().turned(10.0, 20.0);
        assert!((orbit.yaw_rad + 0.1).abs() < 1e-12 && (orbit.pitch_rad - 0.2).abs() < 1e-12);
        assert_eq!(orbit.turned(0.0, 1e6).pitch_rad, 1.55);
        assert_eq!(orbit.zoomed(1e9).zoom, 40.0);
        assert_eq!(orbit.zoomed(1e-9).zoom, 0.2);
    }
}
