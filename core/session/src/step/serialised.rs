//! The serialised form of a step: one flat record in which a stage that was not reached is null.

use std::borrow::Cow;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::Schema;
use utoipa::{PartialSchema, ToSchema};

use super::RunStep;
use crate::times::Took;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::Located;
use sightline_track::stages::capture::Capture;
use sightline_track::stages::point_mast::Pointing;
use sightline_track::stages::prediction::Prediction;
use sightline_track::stages::update::Updated;
use sightline_track::trace::{StepKind, StepTrace};
use sightline_track::verdict::Verdict;
use sightline_world::target_truth::StepTruth;

/// One step of a run. A designation has no `predict` and no `judge`; a stop with damaged files has a `fault` and no stages
/// after `point_mast`. At a stop where a drive is paused, `begun` names the first stage that is not computed; this and the
/// later stages are null.
#[derive(Serialize, Deserialize, ToSchema)]
#[schema(as = StepTrace)]
struct SerialisedStep<'a> {
    /// The stop, from 0.
    step: usize,
    /// Time since the first stop, s.
    time_s: f64,
    /// The fault of the stop's files, as one sentence; null without a fault.
    fault: Option<Cow<'a, str>>,
    /// Whether the mast is pointed at another target and this one is out of view; left out where it is not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    out_of_view: bool,
    /// Stage 1.
    predict: Option<Cow<'a, Prediction>>,
    /// Stage 2.
    point_mast: Option<Cow<'a, Pointing>>,
    /// Stage 3.
    capture: Option<Cow<'a, Capture>>,
    /// Stage 4.
    locate: Option<Cow<'a, Located>>,
    /// Stage 5.
    judge: Option<Cow<'a, Verdict>>,
    /// Stage 6.
    update: Option<Cow<'a, Updated>>,
    /// The step of a paused drive; left out of any other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    begun: Option<SerialisedBegun<'a>>,
    /// How vision measured the motion to this stop; left out where it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    odometry: Option<Cow<'a, MeasuredMotion>>,
    /// The comparison with the truth; null if the truth is unknown.
    truth: Option<Cow<'a, StepTruth>>,
}

/// A step of a paused drive: its pause, and the values in place of stages that are not computed.
#[derive(Serialize, Deserialize, ToSchema)]
#[schema(as = BegunStep)]
struct SerialisedBegun<'a> {
    /// The first stage that is not computed.
    before: CycleStage,
    /// The cameras at the current mast angles; null once the mast is pointed.
    mast: Option<Cow<'a, Pointing>>,
    /// The target propagated by the prediction, with the last tracking state.
    carried: Cow<'a, Updated>,
}

impl<'a> From<&'a RunStep> for SerialisedStep<'a> {
    fn from(RunStep { trace, truth, odometry, .. }: &'a RunStep) -> Self {
        Self {
            step: trace.step,
            time_s: trace.time_s,
            fault: trace.fault().map(Cow::Borrowed),
            out_of_view: trace.is_out_of_view(),
            predict: trace.prediction().map(Cow::Borrowed),
            point_mast: trace.pointing().map(Cow::Borrowed),
            capture: trace.capture().map(Cow::Borrowed),
            locate: trace.located().map(Cow::Borrowed),
            judge: trace.verdict().map(Cow::Borrowed),
            update: trace.updated().map(Cow::Borrowed),
            begun: trace.paused_before().map(|before| SerialisedBegun {
                before,
                mast: trace.pointing().is_none().then_some(Cow::Borrowed(&trace.point_mast)),
                carried: Cow::Borrowed(&trace.update),
            }),
            odometry: odometry.as_deref().map(Cow::Borrowed),
            truth: truth.as_ref().map(Cow::Borrowed),
        }
    }
}

impl SerialisedStep<'_> {
    /// The step; `None` if its stages do not form a valid kind of step.
    fn into_step(self) -> Option<RunStep> {
        let fault = self.fault.map(Cow::into_owned);
        let (predict, capture) = (self.predict.map(Cow::into_owned), self.capture.map(Cow::into_owned));
        let (locate, judge) = (self.locate.map(Cow::into_owned), self.judge.map(Cow::into_owned));
        let (point_mast, update) = (self.point_mast.map(Cow::into_owned), self.update.map(Cow::into_owned));
        let (step, time_s, truth) = (self.step, self.time_s, self.truth.map(Cow::into_owned));
        let odometry = self.odometry.map(|measured| Box::new(measured.into_owned()));
        if let Some(SerialisedBegun { before, mast, carried }) = self.begun {
            let (predict, is_mast_pointed) = (predict?, point_mast.is_some());
            let point_mast = point_mast.or(mast.map(Cow::into_owned))?;
            let kind = StepKind::Begun { predict, is_mast_pointed, capture, locate, judge };
            let trace = StepTrace { step, time_s, point_mast, kind, update: carried.into_owned() };
            let is_prefix = trace.paused_before() == Some(before) && update.is_none() && fault.is_none();
            return is_prefix.then(|| RunStep { trace, truth, odometry, took: Took::default() });
        }
        let kind = match (predict, capture, locate, judge, fault) {
            (None, Some(capture), Some(locate), None, None) => StepKind::Designation { capture, locate },
            (Some(predict), Some(capture), Some(locate), Some(judge), None) => {
                StepKind::Tracked { predict, capture, locate, judge }
            }
            (Some(predict), None, None, None, None) if self.out_of_view => StepKind::OutOfView { predict },
            (Some(predict), None, None, None, None) => StepKind::OdometryAlone { predict },
            (Some(predict), None, None, None, Some(fault)) => StepKind::Damaged { predict, fault },
            _ => return None,
        };
        let trace = StepTrace { step, time_s, point_mast: point_mast?, kind, update: update? };
        Some(RunStep { trace, truth, odometry, took: Took::default() })
    }
}

