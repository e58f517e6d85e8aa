//! Consistency of the covariances of a run: NEES and NIS with their chi-square bands, coverage, and one sentence.
//!
//! ```text
//! NEES = eᵀ P⁻¹ e     e: error of the position, P: its covariance              χ² with 3 degrees of freedom
//! NIS  = νᵀ S⁻¹ ν     ν = match − prediction, px;  S = Σ_pred + Σ_match        χ² with 2
//! band of the mean over N steps: [χ²_dN(2.5 %), χ²_dN(97.5 %)] / N
//! ```
//! NEES needs the truth; NIS does not, so a rover can monitor it. NIS is over accepted updates of the template tracker; the
//! other trackers move the earlier position and have no match that is independent of the prediction. The covariances of
//! prediction and match share the drift of the template, so a mean NIS below 2 alone is not a fault.
//!
//! The steps of one run are correlated through the error of the template. The band for N independent steps is the narrowest
//! possible one, that of a single value the widest. A mean between the two is reported as `probably` too small or too large.
//!
//! Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), 5.4.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use utoipa::ToSchema;

use super::Metric;
use crate::step::RunStep;
use sightline_track::target::TrackingState;

/// Degrees of freedom of a 3-D position.
const OF_POSITION: f64 = 3.0;
/// Degrees of freedom of a pixel.
const OF_PIXEL: f64 = 2.0;

/// The Mahalanobis distances for which the coverage is computed.
const SIGMAS: [f64; 8] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0];

const NO_NEES: &str = "NEES needs the truth, which this traverse does not have.";
const NO_NIS: &str =
    "NIS needs a match that is independent of the prediction: only the template tracker has one.";

/// The consistency of the covariances of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Uncertainty {
    /// Squared Mahalanobis distance of the position's error, step by step.
    pub nees: Consistency,
    /// Squared Mahalanobis distance of the match from the prediction, step by step.
    pub nis: Consistency,
    /// The fraction of steps within k standard deviations, with the expected fraction.
    pub coverage: Vec<Coverage>,
    /// The verdict on the covariances of the position.
    pub sentence: String,
    /// The verdict on the innovations.
    pub nis_sentence: String,
}

/// Squared Mahalanobis distances with their bands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Consistency {
    /// Degrees of freedom; the expected mean.
    pub degrees_of_freedom: f64,
    /// The steps with a value.
    pub steps: Vec<StepValue>,
    /// The 95 % band of a single value.
    pub band_of_one: [f64; 2],
    /// The mean; null without values.
    pub mean: Option<f64>,
    /// The 95 % band of the mean for independent steps; null without values.
    pub band_of_mean: Option<[f64; 2]>,
}

/// A value at a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepValue {
    /// The step.
    pub step: usize,
    /// The value.
    pub value: f64,
}

/// The fraction of errors within a Mahalanobis distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Coverage {
    /// The Mahalanobis distance.
    pub sigmas: f64,
    /// The fraction of steps within it.
    pub share: f64,
    /// The fraction expected for correct covariances.
    pub expected: f64,
}

/// The consistency over the evaluated steps.
pub(super) fn uncertainty<'a>(steps: impl Iterator<Item = &'a RunStep>) -> Uncertainty {
    let (mut errors, mut innovations) = (Vec::new(), Vec::new());
    for trace in steps {
        let value = |value: f64| StepValue { step: trace.step, value };
        errors.extend(trace.truth.as_ref().and_then(|truth| truth.nees).map(value));
        innovations.extend(nis(trace).map(value));
    }
    let (nees, nis) = (Consistency::of(OF_POSITION, errors), Consistency::of(OF_PIXEL, innovations));
    let sentence = nees.sentence("covariance", "NEES").unwrap_or_else(|| NO_NEES.to_owned());
    let nis_sentence = nis.sentence("innovation covariance", "NIS").unwrap_or_else(|| NO_NIS.to_owned());
    Uncertainty { coverage: coverage(&nees), nees, nis, sentence, nis_sentence }
}

