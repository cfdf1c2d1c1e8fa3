//! Arithmetic, comparison and logic.

use super::tree::Operator;
use super::trouble::Trouble;
use super::value::Value;

pub(crate) fn truth(value: &Value) -> Result<bool, Trouble> {
    value.boolean().ok_or_else(|| Trouble::new(format!("True or False is needed here, not {}", value.kind())))
}

pub(crate) fn negate(value: &Value) -> Result<Value, Trouble> {
    match value {
        Value::Integer(number) => number.checked_neg().map(Value::Integer).ok_or_else(too_large),
        Value::Float(number) => Ok(Value::Float(-number)),
        other => Err(Trouble::new(format!("{} has no negative", other.kind()))),
    }
}

/// The result of an operator for two values. `and` and `or` come here only if the left value leaves it open.
pub(crate) fn apply(operator: Operator, left: &Value, right: &Value) -> Result<Value, Trouble> {
    match operator {
        Operator::And => Ok(Value::Bool(truth(left)? && truth(right)?)),
        Operator::Or => Ok(Value::Bool(truth(left)? || truth(right)?)),
        Operator::Xor => Ok(Value::Bool(truth(left)? != truth(right)?)),
        Operator::Equal => Ok(Value::Bool(equal(left, right))),
        Operator::NotEqual => Ok(Value::Bool(!equal(left, right))),
        _ => match (left, right) {
            (Value::Integer(left), Value::Integer(right)) => integers(operator, *left, *right),
            _ => match (left.number(), right.number()) {
                (Some(left), Some(right)) => floats(operator, left, right),
                _ => Err(Trouble::new(format!("{} and {} cannot be combined so", left.kind(), right.kind()))),
            },
        },
    }
}

/// Values of different kinds are unequal, not an error: programs compare a thread's variable with zero.
fn equal(left: &Value, right: &Value) -> bool {
    match (left, right) {
        (Value::List(left), Value::List(right)) => {
            left.len() == right.len() && left.iter().zip(right).all(|(left, right)| equal(left, right))
        }
        (Value::Integer(left), Value::Integer(right)) => left == right,
        _ => match (left.number(), right.number()) {
            (Some(left), Some(right)) => left == right,
            _ => left == right,
        },
    }
}

fn integers(operator: Operator, left: i64, right: i64) -> Result<Value, Trouble> {
    let result = match operator {
        Operator::Less => return Ok(Value::Bool(left < right)),
        Operator::Greater => return Ok(Value::Bool(left > right)),
        Operator::LessEqual => return Ok(Value::Bool(left <= right)),
        Operator::GreaterEqual => return Ok(Value::Bool(left >= right)),
        Operator::Add => left.checked_add(right),
        Operator::Subtract => left.checked_sub(right),
        Operator::Multiply => left.checked_mul(right),
        Operator::Remainder if right != 0 => left.checked_rem(right),
        _ => return floats(operator, left as f64, right as f64),
    };
    result.map(Value::Integer).ok_or_else(too_large)
}

fn floats(operator: Operator, left: f64, right: f64) -> Result<Value, Trouble> {
    if right == 0.0 && matches!(operator, Operator::Divide | Operator::Remainder) {
        return Err(Trouble::new("division by zero"));
    }
    let result = match operator {
        Operator::Less => return Ok(Value::Bool(left < right)),
        Operator::Greater => return Ok(Value::Bool(left > right)),
        Operator::LessEqual => return Ok(Value::Bool(left <= right)),
        Operator::GreaterEqual => return Ok(Value::Bool(left >= right)),
        Operator::Add => left + right,
        Operator::Subtract => left - right,
        Operator::Multiply => left * right,
        Operator::Divide => left / right,
        Operator::Remainder => left % right,
        _ => return Err(Trouble::new("numbers cannot be combined so")),
    };
    if result.is_finite() { Ok(Value::Float(result)) } else { Err(too_large()) }
}

fn too_large() -> Trouble {
    Trouble::new("the result is too large for a number")
}

/// The element of a list or a pose.
pub(crate) fn element(list: &Value, index: &Value) -> Result<Value, Trouble> {
    let place = place(index)?;
    let found = match list {
        Value::List(elements) => elements.get(place).cloned(),
        Value::Pose(pose) => pose.get(place).copied().map(Value::Float),
        other => return Err(Trouble::new(format!("{} has no elements", other.kind()))),
    };
    found.ok_or_else(|| Trouble::new(format!("there is no element {place}")))
}

/// The list or pose with another element; several indices lead into lists of lists.
pub(crate) fn set_element(mut list: Value, indices: &[Value], value: Value) -> Result<Value, Trouble> {
    let mut within = &mut list;
    let mut indices = indices.iter().peekable();
    while let Some(index) = indices.next() {
        let place = place(index)?;
        let missing = || Trouble::new(format!("there is no element {place}"));
        match within {
            Value::List(elements) => within = elements.get_mut(place).ok_or_else(missing)?,
            Value::Pose(pose) if indices.peek().is_none() => {
                let number = value.number();
                let number =
                    number.ok_or_else(|| Trouble::new(format!("a pose is made of numbers, not of {}", value.kind())))?;
                *pose.get_mut(place).ok_or_else(missing)? = number;
                return Ok(list);
            }
            other => return Err(Trouble::new(format!("{} has no elements", other.kind()))),
        }
    }
    *within = value;
    Ok(list)
}

fn place(index: &Value) -> Result<usize, Trouble> {
    match index {
        Value::Integer(index) => {
            usize::try_from(*index).map_err(|_| Trouble::new(format!("an index of {index} is before the first element")))
        }
        other => Err(Trouble::new(format!("an index is a whole number, not {}", other.kind()))),
    }
}
