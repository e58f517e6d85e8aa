//! Why the shape tracker has no surface, no view or no draped image, rendered to a sentence in the record. Failures of a
//! registration itself are `sightline_vision::registration::Failure`.

/// Why there is nothing to register.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeFailure {
    /// Dense stereo failed.
    #[error("no surface: {0}")]
    NoSurface(String),
    /// The surface around the target is too small.
    #[error(
        "dense stereo finds too little surface around the target: {triangles} triangles, {needed} are needed"
    )]
    TooLittleSurface {
        /// Triangles of the mesh.
        triangles: usize,
        /// Triangles that are needed (`shape_triangles_min`).
        needed: usize,
    },
    /// There is no view to register to.
    #[error("the surface of the first view is not known")]
    NoFirstView,
}

/// Why the draped image was not found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DrapeFailure {
    /// No window is large enough.
    #[error("the window is too small")]
    WindowTooSmall,
    /// The registered target is outside the image.
    #[error("the registered target is not in the present image")]
    TargetOutside,
    /// The surface is seen at a grazing angle.
    #[error("the earlier surface is seen edge-on from here")]
    EdgeOn,
    /// Nothing can be correlated.
    #[error("the window around the target is not all in both images, or has no contrast")]
    NothingToCompare,
    /// No position has a score.
    #[error("no position of the window could be compared")]
    NoScore,
    /// The score is too low.
    #[error("the draped image matches with a score of {score:.2}, less than {limit:.2}")]
    LowScore {
        /// The best score.
        score: f64,
        /// The smallest accepted score (`hand_off_score_min`).
        limit: f64,
    },
    /// The best match may be outside the search region.
    #[error("the best match is on the border of the searched region")]
    AtSearchEdge,
    /// The ray of the match does not meet the surface.
    #[error("the ray of the match misses the surface")]
    RayMissesSurface,
    /// The match has no ray.
    #[error("the match has no ray")]
    NoRay,
    /// The earlier image does not contain the target.
    #[error("the earlier image does not show the target")]
    TargetUnseen,
    /// The earlier image contains only a part of the window.
    #[error("the earlier image does not show the whole window around the target{}", reach_text(.reached_px))]
    WindowUnseen {
        /// A corner of the window that is outside the earlier image, px.
        reached_px: Option<[f64; 2]>,
    },
}

fn reach_text(reached_px: &Option<[f64; 2]>) -> String {
    reached_px.map_or_else(String::new, |[x, y]| format!(": it reaches to ({x:.0}, {y:.0})"))
}
