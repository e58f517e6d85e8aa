//! Builds the world of a scenario: ground and rocks around the planned drive, their light, the fixed exposure.

use std::sync::{Arc, OnceLock};

use crate::camera::render;
use crate::culling::{SunGrid, Tree};
use crate::ground::around::Around;
use crate::ground::footing::Footing;
use crate::ground::rock_field::{self, Approach};
use crate::ground::surface::Surfaces;
use crate::ground::terrain::Terrain;
use crate::light::openness::Openness;
use crate::light::reflection::Light;
use crate::moment::fiducials;
use crate::rover::plan;
use crate::scenario::Scenario;
use crate::world::{Scenery, World};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Point3, Ray, Vector3};

impl World {
    /// Builds the world of a scenario at the start of the drive, without the rover and occluders. The scenario must
    /// be valid ([`Scenario::validate`]).
    pub fn new(scenario: &Scenario) -> Self {
        Self::new_until(scenario, Cancel::default()).unwrap_or_else(|_| unreachable!("nobody cancels"))
    }

    /// [`World::new`], cancellable.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`].
    pub fn new_until(scenario: &Scenario, cancel: Cancel<'_>) -> Result<Self> {
        let approach = Approach {
            goal_m: plan::goal_m(&scenario.drive),
            wheels_reach_m: plan::wheels_reach_m(&scenario.drive),
            around: Around::new(&scenario.drive, &scenario.camera),
        };
        let [x_m, y_m] = plan::ground_extent_m(&scenario.drive);
        let terrain = Terrain::new_until(&scenario.terrain, x_m, y_m, scenario.seed, cancel)?;
        let rocks = rock_field::scatter(&scenario.rocks, &approach, &terrain, scenario.seed, cancel)?;
        let light = Light::new(&scenario.sun, scenario.texture.soil_albedo);
        let sun_grid = Arc::new(SunGrid::new(&rocks, &light.to_sun));
        cancel.check()?;
        let [x_m_goal, y_m_goal] = approach.goal_m;
        let openness = Openness::new(&rocks, x_m, y_m);
        cancel.check()?;
        let footing = Footing::new(&rocks, x_m, y_m, scenario.rover.climb_m);
        cancel.check()?;
        let scenery = Scenery {
            tree: Tree::new(&rocks),
            openness,
            footing,
            surfaces: Surfaces::new(&scenario.texture, scenario.seed),
            terrain,
            rocks,
            targets_centre: Point3::origin(),
            laid: OnceLock::new(),
        };
        let mut world = Self {
            scenery: Arc::new(scenery),
            light,
            sun_grid,
            solids: Vec::new(),
            imprint: None,
            exposure: 1.0,
        };
        let down = Ray { origin: Point3::new(x_m_goal, y_m_goal, -100.0), direction: Vector3::z() };
        let centre = world.cast(&down).map_or(Point3::new(x_m_goal, y_m_goal, 0.0), |hit| hit.point);
        Arc::make_mut(&mut world.scenery).targets_centre = centre;
        world.solids = fiducials(&scenario.fiducials, &centre);
        cancel.check()?;
        world.exposure = render::exposure(&world, scenario, cancel);
        cancel.check()?;
        Ok(world)
    }
}
