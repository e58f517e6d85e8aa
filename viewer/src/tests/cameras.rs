//! Several cameras per stop: displayed images, the images of marks and picks, and explanations of missing images.

use std::sync::Arc;

use sightline_api::endpoints::DesignateTarget;
use sightline_api::wire::{NewTarget, StopCameraView, StopDetail};
use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;

use crate::cache::{ImageSide, Item, Key};
use crate::command::{Command, Mode};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::View2d;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::calls::{bodies, calls};
use crate::tests::{Shown, fixture};

fn name(text: &str) -> CameraName {
    text.parse().unwrap()
}

/// The drive of the fixture with hazcams at every stop, and a single mast camera that step 3 lacks.
fn with_cameras(context: &egui::Context, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    let view = |text: &str, right_size| StopCameraView {
        name: name(text),
        left_size: [64, 64],
        right_size,
        mast: None,
    };
    for (number, stop) in state.traverse.as_mut().unwrap().stops.iter_mut().enumerate() {
        stop.cameras = vec![view("front_hazcam", Some([64, 64]))];
        stop.cameras.extend((number != 3).then(|| view("mono", None)));
    }
    state
}

/// The same with the images of a camera shown and loaded.
fn showing(context: &egui::Context, step: usize, camera: Option<CameraName>) -> State {
    let mut state = with_cameras(context, step);
    state.perform(Command::ShowCamera(camera));
    for side in [ImageSide::Left, ImageSide::Right] {
        let image = sightline_vision::image::GrayImage::from_pixel(64, 64, image::Luma([0.5]));
        let bytes = sightline_vision::image::io::encode_png_u8(&image).unwrap();
        let raster = Raster::from_png(context, side.word(), &bytes).unwrap();
        if let Some(key) = state.image_key(step, side) {
            state.cache.store(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
        }
    }
    state
}

#[test]
fn the_choice_of_the_camera_is_shown_where_there_is_one() {
    let mut shown = Shown::pane(Pane::Left, |context| with_cameras(context, 2));
    shown.click("Camera");
    assert_eq!(shown.click("front_hazcam"), vec![Command::ShowCamera(Some(name("front_hazcam")))]);
    let mut shown = Shown::pane(Pane::Right, |context| with_cameras(context, 2));
    shown.click("Camera");
    assert_eq!(shown.click("mono"), vec![Command::ShowCamera(Some(name("mono")))]);
    let plain = Shown::pane(Pane::Left, |context| fixture::at_step(context, 2));
    assert!(!plain.has("Camera"), "a stop with its main pair alone has no choice");
}

#[test]
fn marks_are_painted_on_the_images_of_the_targets_camera_alone() {
    let mut main = Shown::pane(Pane::Left, |context| showing(context, 2, None));
    main.click("legend");
    main.says("match, 3σ").says("subframe 161 × 161 px");
    let hazcam = Shown::pane(Pane::Left, |context| showing(context, 2, Some(name("front_hazcam"))));
    hazcam.says("ridge is tracked in main pair: its marks are there");
    assert!(!hazcam.has("legend"), "there is no mark on it");
    let mut state = showing(&egui::Context::default(), 2, Some(name("front_hazcam")));
    assert!(state.trace().is_some() && state.trace_on_image().is_none());
    // A target of the hazcams has its marks there, and its selection shows that camera.
    state.session.as_mut().unwrap().targets[0].designation.camera = Some(name("front_hazcam"));
    assert!(state.trace_on_image().is_some() && state.camera_to_link().is_none());
    state.perform(Command::ShowCamera(None));
    assert_eq!((state.camera(), state.camera_to_link()), (None, Some(None)));
    assert!(state.trace_on_image().is_none());
}

#[test]
fn images_that_a_stop_lacks_say_so() {
    let mono = Some(name("mono"));
    Shown::pane(Pane::Left, move |context| showing(context, 3, mono)).says("Step 3 has no camera mono.");
    let right = Shown::pane(Pane::Right, move |context| showing(context, 2, mono));
    right.says("The camera mono of step 2 is a single one: it has no right image");
    let mut loading = with_cameras(&egui::Context::default(), 2);
    loading.perform(Command::ShowCamera(mono));
    assert_eq!(loading.image_key(3, ImageSide::Left), None);
    assert_eq!(loading.image_key(2, ImageSide::Right), None);
    let wanted = loading.needed_items();
    let image = Key::Image { traverse: "drive".to_owned(), step: 2, side: ImageSide::Left, camera: mono };
    assert!(wanted.contains(&image));
    assert!(loading.unrendered(&wanted).contains(&image), "it may have to be rendered");
    let further = |key: &Key| matches!(key, Key::Image { camera: Some(_), step, .. } if *step != 2);
    assert!(!wanted.iter().any(further), "nothing is rendered ahead");
    Shown::pane(Pane::Left, move |_| loading).says("Loading the left image of mono at step 2");
}

#[test]
fn a_pick_in_a_camera_designates_with_its_name() {
    let hazcam = Some(name("front_hazcam"));
    let mut state = showing(&egui::Context::default(), 2, hazcam);
    state.views.left = View2d::At { centre: Pixel::new(10.0, 10.0), scale: 4.0 };
    state.perform(Command::SetMode(Mode::Pick));
    let asked = calls(&mut state);
    assert!(!asked.iter().any(|call| call.path.contains("trackability")), "{asked:?}");
    state.perform(Command::Pick(Pixel::new(20.0, 30.0)));
    assert_eq!(state.designating.unwrap().camera, hazcam);
    let sent = bodies::<DesignateTarget>(&mut state);
    let expected = NewTarget { camera: hazcam, ..NewTarget::at_pixel(2, Pixel::new(20.0, 30.0)) };
    assert_eq!(sent, [expected]);
    // Another camera is fitted to the panel, because the view was for the previous image.
    state.views.left = View2d::At { centre: Pixel::new(10.0, 10.0), scale: 4.0 };
    state.perform(Command::ShowCamera(None));
    assert_eq!(state.views.left, View2d::Fit);
}

#[test]
fn the_cameras_of_the_shown_images_are_those_of_the_stop() {
    let mut state = showing(&egui::Context::default(), 2, Some(name("front_hazcam")));
    let key = state.stop_detail_key(2).unwrap();
    assert!(state.needed_items().contains(&key), "the record has the cameras of the target's pair alone");
    assert!(state.stereo_cameras().is_none());
    let pointing = state.trace().unwrap().point_mast.clone();
    let model = sightline_api::wire::StopCameraModels {
        name: name("front_hazcam"),
        left: pointing.right.clone(),
        right: Some(pointing.left.clone()),
    };
    let detail = StopDetail {
        stop: state.stop().unwrap().clone(),
        left: pointing.left.clone(),
        right: pointing.right.clone(),
        mast: None,
        cameras: vec![model],
    };
    state.cache.store(key, Ok(Item::Stop(Arc::new(detail))), 0.0);
    assert_eq!(state.stereo_cameras(), Some((&pointing.right, &pointing.left)));
    state.perform(Command::ShowCamera(None));
    assert_eq!(state.stereo_cameras(), Some((&pointing.left, &pointing.right)));
}
