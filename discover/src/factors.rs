//! The factors of a law: simple functions of one variable, with their values at every sample.

use calibench::robot::{JointKind, Robot};
use nalgebra::DMatrix;

use crate::variables::{Function, Variable};

/// Highest order of the waves of a joint over its own angle, per turn.
const HIGHEST_ORDER: u8 = 255;

/// Highest order of those of which products are made.
const HIGHEST_OF_PRODUCTS: u8 = 40;

/// A function varies if its standard deviation is more than this share of its largest value.
const VARIES: f64 = 1e-3;

/// A joint is loaded if it is by more than this share of the heaviest load of any.
const LOADS: f64 = 1e-3;

/// A simple function: one column, or two for a wave of unknown phase.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Factor {
    /// What it depends on.
    pub variable: Variable,
    /// What is taken from the variable, which is then divided by the scale.
    pub reference: Reference,
    /// Its functions, one a column.
    pub functions: Vec<Function>,
    /// Its columns among those of all factors.
    columns: Vec<usize>,
    /// True if products are made of it.
    pub multiplies: bool,
    /// The joint, from 0, for which alone it is tried: a wave over its own angle.
    pub only_of: Option<usize>,
}

impl Factor {
    /// Number of columns.
    pub fn width(&self) -> usize {
        self.functions.len()
    }

    /// The place of one of its columns among those of all factors.
    pub fn values_of(&self, column: usize) -> usize {
        self.columns[column]
    }

    /// True if it is a wave of unknown phase.
    pub fn is_wave(&self) -> bool {
        matches!(self.functions.as_slice(), [Function::Sine(_), Function::Cosine(_)])
    }

    /// Its columns as expressions.
    pub fn expressions(&self) -> Vec<String> {
        let Reference { offset, scale } = self.reference;
        let name = self.variable.expression();
        let of = match (offset == 0.0, scale == 1.0) {
            (true, true) => name,
            (true, false) => format!("({name}/{scale})"),
            (false, _) => format!("(({name}-{offset})/{scale})"),
        };
        self.functions.iter().map(|f| f.expression(&of)).collect()
    }
}

/// Zero and unit of a variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reference {
    /// Its zero.
    offset: f64,
    /// Its unit.
    scale: f64,
}

impl Reference {
    /// That of a variable: its largest value, to two digits, where its size is not known beforehand. A temperature has no zero of its
    /// own: it is counted from its mean.
    fn of(variable: Variable, values: &[f64]) -> Self {
        let largest = |offset: f64| values.iter().fold(0.0f64, |a, x| a.max((x - offset).abs()));
        let at =
            |offset: f64| Reference { offset, scale: Some(two_digits(largest(offset))).filter(|l| *l > 0.0).unwrap_or(1.0) };
        match variable {
            Variable::Temperature => at(two_digits(values.iter().sum::<f64>() / values.len().max(1) as f64)),
            Variable::Torque(_) | Variable::Payload | Variable::Time => at(0.0),
            _ => Reference { offset: 0.0, scale: 1.0 },
        }
    }

    fn apply(self, x: f64) -> f64 {
        (x - self.offset) / self.scale
    }
}

/// All factors, and the values of their columns (samples x columns).
#[derive(Debug, Clone)]
pub(crate) struct Factors {
    /// The factors.
    pub all: Vec<Factor>,
    /// Values of their columns.
    pub values: DMatrix<f64>,
    /// The joints that travel.
    travels: Vec<usize>,
}

/// A variable and its values at every sample.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    /// The variable.
    pub variable: Variable,
    /// Its values.
    pub values: Vec<f64>,
}

impl Factors {
    /// The factors of these variables, those that do not vary excluded.
    pub fn of(robot: &Robot, known: &[Known]) -> Self {
        let samples = known.first().map_or(0, |k| k.values.len());
        let travels = (0..robot.joints()).filter(|&j| robot.kind(j) != JointKind::Revolute).collect();
        let mut factors = Factors { all: Vec::new(), values: DMatrix::zeros(samples, 0), travels };
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let heaviest = known.iter().filter(|k| matches!(k.variable, Variable::Torque(_))).map(|k| largest_of(&k.values));
        let heaviest = heaviest.fold(0.0, f64::max);
        for Known { variable, values } in known {
            // The load on an axis through the centre of mass is what rounding makes of zero.
            if matches!(variable, Variable::Torque(_)) && largest_of(values) < LOADS * heaviest {
                continue;
            }
            let turns = factors.turns(*variable);
            let reference = Reference::of(*variable, values);
            // Factors of one variable share the columns of their functions.
            let mut made: Vec<Made> = Vec::new();
            for Kind { functions, multiplies, only_of } in kinds(*variable, turns) {
                let own: Vec<usize> = functions
                    .iter()
                    .map(|function| {
                        made.iter().find(|m| m.function == *function).map(|m| m.column).unwrap_or_else(|| {
                            columns.push(values.iter().map(|v| function.at(reference.apply(*v))).collect());
                            made.push(Made { function: *function, column: columns.len() - 1 });
                            columns.len() - 1
                        })
                    })
                    .collect();
                if own.iter().all(|&column| varies(&columns[column])) {
                    factors.all.push(Factor { variable: *variable, reference, functions, columns: own, multiplies, only_of });
                }
            }
        }
        factors.values = DMatrix::from_fn(samples, columns.len(), |i, k| columns[k][i]);
        factors
    }

