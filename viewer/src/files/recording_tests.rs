//! Opening a recording: listed, examined, imported with progress and cancellation, and refused with a remedy.

use sightline_api::endpoints::{
    AddTraverse, BeginUpload, CancelImport, ListRecordings, ListSessions, ListTraverses, RemoveUpload,
    ShowImport, ShowRecording, StartImport,
};
use sightline_api::event::Event;
use sightline_api::recording::{
    ImportJob, ImportState, NewImport, RecordedPair, RecordingEntry, RecordingList, RecordingView, UploadView,
};
use sightline_api::wire::{Problem, TraverseEntry};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_world::library;

use crate::command::Command;
use crate::files::FilesCommand;
use crate::files::inbox::{Arrival, Chosen};
use crate::files::recording::RecordingCommand;
use crate::files::window;
use crate::net::events::Connection;
use crate::state::State;
use crate::state::effect::Effect;
use crate::tests::calls::{answer, bodies, calls, calls_of, refuse};
use crate::tests::{Shown, fixture};

const FOLDER: &str = "/data/recordings";

fn list() -> RecordingList {
    let entry = |name: &str, format: &str| RecordingEntry {
        path: format!("{FOLDER}/{name}"),
        format: format.to_owned(),
    };
    let recordings = vec![entry("kitti/01", "KITTI odometry"), entry("sol-4087", "PDS3")];
    RecordingList { folders: vec![FOLDER.to_owned()], recordings, is_complete: true }
}

fn contents() -> RecordingView {
    let pair = |step: usize| RecordedPair {
        step,
        left: format!("image_0/{step:06}.png"),
        right: format!("image_1/{step:06}.png"),
    };
    RecordingView {
        path: format!("{FOLDER}/kitti/01"),
        format: "KITTI odometry".to_owned(),
        name: "01".to_owned(),
        stop_count: 20,
        image_count: 40,
        left_size: [1226, 370],
        right_size: [1226, 370],
        stereo: StereoGeometry::Lateral,
        pairs: [0, 1, 2, 19].map(pair).to_vec(),
        further_cameras: Vec::new(),
        has_truth: true,
        is_opened_in_place: false,
        notes: Vec::new(),
    }
}

fn job(state: ImportState, k: usize) -> ImportJob {
    ImportJob {
        id: "import-1".to_owned(),
        path: contents().path,
        state,
        k,
        n: 40,
        traverse: (state == ImportState::Done).then(|| "01-abc".to_owned()),
        problem: None,
        notes: Vec::new(),
    }
}

fn perform(state: &mut State, command: RecordingCommand) {
    state.perform(Command::Files(FilesCommand::Recording(command)));
}

/// The window with the list of recordings.
fn opened() -> State {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.take_requests();
    state.perform(Command::Files(FilesCommand::Open));
    answer::<ListRecordings>(&mut state, &list());
    answer::<ListSessions>(&mut state, &Vec::<u8>::new());
    state.take_requests();
    state
}

/// The window with the contents of the first recording.
fn examined() -> State {
    let mut state = opened();
    perform(&mut state, RecordingCommand::Examine(contents().path));
    assert_eq!(
        calls_of::<ShowRecording>(&mut state)[0].path,
        "recordings/contents?path=%2Fdata%2Frecordings%2Fkitti%2F01"
    );
    answer::<ShowRecording>(&mut state, &contents());
    state
}

/// The window while the first recording is imported.
fn importing() -> State {
    let mut state = examined();
    perform(&mut state, RecordingCommand::Import);
    perform(&mut state, RecordingCommand::Import);
    let imports = bodies::<StartImport>(&mut state);
    assert_eq!(imports, [NewImport { path: contents().path }], "once, however often it is pressed");
    answer::<StartImport>(&mut state, &job(ImportState::Waiting, 0));
    answer::<ShowImport>(&mut state, &job(ImportState::Running, 0));
    state.apply_event(Event::ImportProgress { job: job(ImportState::Running, 10) });
    state
}

fn shown(state: fn() -> State) -> Shown<'static> {
    Shown::new([1000.0, 800.0], move |_| state(), window::show)
}

