//! A chessboard that a person turns in front of two cameras that stand still: seven stereo frames, straightened.
//!
//! The file with calibration and poses counts in squares; a square is taken as 3 cm, so that distances here are as those of
//! a real board and the settings keep their meaning. The cameras then are 10 cm apart and the board about 40 cm away,
//! nearer than what a rover tracks: the nearest range of features is lowered for it.
//!
//! Only features on the board count. By its corners instead, triangulated from their places in both images and matched by
//! their number, the motion is found as well as these images allow; the true poses come from the left ones.

use std::path::Path;

use image::ImageReader;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::Deserialize;

use super::lens::Lens;
use super::{Frame, Recording, Row, Set, pair};
use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::estimate::horn::rigid_motion;
use sightline_geometry::estimate::triangulate::midpoint;
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::image::GrayImage;

const FOLDER: &str = "opencv-chessboard-stereo";
/// Side of a square, m.
const SQUARE_M: f64 = 0.03;
/// Nearest range of features, m.
const RANGE_MIN_M: f64 = 0.15;
/// The outline of the board, a square beyond its outer corners, and its centre: in squares from the first corner.
const OUTLINE: [[f64; 2]; 4] = [[-1.0, -1.0], [9.0, -1.0], [9.0, 6.0], [-1.0, 6.0]];
const CENTRE: [f64; 2] = [4.0, 2.5];

/// The part of the file that is needed; the letters are its own.
#[derive(Deserialize)]
struct Calibration {
    #[serde(rename = "K1")]
    k1: [[f64; 3]; 3],
    #[serde(rename = "D1")]
    d1: [f64; 5],
    #[serde(rename = "K2")]
    k2: [[f64; 3]; 3],
    #[serde(rename = "D2")]
    d2: [f64; 5],
    #[serde(rename = "R")]
    r: [[f64; 3]; 3],
    #[serde(rename = "T")]
    t: [f64; 3],
    frames: Vec<Board>,
}

/// The board in one frame.
#[derive(Deserialize)]
struct Board {
    frame: u32,
    rvec: [f64; 3],
    tvec: [f64; 3],
    corners_left: Vec<[f64; 2]>,
    corners_right: Vec<[f64; 2]>,
}

impl Board {
    fn left_from_board(&self) -> Pose {
        Pose::new(Vector3::from(self.tvec) * SQUARE_M, Vector3::from(self.rvec))
    }

    fn centre_in_left(&self) -> Point3 {
        self.left_from_board() * on_board(CENTRE)
    }
}

/// A place of the board in its own frame, m.
fn on_board([x, y]: [f64; 2]) -> Point3 {
    Point3::new(x, y, 0.0) * SQUARE_M
}

impl Calibration {
    fn read(data: &Path) -> Result<Self> {
        let path = data.join(FOLDER).join("calibration_and_poses.json");
        let text = std::fs::read(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
        serde_json::from_slice(&text).map_err(|error| Error::format(path, error.to_string()))
    }

    fn lenses(&self) -> [Lens; 2] {
        [(&self.k1, self.d1), (&self.k2, self.d2)].map(|(k, d)| Lens::from_matrix(&matrix(k), d))
    }

    fn cameras(&self, size: [u32; 2]) -> [Camera; 2] {
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix(&self.r)));
        let translation = Translation3::from(Vector3::from(self.t) * SQUARE_M);
        let left_from_right = Pose::from_parts(translation, rotation).inverse();
        let [left, right] = self.lenses();
        [left.camera(&Pose::identity(), size), right.camera(&left_from_right, size)]
    }
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// All frames, each with the next one.
pub(super) fn read(data: &Path) -> Result<Recording> {
    let calibration = Calibration::read(data)?;
    let lenses = calibration.lenses();
    let folder = data.join(FOLDER);
    let mut frames = Vec::new();
    for board in &calibration.frames {
        let image = |eye: usize| {
            let name = format!("{}{:02}.jpg", ["left", "right"][eye], board.frame);
            Ok::<_, Error>(lenses[eye].straighten(&read_jpeg(&folder.join(name))?))
        };
        frames.push(Frame {
            name: format!("{}", board.frame),
            pair: pair(image(0)?, image(1)?),
            world_from_rig: board.left_from_board().inverse(),
            about_in_rig: board.centre_in_left(),
            outline: None,
        });
    }
    let size = frames.first().map(|frame| frame.pair.left.dimensions().into()).unwrap_or_default();
    let cameras = calibration.cameras(size);
    for (frame, board) in frames.iter_mut().zip(&calibration.frames) {
        let corner = |place| cameras[0].project(&(board.left_from_board() * on_board(place)));
        let [Some(a), Some(b), Some(c), Some(d)] = OUTLINE.map(corner) else {
            let problem = format!("the board of frame {} is not in front of the camera", board.frame);
            return Err(Error::format(folder, problem));
        };
        frame.outline = Some([a, b, c, d]);
    }
    let pairs = (1..frames.len()).map(|now| (Set::Chessboard, now - 1, now)).collect();
    Ok(Recording { cameras, frames, pairs, range_min_m: Some(RANGE_MIN_M) })
}

/// The motions by the corners.
pub(super) fn corner_rows(data: &Path) -> Result<Vec<Row>> {
    let calibration = Calibration::read(data)?;
    let (lenses, cameras) = (calibration.lenses(), calibration.cameras([0, 0]));
    let ray = |eye: usize, [x, y]: [f64; 2]| cameras[eye].ray(lenses[eye].straight(Pixel::new(x, y)));
    let meet =
        |(left, right): (&[f64; 2], &[f64; 2])| Some(midpoint(&ray(0, *left)?, &ray(1, *right)?)?.point);
    let corners = |board: &Board| -> Option<Vec<Point3>> {
        board.corners_left.iter().zip(&board.corners_right).map(meet).collect()
    };
    let row = |boards: &[Board]| {
        let (then, now) = (&boards[0], &boards[1]);
        let now_from_then = now.left_from_board() * then.left_from_board().inverse();
        let found = corners(then).zip(corners(now)).and_then(|(a, b)| rigid_motion(&a, &b, None).ok());
        let count = then.corners_left.len();
        let pair = format!("{} to {}", then.frame, now.frame);
        Row {
            matches: count,
            inliers: count,
            ..Row::new(Set::ChessboardCorners, pair, &now_from_then, &then.centre_in_left(), found)
        }
    };
    Ok(calibration.frames.windows(2).map(row).collect())
}

/// A grey JPEG image as fractions of full scale.
fn read_jpeg(path: &Path) -> Result<GrayImage> {
    let file = ImageReader::open(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    let decoded = file.decode();
    Ok(decoded.map_err(|error| Error::format(path, error.to_string()))?.to_luma32f())
}