    /// The columns of a product of factors as expressions, in the order of their values.
    pub fn expressions(&self, factors: &[usize]) -> Vec<String> {
        factors.iter().fold(vec![String::new()], |before, &k| {
            let own = self.all[k].expressions();
            let times = |b: &String, f: &String| if b.is_empty() { f.clone() } else { format!("{b}*{f}") };
            before.iter().flat_map(|b| own.iter().map(move |f| times(b, f))).collect()
        })
    }

    /// True if a variable is an angle.
    pub fn turns(&self, variable: Variable) -> bool {
        !variable.angles().iter().any(|j| self.travels.contains(j))
    }

    /// The same factors at other samples; zero where a variable is not known there.
    pub fn at(&self, known: &[Known]) -> Self {
        let samples = known.first().map_or(0, |k| k.values.len());
        let mut values = DMatrix::zeros(samples, self.values.ncols());
        for factor in &self.all {
            let Some(of) = known.iter().find(|k| k.variable == factor.variable) else { continue };
            for (k, f) in factor.functions.iter().enumerate() {
                values
                    .column_mut(factor.columns[k])
                    .iter_mut()
                    .zip(&of.values)
                    .for_each(|(to, v)| *to = f.at(factor.reference.apply(*v)));
            }
        }
        Factors { values, ..self.clone() }
    }
}

/// A column that was made of a function.
struct Made {
    function: Function,
    column: usize,
}

/// The largest absolute value.
fn largest_of(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a, x| a.max(x.abs()))
}

/// True if it is not the same at every sample.
fn varies(column: &[f64]) -> bool {
    let n = column.len().max(1) as f64;
    let mean = column.iter().sum::<f64>() / n;
    let spread = (column.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    spread.is_finite() && spread > VARIES * largest_of(column)
}

/// The number to two digits.
pub(crate) fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// What is tried of a variable.
#[derive(Clone)]
struct Kind {
    functions: Vec<Function>,
    multiplies: bool,
    only_of: Option<usize>,
}

fn kinds(variable: Variable, turns: bool) -> Vec<Kind> {
    use Function::{Abs, Cosine, Cube, Decay, Odd, Plain, Saturation, Sign, Sine, Square};
    let all = |list: &[Function], multiplies: bool| {
        list.iter().map(|f| Kind { functions: vec![*f], multiplies, only_of: None }).collect::<Vec<_>>()
    };
    let wave = |k: u8, multiplies: bool| Kind { functions: vec![Sine(k), Cosine(k)], multiplies, only_of: None };
    match variable {
        Variable::Joint(j) if turns => {
            let own = (5..=HIGHEST_ORDER).map(|k| Kind { only_of: Some(j), ..wave(k, k <= HIGHEST_OF_PRODUCTS) });
            let common = (1..=4).map(|k| wave(k, k < 4)).chain(all(&[Plain, Sine(1), Cosine(1), Square, Abs], true));
            let both = Kind { functions: vec![Sine(1), Cosine(1), Sine(2), Cosine(2)], multiplies: false, only_of: None };
            let others = all(&[Cube, Saturation(3), Saturation(10)], false);
            common.chain([both]).chain(others).chain(own).collect()
        }
        Variable::Sum(..) | Variable::Difference(..) if turns => vec![wave(1, true), wave(2, false)],
        Variable::Sum(..) | Variable::Difference(..) => Vec::new(),
        Variable::Torque(_) | Variable::Down(_) => {
            [all(&[Plain, Abs, Saturation(3)], true), all(&[Square, Odd, Cube, Saturation(10), Sign], false)].concat()
        }
        Variable::Approach(_) | Variable::Payload => all(&[Plain], true),
        Variable::Move(_) => all(&[Plain, Sign], false),
        Variable::Time => [all(&[Plain, Decay(3)], true), all(&[Square, Decay(10)], false)].concat(),
        Variable::Joint(_) | Variable::Hose(_) | Variable::Tcp(_) | Variable::Temperature => {
            [all(&[Plain], true), all(&[Square], false)].concat()
        }
    }
}