#[test]
fn a_recording_is_opened_in_three_actions() {
    // Ctrl+O was the first action.
    let asked = shown(opened).click("recording kitti/01");
    assert_eq!(
        asked,
        vec![Command::Files(FilesCommand::Recording(RecordingCommand::Examine(contents().path)))]
    );
    let mut card = shown(examined);
    for words in [
        "KITTI odometry",
        "20 stops",
        "1226 × 370 px",
        "side by side",
        "image_0/000019.png",
        "image_1/000000.png",
    ] {
        card.says(words);
    }
    card.hides("recent session");
    let asked = card.click("Import the recording 01");
    assert_eq!(asked, vec![Command::Files(FilesCommand::Recording(RecordingCommand::Import))]);

    let mut state = importing();
    // The list as the window showed it when it opened.
    answer::<ListTraverses>(&mut state, &[fixture::entry()]);
    state.apply_event(Event::ImportProgress {
        job: ImportJob { id: "import-9".to_owned(), ..job(ImportState::Done, 40) },
    });
    assert!(state.files.is_open, "that is the import of another page");
    state.apply_event(Event::ImportProgress { job: job(ImportState::Done, 40) });
    assert!(!state.files.is_open);
    let entry = TraverseEntry { id: "01-abc".to_owned(), ..fixture::entry() };
    answer::<ListTraverses>(&mut state, &[fixture::entry(), entry]);
    assert_eq!(calls_of::<ListSessions>(&mut state).len(), 1, "its latest session, or a new one");
}

#[test]
fn an_import_shows_its_progress_and_can_be_cancelled() {
    let mut card = shown(importing);
    card.says("10 of 40 images");
    let asked = card.click("Cancel the import");
    assert_eq!(asked, vec![Command::Files(FilesCommand::Recording(RecordingCommand::Cancel))]);
    let mut state = importing();
    state.take_requests();
    perform(&mut state, RecordingCommand::Cancel);
    assert_eq!(calls_of::<CancelImport>(&mut state)[0].path, "imports/import-1/cancel");
    answer::<CancelImport>(&mut state, &job(ImportState::Running, 5));
    assert_eq!(state.files.recordings.import.as_ref().unwrap().k, 10, "an older answer changes nothing");
    state.apply_event(Event::ImportProgress { job: job(ImportState::Cancelled, 11) });
    assert_eq!((state.files.is_open, &state.files.recordings.import), (true, &None));
    assert!(state.messages.newest().unwrap().text.contains("cancelled"));
}

#[test]
fn an_import_is_followed_when_the_server_answers_again() {
    let away = || {
        let mut state = importing();
        state.connected(Connection::Live);
        state.connected(Connection::Gone { attempts: 1 });
        state.take_requests();
        state.connected(Connection::Live);
        state
    };
    let mut state = away();
    answer::<ShowImport>(&mut state, &job(ImportState::Done, 40));
    assert_eq!((state.files.is_open, &state.files.recordings.import), (false, &None));
    let mut state = away();
    refuse::<ShowImport>(&mut state, Problem::new(404, "not_found", "", "There is no such import."));
    assert_eq!(state.files.recordings.import, None);
    assert!(state.files.recordings.problem.unwrap().detail.contains("import the recording again"));
}

#[test]
fn a_refused_recording_is_explained_where_it_was_chosen() {
    let refused = || {
        let mut state = opened();
        perform(&mut state, RecordingCommand::Examine("/etc".to_owned()));
        let mut problem =
            Problem::new(422, "path", "", "path: “/etc” is nothing below the folders of recordings.");
        problem.hint = Some("Start the server with `sightline serve --recordings FOLDER`.".to_owned());
        refuse::<ShowRecording>(&mut state, problem);
        state
    };
    shown(refused)
        .says("“/etc” is nothing below")
        .says("sightline serve --recordings FOLDER")
        .says("recording sol-4087");
    let failed = || {
        let mut state = importing();
        let problem = Some("calib.txt needs a line P1.".to_owned());
        state
            .apply_event(Event::ImportProgress { job: ImportJob { problem, ..job(ImportState::Failed, 3) } });
        state
    };
    shown(failed).says("calib.txt needs a line P1.").says("Import the recording 01").says("Back");
    let mut state = failed();
    perform(&mut state, RecordingCommand::Back);
    assert_eq!((&state.files.recordings.shown, &state.files.recordings.problem), (&None, &None));
}

