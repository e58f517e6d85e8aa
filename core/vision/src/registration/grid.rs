//! Points on the grid of a range instrument: the input of a mesh (R187).
//!
//! Dense stereo gives one point for every left pixel, or none without a match. A scanner gives an unordered cloud, which
//! is ordered by the directions of measurement. Neighbours in the grid are neighbours in direction, so that a surface
//! can be laid through them without a search.
//!
//! | name | unit, frame |
//! |---|---|
//! | [`PointGrid::points`] | m, any frame that also contains the viewpoint; for stereo the rover frame |
//! | [`PointGrid::range_sigma_m`] | m, 1σ along the line of sight |
//! | [`Scan::azimuth_rad`], [`Scan::elevation_rad`] | rad, about the z axis and away from the plane across it |
//!
//! Source: D§2, "3D shape based tracker"; support for unordered clouds is ours.

use sightline_geometry::frames::Point3;

/// Points of a surface, row by row as seen from one viewpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointGrid {
    /// Points in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` points, m; `None` where nothing was measured.
    pub points: Vec<Option<Point3>>,
    /// 1σ of each point along its line of sight, m; `None` if unknown. Entries of missing points are meaningless.
    pub range_sigma_m: Option<Vec<f32>>,
}

/// Order of a cloud: equal steps of azimuth and elevation about its viewpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scan {
    /// Columns of the grid.
    pub columns: usize,
    /// Rows of the grid.
    pub rows: usize,
    /// Azimuth, atan2(y, x), at the outer edges of the first and the last column, rad.
    pub azimuth_rad: [f64; 2],
    /// Elevation towards +z at the outer edges of the first and the last row, rad.
    pub elevation_rad: [f64; 2],
}

impl PointGrid {
    /// A grid without points.
    pub fn empty(width: usize, height: usize) -> Self {
        Self { width, height, points: vec![None; width * height], range_sigma_m: None }
    }

    /// Returns the point at a column and a row, m.
    pub fn at(&self, x: usize, y: usize) -> Option<&Point3> {
        self.points.get(y * self.width + x)?.as_ref()
    }

    /// Returns 1σ of a point along its line of sight, m; 0 where unknown.
    pub fn sigma_at(&self, x: usize, y: usize) -> f32 {
        self.range_sigma_m.as_ref().and_then(|sigma| sigma.get(y * self.width + x)).copied().unwrap_or(0.0)
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.points.iter().flatten().count()
    }

    /// Orders a cloud by `scan`. The nearest of several points in one cell is kept; points outside the scan are dropped.
    /// All coordinates in one frame, m.
    pub fn from_cloud(cloud: &[Point3], viewpoint: &Point3, scan: &Scan) -> Self {
        let mut grid = Self::empty(scan.columns, scan.rows);
        let place = |value: f64, [first, last]: [f64; 2], count: usize| {
            let place = (value - first) / (last - first) * count as f64;
            (place >= 0.0 && place < count as f64).then_some(place as usize)
        };
        for point in cloud {
            let way = point - viewpoint;
            let column = place(way.y.atan2(way.x), scan.azimuth_rad, scan.columns);
            let row = place(way.z.atan2(way.x.hypot(way.y)), scan.elevation_rad, scan.rows);
            let (Some(column), Some(row)) = (column, row) else { continue };
            let held = &mut grid.points[row * scan.columns + column];
            if held.is_none_or(|held| way.norm_squared() < (held - viewpoint).norm_squared()) {
                *held = Some(*point);
            }
        }
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_is_put_in_order_by_direction_and_the_nearest_point_stays() {
        let scan = Scan { columns: 4, rows: 2, azimuth_rad: [0.4, -0.4], elevation_rad: [0.2, -0.2] };
        let at = |azimuth: f64, elevation: f64, range: f64| {
            let (level, up) = (elevation.cos() * range, elevation.sin() * range);
            Point3::new(1.0 + azimuth.cos() * level, azimuth.sin() * level, up)
        };
        let (far, near, low) = (at(0.3, 0.1, 5.0), at(0.31, 0.11, 4.0), at(-0.3, -0.1, 3.0));
        let beside = at(0.5, 0.0, 1.0);
        let grid = PointGrid::from_cloud(&[far, near, low, beside], &Point3::new(1.0, 0.0, 0.0), &scan);
        assert_eq!((grid.at(0, 0), grid.at(3, 1), grid.count()), (Some(&near), Some(&low), 2));
    }
}
