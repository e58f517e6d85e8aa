//! All endpoints, one type each: method, path, then the types of path parameters, query, body and reply.
//!
//! A new endpoint is one entry here, one handler in `server/src/routes`, and its call in the viewer.

use serde_json::Value;
use sightline_rover::trackability::{MapProgress, PixelVerdict};
use sightline_session::Cursor;
use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::compare::{Comparison, NewComparison};
use sightline_session::counterfactual::wire::Question;
use sightline_session::documents::Document;
use sightline_session::driving::{DriveView, Steering};
use sightline_session::exports::ExportEntry;
use sightline_session::expression::complete::Completion;
use sightline_session::hazard_view::HazardView;
use sightline_session::metrics::RunMetrics;
use sightline_session::notes::{EditNote, NewNote, Note};
use sightline_session::query::{CompletionQuery, Language, Query, QueryAnswer};
use sightline_session::reproduce::Reproduction;
use sightline_session::step::RunStep;
use sightline_session::times::StageTime;
use sightline_session::view::{RunView, SessionView};
use sightline_session::what_if::{Ghost, WhatIf};
use sightline_session::why::Explanation;
use sightline_study::wire::{NewStudy, StudyInfo, StudyJob, StudyRows};
use sightline_track::limits::SettingInfo;
use sightline_track::locate::template::history::AgainstEarlier;

use crate::endpoint::{Done, Endpoint, File, Method, NoBody, NoQuery};
use crate::event::Event;
use crate::location::{
    Anywhere, AtBreakpoint, AtDocument, AtDriveStop, AtExport, AtImage, AtImport, AtNote, AtRun, AtSession,
    AtStep, AtStop, AtStudyJob, AtTarget, AtTraverse, AtUpload, AtViewerFile,
};
use crate::program::{Health, Version};
use crate::query::{FirstRow, FirstStop, ImageWish, MapLimits, MapPixel, SessionPart, ValueName};
use crate::recording::{
    ImportJob, NewImport, RecordingList, RecordingPath, RecordingView, UploadPath, UploadView,
};
use crate::wire::{
    Designated, Login, NewDrive, NewRun, NewSession, NewTarget, NewTraverse, RerunStream, SessionEntry,
    StopDetail, StopOdometry, TargetLabel, TraverseEntry, TraverseView,
};

/// Declares a type for each endpoint, and the list of all of them.
macro_rules! endpoints {
    ($($(#[$doc:meta])* $name:ident: $method:ident $path:literal, $at:ty $(, query $query:ty)? $(, body $body:ty)?
        => $reply:ty;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug)]
            pub struct $name;

            impl Endpoint for $name {
                const METHOD: Method = Method::$method;
                const PATH: &'static str = $path;
                type At = $at;
                type Query = endpoints!(@or NoQuery $(, $query)?);
                type Body = endpoints!(@or NoBody $(, $body)?);
                type Reply = $reply;
            }
        )*

        /// Method and path of every endpoint.
        pub const ALL: &[(Method, &str)] = &[$(($name::METHOD, $name::PATH)),*];
    };
    (@or $default:ty) => { $default };
    (@or $default:ty, $given:ty) => { $given };
}

/// The paths of the endpoints that create something: a request with the header `Idempotency-Key` can be repeated without
/// creating it twice.
pub const CREATING: &[&str] = &[
    AddTraverse::PATH,
    BeginSession::PATH,
    BringSession::PATH,
    DesignateTarget::PATH,
    ForkRun::PATH,
    BeginDrive::PATH,
    AddNote::PATH,
    AddBreakpoint::PATH,
    StartStudy::PATH,
    StartImport::PATH,
    BeginUpload::PATH,
];