#[test]
fn without_folders_the_window_says_how_the_server_is_started_with_one() {
    let without = || {
        let mut state = opened();
        state.files.recordings.list = Some(RecordingList { is_complete: true, ..RecordingList::default() });
        state
    };
    shown(without).says("sightline serve --recordings FOLDER").hides("path of a recording");
}

#[test]
fn a_chosen_folder_is_sent_and_examined_and_what_is_not_imported_is_removed() {
    let chosen = || Chosen { name: "kitti".to_owned(), file_count: 3, bytes: 2_500_000 };
    let upload =
        UploadView { id: "upload-1".to_owned(), path: "/up/upload-1".to_owned(), files: 0, bytes: 0 };
    let sending = move || {
        let mut state = opened();
        perform(&mut state, RecordingCommand::Choose { is_archive: false });
        assert!(state.take_effects().contains(&Effect::ChooseRecording { is_archive: false }));
        state.file_arrived(Arrival::Chosen(chosen()));
        answer::<BeginUpload>(&mut state, &upload);
        assert!(state.take_effects().contains(&Effect::SendRecording("upload-1".to_owned())));
        state.file_arrived(Arrival::Sent(1));
        state
    };
    let mut card = Shown::new([1000.0, 800.0], move |_| sending(), window::show);
    card.says("kitti: sent 1 of 3 files, 2.5 MB");
    assert_eq!(
        card.click("Cancel sending"),
        vec![Command::Files(FilesCommand::Recording(RecordingCommand::StopSending))]
    );
    let upload =
        UploadView { id: "upload-1".to_owned(), path: "/up/upload-1".to_owned(), files: 0, bytes: 0 };
    let begun = || {
        let mut state = opened();
        state.file_arrived(Arrival::Chosen(chosen()));
        answer::<BeginUpload>(&mut state, &upload);
        state.take_requests();
        state
    };
    let mut state = begun();
    perform(&mut state, RecordingCommand::StopSending);
    assert_eq!(calls_of::<RemoveUpload>(&mut state)[0].path, "uploads/upload-1");

    let mut state = begun();
    state.file_arrived(Arrival::Sent(3));
    assert_eq!(calls_of::<ShowRecording>(&mut state)[0].path, "recordings/contents?path=%2Fup%2Fupload-1");
    answer::<ShowRecording>(&mut state, &contents());
    perform(&mut state, RecordingCommand::Back);
    assert_eq!(calls_of::<RemoveUpload>(&mut state).len(), 1);

    let mut state = begun();
    state.file_arrived(Arrival::NotSent(Problem::new(
        413,
        "too_large",
        "",
        "The upload has more than 9 bytes.",
    )));
    assert_eq!(calls_of::<RemoveUpload>(&mut state).len(), 1);
    assert_eq!(state.files.recordings.problem.as_ref().unwrap().detail, "The upload has more than 9 bytes.");
}

#[test]
fn a_scenario_of_the_program_is_opened_with_one_click() {
    let mut state = opened();
    perform(&mut state, RecordingCommand::Scenario("occlusion"));
    assert_eq!(bodies::<AddTraverse>(&mut state)[0].scenario, library::toml("occlusion").unwrap());
    let entry = TraverseEntry { id: "occlusion-1".to_owned(), ..fixture::entry() };
    answer::<AddTraverse>(&mut state, &entry);
    assert!(!state.files.is_open && !calls(&mut state).is_empty());
}

#[test]
fn the_window_stays_where_it_is_from_the_second_frame_on() {
    use egui_kittest::kittest::Queryable;
    let mut window = shown(opened);
    let place = |window: &Shown<'_>| window.harness.get_by_label("recording kitti/01").rect();
    let first = place(&window);
    window.harness.run_steps(12);
    assert_eq!(place(&window), first);
}