/// The squared Mahalanobis distance of an accepted match from its prediction; `None` for other steps and trackers.
pub fn nis(trace: &RunStep) -> Option<f64> {
    if trace.update.state != TrackingState::Tracking {
        return None;
    }
    trace.prediction()?;
    let pointing = &trace.point_mast;
    let (predicted, covariance) = (pointing.predicted_left?, pointing.predicted_covariance_px2?);
    let matched = trace.template()?.match_template.as_ref()?;
    let innovation = Vector2::new(matched.pixel.x - predicted.x, matched.pixel.y - predicted.y);
    let inverse = (covariance + matched.covariance_px2).try_inverse()?;
    Some(innovation.dot(&(inverse * innovation))).filter(|value| value.is_finite())
}

/// The two-sided 95 % band of the mean of `count` independent values, each with these degrees of freedom.
pub fn band(degrees_of_freedom: f64, count: usize) -> Option<[f64; 2]> {
    let chi_squared = ChiSquared::new(degrees_of_freedom * count as f64).ok()?;
    Some([0.025, 0.975].map(|p| chi_squared.inverse_cdf(p) / count as f64))
}

impl Consistency {
    fn of(degrees_of_freedom: f64, steps: Vec<StepValue>) -> Self {
        let count = steps.len();
        let mean = (count > 0).then(|| steps.iter().map(|step| step.value).sum::<f64>() / count as f64);
        Self {
            degrees_of_freedom,
            band_of_one: band(degrees_of_freedom, 1).unwrap_or_default(),
            mean,
            band_of_mean: mean.and_then(|_| band(degrees_of_freedom, count)),
            steps,
        }
    }

    /// The step with the largest value.
    pub fn worst(&self) -> Option<usize> {
        self.steps.iter().max_by(|a, b| a.value.total_cmp(&b.value)).map(|step| step.step)
    }

    /// The verdict; `None` without values.
    fn sentence(&self, what: &str, name: &str) -> Option<String> {
        let (mean, [low, high]) = self.mean.zip(self.band_of_mean)?;
        let count = self.steps.len();
        let [least, most] = self.band_of_one;
        let verdict = match mean {
            mean if mean > most => "too small",
            mean if mean > high => "probably too small",
            mean if mean < least => "too large",
            mean if mean < low => "probably too large",
            _ => "about right",
        };
        let steps = if count == 1 { "1 step".to_owned() } else { format!("{count} steps") };
        Some(format!("{what} {verdict}: mean {name} {mean:.1}, band {low:.1} to {high:.1} for {steps}"))
    }
}

fn coverage(nees: &Consistency) -> Vec<Coverage> {
    let count = nees.steps.len() as f64;
    let chi_squared = ChiSquared::new(nees.degrees_of_freedom).ok();
    let of = |sigmas: f64| {
        let inside = nees.steps.iter().filter(|step| step.value <= sigmas * sigmas).count() as f64;
        let expected = chi_squared.as_ref()?.cdf(sigmas * sigmas);
        (count > 0.0).then_some(Coverage { sigmas, share: inside / count, expected })
    };
    SIGMAS.into_iter().filter_map(of).collect()
}

impl Uncertainty {
    /// Its metrics.
    pub(super) fn metrics(&self) -> [Metric; 3] {
        let of = |name: &str, found: &Consistency, value: Option<f64>, sentence: &str| {
            let worst = value.and_then(|_| found.worst());
            Metric::new(name, "", value, found.steps.len(), worst).with_note(Some(sentence.to_owned()))
        };
        let inside =
            self.coverage.iter().find(|coverage| coverage.sigmas == 3.0).map(|coverage| coverage.share);
        let expected = match inside {
            Some(_) => "97.1 % where the covariances are right.",
            None => NO_NEES,
        };
        [
            of("mean_nees", &self.nees, self.nees.mean, &self.sentence),
            of("inside_3_sigma", &self.nees, inside, expected),
            of("mean_nis", &self.nis, self.nis.mean, &self.nis_sentence),
        ]
    }
}
