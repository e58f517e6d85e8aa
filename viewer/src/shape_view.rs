//! What is looked at of a registration by shape: which part, with which limit of colours, and from where.

/// The parts of the panel about shape, in the order in which a registration makes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// Disparities and ranges of the stop.
    Surface,
    /// The virtual range sensor and the errors of depth in it.
    #[default]
    Sensor,
    /// The coarse search and the way of the refinement.
    Search,
    /// Both meshes in space.
    Meshes,
    /// The picture of the last camera in the image of the next one.
    HandOff,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Surface, Self::Sensor, Self::Search, Self::Meshes, Self::HandOff];

    /// Its name.
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

/// From where the meshes are seen: turned from the camera's own view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// About the vertical, rad; positive: the eye goes to the right.
    pub yaw_rad: f64,
    /// About the horizontal of the screen, rad; positive: the eye goes up.
    pub pitch_rad: f64,
    /// Magnification beyond that at which all of it fits.
    pub zoom: f64,
}

impl Default for Orbit {
    fn default() -> Self {
        Self { yaw_rad: 0.0, pitch_rad: 0.0, zoom: 1.0 }
    }
}

impl Orbit {
    /// How far a drag by one point turns, rad.
    const TURN: f64 = 0.01;

    /// After a drag of so many points.
    #[must_use]
    pub fn turned(self, right: f32, down: f32) -> Self {
        let yaw_rad = (self.yaw_rad - Self::TURN * f64::from(right)) % std::f64::consts::TAU;
        let pitch_rad = self.pitch_rad + Self::TURN * f64::from(down);
        Self { yaw_rad, pitch_rad: pitch_rad.clamp(-1.55, 1.55), ..self }
    }

    /// Magnified by a factor.
    #[must_use]
    pub(crate) fn zoomed(self, factor: f64) -> Self {
        Self { zoom: (self.zoom * factor).clamp(0.2, 40.0), ..self }
    }
}

/// What is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShapeView {
    /// The part.
    pub part: Part,
    /// Errors of depth are coloured from minus this to this, m; none: what nearly all of them keep to.
    pub error_limit_m: Option<f64>,
    /// From where the meshes are seen.
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
