//! Names to the values that they stand for, numbers to their kinds: a tree that needs no further decision.

use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData, canonical_name};

use super::error::ExpressionError;
use super::parser::{Arithmetic, Function, Kind, Name, Node, Relation};

/// An expression tied to the particles of one file.
#[derive(Debug)]
pub struct Bound<'a> {
    pub(super) root: Test<'a>,
    /// Particles.
    pub(super) len: usize,
}

/// One component of values per particle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column<'a> {
    pub(super) values: Values<'a>,
    /// Numbers a particle.
    pub(super) stride: usize,
    pub(super) component: usize,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Values<'a> {
    F32(&'a [f32]),
    F64(&'a [f64]),
    I32(&'a [i32]),
    I64(&'a [i64]),
}

/// A condition.
#[derive(Debug)]
pub(super) enum Test<'a> {
    Compare(Relation, Number<'a>, Number<'a>),
    /// `wholes` is sorted and matters only to a whole value; the others are compared one by one.
    In {
        value: Number<'a>,
        wholes: Vec<i64>,
        others: Vec<Number<'a>>,
        is_negated: bool,
    },
    Not(Box<Test<'a>>),
    And(Box<[Test<'a>; 2]>),
    Or(Box<[Test<'a>; 2]>),
}

/// A number: whole ones are kept so until they are computed with.
#[derive(Debug)]
pub(super) enum Number<'a> {
    Whole(Whole<'a>),
    Real(Real<'a>),
}

#[derive(Debug)]
pub(super) enum Whole<'a> {
    Constant(i64),
    Column(Column<'a>),
    Index,
}

#[derive(Debug)]
pub(super) enum Real<'a> {
    Constant(f64),
    Column(Column<'a>),
    OfWhole(Whole<'a>),
    Negate(Box<Real<'a>>),
    Abs(Box<Real<'a>>),
    Arithmetic(Arithmetic, Box<[Real<'a>; 2]>),
    Least(Vec<Real<'a>>),
    Most(Vec<Real<'a>>),
    Length(Vec<Column<'a>>),
}

/// Ties `root` to `particles`.
pub(super) fn bind<'a>(text: &str, root: &Node, particles: &'a Particles) -> Result<Bound<'a>, ExpressionError> {
    let binder = Binder { text, particles };
    Ok(Bound { root: binder.test(root)?, len: particles.positions.len() })
}

struct Binder<'t, 'a> {
    text: &'t str,
    particles: &'a Particles,
}

/// What a name stands for.
struct Found<'a> {
    values: Values<'a>,
    components: usize,
}

impl<'a> Binder<'_, 'a> {
    fn fail<T>(&self, node: &Node, message: impl Into<String>) -> Result<T, ExpressionError> {
        Err(ExpressionError::new(self.text, node.place.clone(), message))
    }

    fn test(&self, node: &Node) -> Result<Test<'a>, ExpressionError> {
        let pair = |pair: &[Node; 2]| Ok(Box::new([self.test(&pair[0])?, self.test(&pair[1])?]));
        Ok(match &node.kind {
            Kind::Compare(relation, pair) => Test::Compare(*relation, self.number(&pair[0])?, self.number(&pair[1])?),
            Kind::In { value, list, is_negated } => self.membership(value, list, *is_negated)?,
            Kind::Not(inner) => Test::Not(Box::new(self.test(inner)?)),
            Kind::And(both) => Test::And(pair(both)?),
            Kind::Or(both) => Test::Or(pair(both)?),
            // The parser lets nothing else through.
            _ => return self.fail(node, "a condition is wanted here"),
        })
    }

    fn membership(&self, value: &Node, list: &[Node], is_negated: bool) -> Result<Test<'a>, ExpressionError> {
        let value = self.number(value)?;
        let (mut wholes, mut others) = (Vec::new(), Vec::new());
        for item in list {
            match (&value, self.number(item)?) {
                (Number::Whole(_), Number::Whole(Whole::Constant(whole))) => wholes.push(whole),
                (_, other) => others.push(other),
            }
        }
        wholes.sort_unstable();
        Ok(Test::In { value, wholes, others, is_negated })
    }

    fn number(&self, node: &Node) -> Result<Number<'a>, ExpressionError> {
        Ok(match &node.kind {
            Kind::Whole(value) => Number::Whole(Whole::Constant(*value)),
            Kind::Name(name) if name.text == "index" && !name.is_attribute() => {
                if name.component.is_some() {
                    return self.fail(node, "index is one number: it has no components");
                }
                Number::Whole(Whole::Index)
            }
            Kind::Name(name) => {
                let column = self.column(node, name)?;
                match column.values {
                    Values::I32(_) | Values::I64(_) => Number::Whole(Whole::Column(column)),
                    Values::F32(_) | Values::F64(_) => Number::Real(Real::Column(column)),
                }
            }
            _ => Number::Real(self.real(node)?),
        })
    }

    fn real(&self, node: &Node) -> Result<Real<'a>, ExpressionError> {
        Ok(match &node.kind {
            Kind::Real(value) => Real::Constant(*value),
            Kind::Negate(inner) => Real::Negate(Box::new(self.real(inner)?)),
            Kind::Arithmetic(operation, pair) => {
                Real::Arithmetic(*operation, Box::new([self.real(&pair[0])?, self.real(&pair[1])?]))
            }
            Kind::Call(Function::Length, arguments) => self.length(node, arguments)?,
            Kind::Call(function, arguments) => {
                let mut values = arguments.iter().map(|a| self.real(a)).collect::<Result<Vec<_>, _>>()?;
                match (function, values.len()) {
                    (Function::Abs, 1) => Real::Abs(Box::new(values.remove(0))),
                    (Function::Min, _) => Real::Least(values),
                    _ => Real::Most(values),
                }
            }
            Kind::Whole(_) | Kind::Name(_) => match self.number(node)? {
                Number::Whole(whole) => Real::OfWhole(whole),
                Number::Real(real) => real,
            },
            // The parser lets nothing else through.
            _ => return self.fail(node, "a number is wanted here"),
        })
    }

    fn length(&self, node: &Node, arguments: &[Node]) -> Result<Real<'a>, ExpressionError> {
        let [Node { kind: Kind::Name(name), .. }] = arguments else {
            return self.fail(node, "length takes one vector");
        };
        let found = self.find(&arguments[0], name)?;
        if found.components == 1 {
            return self.fail(node, format!("{0} is one number, no vector: write abs({0})", name.text));
        }
        let column = |component| Column { values: found.values, stride: found.components, component };
        Ok(Real::Length((0..found.components).map(column).collect()))
    }

    /// The column that a name and its component mean.
    fn column(&self, node: &Node, name: &Name) -> Result<Column<'a>, ExpressionError> {
        if !name.is_attribute() && name.text != "position" {
            let component = ["x", "y", "z"].iter().position(|axis| *axis == name.text);
            let (Some(component), None) = (component, name.component) else {
                return self.fail(node, format!("{} is one number: it has no components", name.text));
            };
            return Ok(Column { component, stride: 3, values: self.positions() });
        }
        let found = self.find(node, name)?;
        let text = &name.text;
        let component = match (found.components, name.component) {
            (1, None) => 0,
            (1, Some(_)) => {
                return self.fail(node, format!("{text} is one number per particle: write {text} alone"));
            }
            (components, None) => {
                let what = format!(
                    "{text} has {components} components: choose one, as in {text}.x or {text}[0], or take length({text})"
                );
                return self.fail(node, what);
            }
            (components, Some(component)) if component >= components => {
                return self.fail(
                    node,
                    format!("{text} has {components} components: the last one is {text}[{}]", components - 1),
                );
            }
            (_, Some(component)) => component,
        };
        Ok(Column { component, stride: found.components, values: found.values })
    }

    fn positions(&self) -> Values<'a> {
        match &self.particles.positions {
            PositionData::F32(p) => Values::F32(p.as_flattened()),
            PositionData::F64(p) => Values::F64(p.as_flattened()),
        }
    }

    fn find(&self, node: &Node, name: &Name) -> Result<Found<'a>, ExpressionError> {
        if !name.is_attribute() && name.text == "position" {
            return Ok(Found { values: self.positions(), components: 3 });
        }
        if !name.is_attribute() {
            return self.fail(node, format!("{} is one number, no vector", name.text));
        }
        // As the reader asked for it: by its own name, or by the one that it has in the file.
        let attributes = &self.particles.attributes;
        let is_meant = |a: &&ParticleAttribute| a.name == canonical_name(&name.text, a.components);
        let Some(attribute) = self.particles.attribute(&name.text).or_else(|| attributes.iter().find(is_meant)) else {
            return self.fail(node, self.unknown(name));
        };
        let expected = self.particles.positions.len().saturating_mul(attribute.components);
        if attribute.components == 0 || attribute.values.len() != expected {
            return self.fail(node, format!("{} does not have its values for every particle", name.text));
        }
        let values = match &attribute.values {
            AttributeValues::F32(values) => Values::F32(values),
            AttributeValues::F64(values) => Values::F64(values),
            AttributeValues::I32(values) => Values::I32(values),
            AttributeValues::I64(values) => Values::I64(values),
        };
        Ok(Found { values, components: attribute.components })
    }

    fn unknown(&self, name: &Name) -> String {
        let known: Vec<&str> = self.particles.attributes.iter().map(|a| a.name.as_str()).collect();
        let listed = if known.is_empty() { "the position only".to_owned() } else { known.join(", ") };
        let near = known.iter().map(|k| (edits(k, &name.text), k)).min();
        let hint = match near {
            Some((edits, near)) if edits <= 1 + name.text.chars().count() / 4 => format!(" (did you mean {near}?)"),
            _ if name.is_quoted => " (quotes enclose names; values are numbers)".to_owned(),
            _ => String::new(),
        };
        format!("no attribute is named '{}'; there are: {listed}{hint}", name.text)
    }
}

/// Characters to insert, remove or replace to make one name the other, case apart: Levenshtein's distance, 1966.
fn edits(a: &str, b: &str) -> usize {
    let lower = |s: &str| -> Vec<char> { s.chars().flat_map(char::to_lowercase).take(100).collect() };
    let (a, b) = (lower(a), lower(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
