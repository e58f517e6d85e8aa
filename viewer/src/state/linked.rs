//! Converts the state to the fragment of the page's address, and a fragment to a state.

use sightline_session::compare::RunName;

use crate::compare;
use crate::drawing::view2d::View2d;
use crate::page::link::Fragment;
use crate::state::State;
use crate::state::run_letter;

impl State {
    /// The link to the current view, without the layout of the panels.
    pub fn fragment(&self) -> Fragment {
        let at = |view: View2d| Some(view).filter(|view| *view != View2d::Fit);
        let Some(session) = &self.session else { return Fragment::default() };
        Fragment {
            session: Some(session.id.clone()),
            target: self.cursor.target,
            run: self.cursor.target.map(|_| self.cursor.run),
            step: Some(self.cursor.step),
            stage: Some(self.stage()),
            camera: self.camera_to_link(),
            others: self.compare.others.clone(),
            compared: Some(self.compare.view)
                .filter(|view| self.is_comparing() && *view != compare::View::Marks),
            sort: Some(self.compare.sort.clone()).filter(|sort| sort.metric.is_some()),
            filter: Some(self.compare.filter.trim().to_owned()).filter(|words| !words.is_empty()),
            left: at(self.views.left),
            right: at(self.views.right),
            ..Fragment::default()
        }
    }

    /// Follows a link: at once if its session is open, otherwise once it is loaded.
    pub(crate) fn open_link(&mut self, link: Fragment) {
        for part in &link.damaged {
            self.messages.problem(
                format!("A part of the link cannot be read and was left out: `{}`.", shown(part)),
                Some("Copy the whole link again with Y.".to_owned()),
            );
        }
        let is_open = self.session.as_ref().map(|session| &session.id) == link.session.as_ref();
        match link.session.clone() {
            Some(id) if !is_open => {
                self.sync.linked = Some(id.clone());
                self.read_session(id);
            }
            _ => {}
        }
        self.sync.link = Some(link);
        if is_open {
            self.follow_link();
            self.keep_cursor_valid();
        }
    }

    /// Applies the link once its session is loaded.
    pub(crate) fn follow_link(&mut self) {
        let Some(session) = &self.session else { return };
        let is_for_this = |link: &mut Fragment| link.session.as_ref() == Some(&session.id);
        let Some(link) = self.sync.link.take_if(is_for_this) else { return };
        let target = link.target.and_then(|number| session.targets.iter().find(|t| t.number == number));
        let is_run_there =
            link.run.is_none_or(|run| target.is_none_or(|t| t.runs.iter().any(|r| r.number == run)));
        if link.target.is_some() && target.is_none() {
            let words = "The link names a target that this session no longer has; another one is shown.";
            self.messages.problem(words, None);
        } else if !is_run_there {
            let letter = run_letter(link.run.unwrap_or_default());
            let words =
                format!("The link names run {letter}, which this target does not have; run A is shown.");
            self.messages.problem(words, Some("Run it again from its step with its settings.".to_owned()));
        }
        if let Some(number) = target.map(|target| target.number) {
            self.cursor.target = Some(number);
            self.cursor.run = link.run.filter(|_| is_run_there).unwrap_or(0);
        }
        let last = session.stop_count.saturating_sub(1);
        if let Some(step) = link.step {
            if step > last {
                self.messages.problem(format!("The link names step {step}; the last one is {last}."), None);
            }
            self.cursor.step = step.min(last);
        }
        let is_there = |name: &RunName| {
            let target = session.targets.iter().find(|target| target.number == name.target);
            target.is_some_and(|target| target.runs.iter().any(|run| run.number == name.run))
        };
        let (others, missing): (Vec<RunName>, Vec<RunName>) =
            link.others.iter().partition(|name| is_there(name));
        for name in missing {
            let letter = run_letter(name.run);
            self.messages.problem(format!("The link compares with run {letter}, which is not there."), None);
        }
        self.compare.others = others;
        self.compare.view = link.compared.unwrap_or_default();
        self.compare.sort = link.sort.unwrap_or_default();
        // A trailing blank is still being typed and is not part of the address.
        let filter = link.filter.unwrap_or_default();
        if self.compare.filter.trim() != filter {
            self.compare.filter = filter;
        }
        self.stage = link.stage.unwrap_or(self.stage);
        self.keep_cursor_valid();
        self.chosen_camera = None;
        if let Some(camera) = link.camera {
            self.choose_camera(camera);
        }
        self.views.left = link.left.unwrap_or(View2d::Fit);
        self.views.right = link.right.unwrap_or(View2d::Fit);
    }
}

/// A part of a link for display: shortened, without control characters.
fn shown(part: &str) -> String {
    part.chars().filter(|c| !c.is_control()).take(60).collect()
}