impl Serialize for RunStep {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        SerialisedStep::from(self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for RunStep {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let step = SerialisedStep::deserialize(deserializer)?;
        step.into_step()
            .ok_or_else(|| de::Error::custom("the stages of the step are those of no kind of step"))
    }
}

impl PartialSchema for RunStep {
    fn schema() -> RefOr<Schema> {
        SerialisedStep::schema()
    }
}

impl ToSchema for RunStep {
    fn name() -> Cow<'static, str> {
        SerialisedStep::name()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        SerialisedStep::schemas(schemas);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use serde_json::{Value, json};

    use super::*;
    use sightline_geometry::frames::{Pixel, Point3, Pose};
    use sightline_testing::PlaneWorld;
    use sightline_track::locate::TrackerMemory;
    use sightline_track::locate::features::anchor::Anchors;
    use sightline_track::stages::point_mast::{UsedPointing, point_mast};
    use sightline_track::target::{Designation, Target, TrackingState};

    fn step(kind: StepKind) -> RunStep {
        let position = Point3::new(5.0, 0.0, 0.0);
        let covariance = Matrix3::identity() * 1e-4;
        let world = PlaneWorld::new(vec![Pose::identity()]);
        let used =
            UsedPointing { mast: None, angles: None, error_rad: 0.0, left: &world.left, right: &world.right };
        let target = Target {
            designation: Designation::new(0, Pixel::new(1.0, 2.0)),
            step: 3,
            position_in_rover: position,
            covariance_in_rover: covariance,
            initial_position_in_site: position,
            initial_distance_m: 5.0,
            travelled_m: 0.0,
            last_distance_m: 5.0,
            travelled_since_update_m: 0.0,
            memory: TrackerMemory::Features(Anchors::default()),
        };
        let state = TrackingState::Tracking;
        let update =
            Updated { target, state, template_renewed: false, correction_m: None, correction_px: None };
        let point_mast = point_mast(&position, &covariance, used);
        RunStep {
            trace: StepTrace { step: 3, time_s: 60.0, point_mast, kind, update },
            truth: None,
            odometry: None,
            took: Took::default(),
        }
    }

    fn kinds() -> [StepKind; 7] {
        let predict = Prediction {
            position_in_rover: Point3::new(5.0, 0.0, 0.0),
            position_in_site: Point3::new(5.0, 0.0, 0.0),
            covariance_in_rover: Matrix3::identity(),
            step_length_m: 1.0,
            travelled_since_update_m: 1.0,
            travelled_m: 1.0,
        };
        let capture = Capture {
            left_size: [256, 256],
            right_size: [256, 256],
            subframe: None,
            subframe_mean: None,
            subframe_saturated: None,
            pair: Default::default(),
        };
        let judge = Verdict {
            gates: Vec::new(),
            good: true,
            accepted: true,
            reason: None,
            state_before: TrackingState::Tracking,
            state: TrackingState::Tracking,
        };
        let locate = Located::default();
        let begun = |is_mast_pointed, capture| {
            let predict = predict.clone();
            StepKind::Begun { predict, is_mast_pointed, capture, locate: None, judge: None }
        };
        [
            StepKind::Designation { capture: capture.clone(), locate: locate.clone() },
            StepKind::Tracked { predict: predict.clone(), capture: capture.clone(), locate, judge },
            begun(false, None),
            begun(true, Some(capture)),
            StepKind::OutOfView { predict: predict.clone() },
            StepKind::OdometryAlone { predict: predict.clone() },
            StepKind::Damaged { predict, fault: "left_0003.png is missing".to_owned() },
        ]
    }

    #[test]
    fn each_kind_of_step_has_all_fields_and_is_read_back() {
        let reached = [
            vec!["point_mast", "capture", "locate"],
            vec!["predict", "point_mast", "capture", "locate", "judge"],
            vec!["begun", "predict"],
            vec!["begun", "predict", "point_mast", "capture"],
            vec!["out_of_view", "predict", "point_mast"],
            vec!["predict", "point_mast"],
            vec!["fault", "predict", "point_mast"],
        ];
        for (kind, reached) in kinds().into_iter().zip(reached) {
            let step = step(kind);
            let value = serde_json::to_value(&step).unwrap();
            let is_begun = reached.contains(&"begun");
            let further = usize::from(is_begun) + usize::from(reached.contains(&"out_of_view"));
            assert_eq!(value.as_object().unwrap().len(), 10 + further);
            assert_eq!(value["update"].is_null(), is_begun);
            for stage in ["fault", "predict", "point_mast", "capture", "locate", "judge"] {
                assert_eq!(value[stage].is_null(), !reached.contains(&stage), "{stage}");
            }
            assert_eq!(serde_json::from_value::<RunStep>(value).unwrap(), step);
        }
    }

    #[test]
    fn stages_of_no_kind_of_step_are_refused() {
        let [_, tracked, ..] = kinds().map(|kind| serde_json::to_value(step(kind)).unwrap());
        for stage in ["predict", "point_mast", "capture", "locate", "judge"] {
            let mut without = tracked.clone();
            without[stage] = Value::Null;
            let error = serde_json::from_value::<RunStep>(without).unwrap_err();
            assert!(error.to_string().contains("no kind of step"), "{stage}: {error}");
        }
        let [.., begun, _, _, _] = kinds().map(|kind| serde_json::to_value(step(kind)).unwrap());
        for (field, value) in
            [("before", json!("judge")), ("before", json!("capture")), ("carried", Value::Null)]
        {
            let mut wrong = begun.clone();
            wrong["begun"][field] = value;
            assert!(serde_json::from_value::<RunStep>(wrong).is_err(), "{field}");
        }
    }
}