endpoints! {
    /// Name, version and limits of the server program.
    ShowVersion: Get "/version", Anywhere => Version;
    /// The health and resource usage of the server.
    ShowHealth: Get "/health", Anywhere => Health;
    /// The OpenAPI document.
    ShowOpenApi: Get "/openapi.json", Anywhere => Value;
    /// Exchanges the access token for a cookie.
    LogIn: Post "/login", Anywhere, body Login => Done;
    /// The WebSocket of events; not called as a request.
    ListenToEvents: Get "/events", Anywhere => Event;
    /// The table of settings.
    ListSettings: Get "/settings", Anywhere => Vec<SettingInfo>;

    /// The open traverses.
    ListTraverses: Get "/traverses", Anywhere => Vec<TraverseEntry>;
    /// Opens a simulated drive by its scenario.
    AddTraverse: Post "/traverses", Anywhere, body NewTraverse => TraverseEntry;
    /// A traverse with its stops.
    ShowTraverse: Get "/traverses/{id}", AtTraverse => TraverseView;
    /// Removes a drive that was opened by its scenario, with its images.
    RemoveTraverse: Delete "/traverses/{id}", AtTraverse => Done;
    /// A stop with its cameras.
    ShowStop: Get "/traverses/{id}/steps/{step}", AtStop => StopDetail;
    /// An image of a stop as PNG.
    ShowImage: Get "/traverses/{id}/steps/{step}/images/{file}", AtImage, query ImageWish => File;
    /// The motion to a stop as measured by visual odometry, with its corners.
    ShowStopOdometry: Get "/traverses/{id}/steps/{step}/odometry", AtStop => StopOdometry;
    /// Renders the images of the stops from this one on before those of all others.
    Prefetch: Post "/traverses/{id}/prefetch", AtTraverse, query FirstStop => Done;
    /// The trackability map of a stop's left image, as far as it is computed.
    ShowTrackability: Get "/traverses/{id}/steps/{step}/trackability", AtStop, query MapLimits => MapProgress;
    /// The trackability verdict at one pixel.
    ShowTrackabilityAtPixel: Get "/traverses/{id}/steps/{step}/trackability/pixel", AtStop, query MapPixel
        => PixelVerdict;
    /// Cancels the computation of a trackability map.
    CancelTrackability: Post "/traverses/{id}/steps/{step}/trackability/cancel", AtStop, query MapLimits => Done;

    /// The recordings below the folders given when the server was started.
    ListRecordings: Get "/recordings", Anywhere => RecordingList;
    /// The contents of a recording.
    ShowRecording: Get "/recordings/contents", Anywhere, query RecordingPath => RecordingView;
    /// Begins the upload of a recording.
    BeginUpload: Post "/uploads", Anywhere => UploadView;
    /// Uploads a file of a recording; the body is the file.
    SendFile: Put "/uploads/{upload}/files", AtUpload, query UploadPath => UploadView;
    /// Uploads a recording as one zip archive; the body is the archive.
    SendArchive: Put "/uploads/{upload}/archive", AtUpload => UploadView;
    /// Removes an uploaded recording.
    RemoveUpload: Delete "/uploads/{upload}", AtUpload => Done;
    /// Imports a recording as a drive.
    StartImport: Post "/imports", Anywhere, body NewImport => ImportJob;
    /// The state and progress of an import.
    ShowImport: Get "/imports/{import}", AtImport => ImportJob;
    /// Cancels an import.
    CancelImport: Post "/imports/{import}/cancel", AtImport => ImportJob;

    /// The sessions on open traverses.
    ListSessions: Get "/sessions", Anywhere => Vec<SessionEntry>;
    /// Begins a session.
    BeginSession: Post "/sessions", Anywhere, body NewSession => SessionView;
    /// Begins a session from an exported `reproduce.json`.
    BringSession: Post "/sessions/reproduced", Anywhere, body Reproduction => SessionView;
    /// A session with its targets and runs.
    ShowSession: Get "/sessions/{session}", AtSession => SessionView;
    /// Removes a session.
    RemoveSession: Delete "/sessions/{session}", AtSession => Done;
    /// Restores a removed session.
    RestoreSession: Post "/sessions/{session}/restore", AtSession => SessionView;
    /// The cursor of a session.
    ShowCursor: Get "/sessions/{session}/cursor", AtSession => Cursor;
    /// Moves the cursor.
    MoveCursor: Put "/sessions/{session}/cursor", AtSession, body Cursor => Cursor;
    /// The drive of a session: the driving run, its command, the decisions and the outcome so far.
    ShowDrive: Get "/sessions/{session}/drive", AtSession => DriveView;
    /// Sets the run that drives, and its command.
    SteerDrive: Put "/sessions/{session}/drive", AtSession, body Steering => DriveView;
    /// The goodness map at a stop of the drive of a session.
    ShowHazards: Get "/sessions/{session}/drive/steps/{step}/hazards", AtDriveStop => HazardView;
    /// Opens the live Rerun stream of a session.
    StreamRecording: Post "/sessions/{session}/rerun", AtSession => RerunStream;
    /// Closes the live Rerun stream of a session.
    CloseRecording: Delete "/sessions/{session}/rerun", AtSession => Done;
    /// The live Rerun stream: an endless recording that grows with the session.
    ReadRecording: Get "/sessions/{session}/rerun/live.rrd", AtSession => File;
    /// A file of Rerun's web viewer.
    ShowRerunViewer: Get "/rerun/{file}", AtViewerFile => File;
    /// The files to which a session can be exported.
    ListExports: Get "/sessions/{session}/exports", AtSession, query SessionPart => Vec<ExportEntry>;
    /// A session, or a part of it, as a file.
    ExportFile: Get "/sessions/{session}/exports/{file}", AtExport, query SessionPart => File;
    /// A plain page with all sessions.
    ShowSessionsPage: Get "/page", Anywhere => File;
    /// A plain page of a session.
    ShowSessionPage: Get "/sessions/{session}/page", AtSession => File;

    /// Designates a target.
    DesignateTarget: Post "/sessions/{session}/targets", AtSession, body NewTarget => Designated;
    /// Renames a target.
    RenameTarget: Put "/sessions/{session}/targets/{target}/label", AtTarget, body TargetLabel => SessionView;
    /// Removes a target.
    RemoveTarget: Delete "/sessions/{session}/targets/{target}", AtTarget => SessionView;
    /// Restores a removed target.
    RestoreTarget: Post "/sessions/{session}/targets/{target}/restore", AtTarget => SessionView;

    /// Runs a target again from a step with changed settings.
    ForkRun: Post "/sessions/{session}/targets/{target}/runs", AtTarget, body NewRun => RunView;
    /// A run with its steps so far.
    ShowRun: Get "/sessions/{session}/targets/{target}/runs/{run}", AtRun, query FirstRow => RunView;
    /// Removes a run.
    RemoveRun: Delete "/sessions/{session}/targets/{target}/runs/{run}", AtRun => SessionView;
    /// Restores a removed run.
    RestoreRun: Post "/sessions/{session}/targets/{target}/runs/{run}/restore", AtRun => SessionView;
    /// Stops a run.
    CancelRun: Post "/sessions/{session}/targets/{target}/runs/{run}/cancel", AtRun => RunView;
    /// Resumes a stopped run.
    ResumeRun: Post "/sessions/{session}/targets/{target}/runs/{run}/resume", AtRun => RunView;
    /// Begins a drive on commands that a run steers, in a world of its own.
    BeginDrive: Post "/sessions/{session}/targets/{target}/runs/{run}/drive", AtRun, body NewDrive => SessionView;
    /// The metrics of a run.
    ShowMetrics: Get "/sessions/{session}/targets/{target}/runs/{run}/metrics", AtRun => RunMetrics;
    /// The target's brightness over a run as CSV.
    ShowPhotometry: Get "/sessions/{session}/targets/{target}/runs/{run}/photometry.csv", AtRun => File;
    /// Compares two to four runs of a session.
    CompareRuns: Post "/sessions/{session}/compare", AtSession, body NewComparison => Comparison;

    /// A step.
    ShowStep: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}", AtStep => RunStep;
    /// The times of the stages of a step: modelled on Mars, and measured on this machine.
    ShowTimes: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/times", AtStep => Vec<StageTime>;
    /// All arrays of a step as one NumPy archive.
    ShowArrays: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/arrays.npz", AtStep => File;
    /// The match of a step's image with each earlier template of its run.
    ShowEarlierTemplates: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/earlier_templates", AtStep
        => Vec<AgainstEarlier>;
    /// A plain page of a step.
    ShowStepPage: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/page", AtStep => File;
    /// The explanation of a value of a step: its inputs, formula and settings.
    ShowWhy: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/why", AtStep, query ValueName
        => Explanation;
    /// Tries a step with changed settings or a displaced prediction.
    TryStep: Post "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/what_if", AtStep, body WhatIf
        => Ghost;
    /// The counterfactual of a step as far as it is computed: the smallest changes with which it would have been accepted.
    ShowCounterfactual: Get "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual", AtStep
        => Question;
    /// Starts the search for the smallest changes with which a step would have been accepted.
    AskCounterfactual: Post "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual", AtStep
        => Question;
    /// Cancels that search.
    CancelCounterfactual: Post
        "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual/cancel", AtStep => Question;

    /// The notes of a session.
    ListNotes: Get "/sessions/{session}/notes", AtSession => Vec<Note>;
    /// Pins a note.
    AddNote: Post "/sessions/{session}/notes", AtSession, body NewNote => Note;
    /// A note.
    ShowNote: Get "/sessions/{session}/notes/{note}", AtNote => Note;
    /// Changes a note if its revision is still the one that was read.
    ChangeNote: Patch "/sessions/{session}/notes/{note}", AtNote, body EditNote => Note;
    /// Removes a note if its revision is still the one that was read.
    RemoveNote: Delete "/sessions/{session}/notes/{note}", AtNote => Done;
    /// Restores a removed note.
    RestoreNote: Post "/sessions/{session}/notes/{note}/restore", AtNote => Note;

    /// The breakpoints of a session.
    ListBreakpoints: Get "/sessions/{session}/breakpoints", AtSession => Vec<BreakpointView>;
    /// Sets a breakpoint.
    AddBreakpoint: Post "/sessions/{session}/breakpoints", AtSession, body NewBreakpoint => BreakpointView;
    /// Changes a breakpoint.
    ChangeBreakpoint: Patch "/sessions/{session}/breakpoints/{breakpoint}", AtBreakpoint, body BreakpointChange
        => BreakpointView;
    /// Removes a breakpoint.
    RemoveBreakpoint: Delete "/sessions/{session}/breakpoints/{breakpoint}", AtBreakpoint => Done;
    /// The functions and names of the expression language.
    ShowExpressions: Get "/expressions", Anywhere => Language;
    /// The completions at a position of an expression.
    CompleteExpression: Post "/expressions/complete", Anywhere, body CompletionQuery => Completion;
    /// Evaluates an expression at every step of every run.
    QuerySession: Post "/sessions/{session}/query", AtSession, body Query => QueryAnswer;

    /// All documents, by name.
    ListDocuments: Get "/documents", Anywhere => Vec<Document>;
    /// A document.
    ShowDocument: Get "/documents/{name}", AtDocument => Document;
    /// Replaces a document, or adds one.
    PutDocument: Put "/documents/{name}", AtDocument, body Value => Document;
    /// Removes a document.
    RemoveDocument: Delete "/documents/{name}", AtDocument => Done;

    /// The studies that can be started.
    ListStudies: Get "/studies", Anywhere => Vec<StudyInfo>;
    /// The study jobs: studies that were started.
    ListStudyJobs: Get "/studies/jobs", Anywhere => Vec<StudyJob>;
    /// Starts a study.
    StartStudy: Post "/studies/jobs", Anywhere, body NewStudy => StudyJob;
    /// The state of a study job.
    ShowStudyJob: Get "/studies/jobs/{job}", AtStudyJob => StudyJob;
    /// Stops a study.
    CancelStudy: Post "/studies/jobs/{job}/cancel", AtStudyJob => StudyJob;
    /// Resumes a stopped study.
    ResumeStudy: Post "/studies/jobs/{job}/resume", AtStudyJob => StudyJob;
    /// The table of a study, as far as it is computed.
    ShowStudyRows: Get "/studies/jobs/{job}/rows", AtStudyJob => StudyRows;
    /// The report of a study that is done.
    ShowStudyReport: Get "/studies/jobs/{job}/report.html", AtStudyJob => File;
}
