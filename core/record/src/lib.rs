//! Self-describing records: a stage declares its quantities, arrays and gates once, beside its evidence.
//!
//! ```text
//! impl Record for Evidence ──► Stage<Step> ──► StageSchema   names, units, formulas     once per run
//!                                         └──► StageRecord   plain values               once per step
//! ```
//! Tables, comparisons, expressions, plots, explanations, logs and pages are views of schemas and records. They do not
//! depend on evidence types, so records of an external tracker that sends its schema are displayed in the same way.
//!
//! ```
//! use sightline_record::{Declaration, Record, Stage, Unit};
//!
//! #[derive(serde::Serialize)]
//! struct Match { score: f64, shift_px: Option<f64> }
//!
//! impl Record for Match {
//!     fn declare(r: &mut Declaration<Self>) {
//!         r.quantity("score", Unit::One, |m| m.score).describe("Normalised correlation at the match.");
//!         r.quantity("shift_px", Unit::Pixel, |m| m.shift_px).describe("Distance from the prediction.");
//!     }
//! }
//!
//! struct Step { matched: Option<Match> }
//! let stage = Stage::of("match", "Where does it fit best?", |step: &Step| step.matched.as_ref());
//! assert_eq!(stage.schema().quantities[1].unit.symbol(), "px");
//! let step = Step { matched: Some(Match { score: 0.9, shift_px: None }) };
//! assert_eq!(stage.record(&step).values[0].number(), Some(0.9));
//! ```

mod array;
mod column;
mod declare;
mod label;
mod schema;
mod stage;
mod unit;
mod unsent;
mod value;

pub use array::{ArrayDecl, ArrayKind, ArrayView};
pub use column::Column;
pub use declare::{Declaration, Record};
pub use label::{label, unit_label};
pub use schema::{GateDecl, GateRecord, Quantity, Side, StageRecord, StageSchema};
pub use stage::Stage;
pub use unit::Unit;
pub use unsent::Unsent;
pub use value::{Kind, Measured, Value};
