//! The builder of a declaration: an evidence type lists its quantities, arrays and gates.

use std::borrow::Cow;

use super::{
    ArrayDecl, ArrayKind, ArrayView, GateDecl, GateRecord, Measured, Quantity, Side, StageSchema, Unit,
    Value, label,
};

/// Evidence that declares its quantities, arrays and gates.
pub trait Record: Sized + 'static {
    /// Declares the quantities, arrays and gates, with the functions that read them from an instance.
    fn declare(r: &mut Declaration<Self>);
}

type Get<E> = Box<dyn Fn(&E) -> Value + Send + Sync>;
type GetArray<E> = Box<dyn for<'a> Fn(&'a E) -> Option<ArrayView<'a>> + Send + Sync>;
type GetGates<E> = Box<dyn Fn(&E) -> Vec<GateRecord> + Send + Sync>;
type GetReason<E> = Box<dyn Fn(&E) -> Option<String> + Send + Sync>;

/// The declaration of an evidence type: its schema, and the functions that read each part from an instance.
pub struct Declaration<E> {
    pub(crate) schema: StageSchema,
    pub(crate) values: Vec<Get<E>>,
    pub(crate) arrays: Vec<GetArray<E>>,
    pub(crate) gates: Vec<GetGates<E>>,
    pub(crate) reason: Option<GetReason<E>>,
}

impl<E> Default for Declaration<E> {
    fn default() -> Self {
        Self {
            schema: StageSchema::default(),
            values: Vec::new(),
            arrays: Vec::new(),
            gates: Vec::new(),
            reason: None,
        }
    }
}

/// Adds the description, label and formula of a quantity.
pub struct Described<'a>(&'a mut Quantity);

impl Described<'_> {
    /// Sets the description, one sentence: the meaning, the frame, and when the value is missing.
    pub fn describe(self, description: &'static str) -> Self {
        self.0.description = description.into();
        self
    }

    /// Sets the name shown to people; the default is derived from the name.
    pub fn label(self, label: &'static str) -> Self {
        self.0.label = label.into();
        self
    }

    /// Sets the formula, and the quantities and settings that it uses.
    pub fn formula(self, formula: &'static str, inputs: &[&'static str]) -> Self {
        self.0.formula = formula.into();
        self.0.inputs = inputs.iter().map(|&input| Cow::Borrowed(input)).collect();
        self
    }
}

/// Adds the unit of an array.
pub struct DescribedArray<'a>(&'a mut ArrayDecl);

impl DescribedArray<'_> {
    /// Sets the unit of the values; the default is a pure number.
    pub fn unit(self, unit: Unit) {
        self.0.unit = unit;
    }
}

impl<E: 'static> Declaration<E> {
    /// Declares a quantity. The kind follows from the type of the value.
    pub fn quantity<V: Measured>(
        &mut self,
        name: &'static str,
        unit: Unit,
        get: impl Fn(&E) -> V + Send + Sync + 'static,
    ) -> Described<'_> {
        self.values.push(Box::new(move |evidence| get(evidence).value()));
        self.schema.quantities.push(Quantity {
            name: name.into(),
            label: label(name, unit).into(),
            unit,
            kind: V::KIND,
            description: Cow::default(),
            formula: Cow::default(),
            inputs: Vec::new(),
        });
        let last = self.schema.quantities.len() - 1;
        Described(&mut self.schema.quantities[last])
    }

    /// Declares the unit of a field of the evidence that is not a quantity: a list, or a part of a model.
    pub fn field(&mut self, name: impl Into<Cow<'static, str>>, unit: Unit) {
        self.schema.fields.push((name.into(), unit));
    }

    /// Declares an array; an empty view means that it is missing.
    pub fn array(
        &mut self,
        name: &'static str,
        kind: ArrayKind,
        description: &'static str,
        get: impl for<'a> Fn(&'a E) -> ArrayView<'a> + Send + Sync + 'static,
    ) -> DescribedArray<'_> {
        self.arrays.push(Box::new(move |evidence| Some(get(evidence)).filter(|view| !view.is_empty())));
        self.schema.arrays.push(ArrayDecl {
            name: name.into(),
            kind,
            unit: Unit::One,
            description: description.into(),
        });
        let last = self.schema.arrays.len() - 1;
        DescribedArray(&mut self.schema.arrays[last])
    }

    /// Declares a gate that [`Self::gates`] may return.
    pub fn gate(&mut self, name: &'static str, unit: Unit, side: Side, setting: &'static str) {
        self.schema.gates.push(GateDecl { name: name.into(), unit, side, setting: setting.into() });
    }

    /// Sets the function that returns the evaluated gates.
    pub fn gates(&mut self, get: impl Fn(&E) -> Vec<GateRecord> + Send + Sync + 'static) {
        self.gates.push(Box::new(get));
    }

    /// Sets the function that returns why the stage has no result, as one sentence.
    pub fn reason(&mut self, get: impl Fn(&E) -> Option<String> + Send + Sync + 'static) {
        self.reason = Some(Box::new(get));
    }
}
